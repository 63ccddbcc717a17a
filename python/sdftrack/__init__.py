# SPDX-License-Identifier: MIT
"""Track and reconstruct rigid objects with an RGB-D camera, using signed distance functions.

Public names are imported lazily (PEP 562): ``import sdftrack`` takes a few milliseconds, and a program loads only the
parts that it uses.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from sdftrack._core import __version__  # at once: a broken build is an error of the import

if TYPE_CHECKING:  # what type checkers and editors read; a test compares it with _HOMES
    from sdftrack import (
        batch,
        contour,
        geometry,
        levelset,
        live,
        metrics,
        motion,
        superpixels,
        synth,
        testing,
    )
    from sdftrack.calibration.color_result import ColorCalibration
    from sdftrack.calibration.color_to_depth import calibrate_color_to_depth
    from sdftrack.calibration.depth import DepthCalibration, calibrate_depth
    from sdftrack.calibration.intrinsics import calibrate_intrinsics
    from sdftrack.calibration.intrinsics_result import IntrinsicsResult
    from sdftrack.camera import Camera, RGBDCamera
    from sdftrack.contour import LWPR
    from sdftrack.device import cuda_available, info
    from sdftrack.energy import Energy, PoseFit, PoseFitter, State, back_project, fit_poses, minimize
    from sdftrack.frame import Frame
    from sdftrack.imaging.plane import remove_plane
    from sdftrack.io.datasets import Sequence, open_sequence
    from sdftrack.io.writers import save_sequence
    from sdftrack.live import open_camera
    from sdftrack.mesh import Mesh
    from sdftrack.options import TrackerOptions
    from sdftrack.primitives import Primitive, PrimitiveFit, fit_primitive, fit_primitives
    from sdftrack.reconstruction import Reconstructor, ReconstructorOptions
    from sdftrack.recorder import Recorder
    from sdftrack.results import ColorDelay, ScaleEstimate, Status, Step, TrackResult
    from sdftrack.sdf import SDF, MeshReport, smooth_union, union
    from sdftrack.sensor import SensorModel
    from sdftrack.symmetry import Symmetry, find_symmetries
    from sdftrack.tracking import Tracker
    from sdftrack.viz import draw
    from sdftrack.viz.view import view

# The module that each public name comes from.
_HOMES = {
    "calibration.color_result": ("ColorCalibration",),
    "calibration.color_to_depth": ("calibrate_color_to_depth",),
    "calibration.depth": ("DepthCalibration", "calibrate_depth"),
    "calibration.intrinsics": ("calibrate_intrinsics",),
    "calibration.intrinsics_result": ("IntrinsicsResult",),
    "camera": ("Camera", "RGBDCamera"),
    "contour": ("LWPR",),
    "device": ("cuda_available", "info"),
    "energy": ("Energy", "PoseFit", "PoseFitter", "State", "back_project", "fit_poses", "minimize"),
    "frame": ("Frame",),
    "imaging.plane": ("remove_plane",),
    "io.datasets": ("Sequence", "open_sequence"),
    "io.writers": ("save_sequence",),
    "live": ("open_camera",),
    "mesh": ("Mesh",),
    "options": ("TrackerOptions",),
    "primitives": ("Primitive", "PrimitiveFit", "fit_primitive", "fit_primitives"),
    "reconstruction": ("Reconstructor", "ReconstructorOptions"),
    "recorder": ("Recorder",),
    "results": ("ColorDelay", "ScaleEstimate", "Status", "Step", "TrackResult"),
    "sdf": ("SDF", "MeshReport", "smooth_union", "union"),
    "sensor": ("SensorModel",),
    "symmetry": ("Symmetry", "find_symmetries"),
    "tracking": ("Tracker",),
    "viz": ("draw",),
    "viz.view": ("view",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "LWPR", "SDF", "Camera", "ColorCalibration", "ColorDelay", "DepthCalibration", "Energy", "Frame",
    "IntrinsicsResult", "Mesh", "MeshReport", "PoseFit", "PoseFitter", "Primitive", "PrimitiveFit", "RGBDCamera",
    "Reconstructor", "ReconstructorOptions", "Recorder", "ScaleEstimate", "SensorModel", "Sequence", "State", "Status",
    "Step", "Symmetry", "TrackResult", "Tracker", "TrackerOptions", "__version__", "back_project", "batch",
    "calibrate_color_to_depth", "calibrate_depth", "calibrate_intrinsics", "contour", "cuda_available", "draw",
    "find_symmetries", "fit_poses", "fit_primitive", "fit_primitives", "geometry", "info", "levelset", "live",
    "metrics", "minimize", "motion", "open_camera", "open_sequence", "remove_plane", "save_sequence", "smooth_union",
    "superpixels", "synth", "testing", "union", "view",
]  # fmt: skip

if not TYPE_CHECKING:  # hidden from type checkers: they would take any misspelt name for good

    def __getattr__(name: str) -> Any:
        if name in _HOME_OF:
            found = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
            globals()[name] = found  # asked for once only
            return found
        if not name.startswith("_") and find_spec(f"{__name__}.{name}") is not None:
            return import_module(f"{__name__}.{name}")  # which is an attribute from now on
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
