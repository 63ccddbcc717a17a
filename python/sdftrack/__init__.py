# SPDX-License-Identifier: MIT
"""Track and reconstruct rigid objects with an RGB-D camera, by signed distance functions."""

from sdftrack import geometry, levelset, metrics, superpixels, synth, testing
from sdftrack._core import __version__
from sdftrack.build_info import info
from sdftrack.calibration.color_result import ColorCalibration
from sdftrack.calibration.color_to_depth import calibrate_color_to_depth
from sdftrack.calibration.intrinsics import calibrate_intrinsics
from sdftrack.calibration.intrinsics_result import IntrinsicsResult
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.device import cuda_available
from sdftrack.energy import Energy, State, back_project, minimize
from sdftrack.frame import Frame
from sdftrack.io.datasets import Sequence, open_sequence
from sdftrack.io.save import save_sequence
from sdftrack.mesh import Mesh
from sdftrack.options import TrackerOptions
from sdftrack.plane import remove_plane
from sdftrack.primitives import Primitive, PrimitiveFit, fit_primitive, fit_primitives
from sdftrack.reconstruction import Reconstructor, ReconstructorOptions
from sdftrack.recorder import Recorder
from sdftrack.results import Status, Step, TrackResult
from sdftrack.sdf import SDF, MeshReport, smooth_union, union
from sdftrack.tracking import Tracker
from sdftrack.viz import draw

__all__ = [
    "SDF",
    "Camera",
    "ColorCalibration",
    "Energy",
    "Frame",
    "IntrinsicsResult",
    "Mesh",
    "MeshReport",
    "Primitive",
    "PrimitiveFit",
    "RGBDCamera",
    "Reconstructor",
    "ReconstructorOptions",
    "Recorder",
    "Sequence",
    "State",
    "Status",
    "Step",
    "TrackResult",
    "Tracker",
    "TrackerOptions",
    "__version__",
    "back_project",
    "calibrate_color_to_depth",
    "calibrate_intrinsics",
    "cuda_available",
    "draw",
    "fit_primitive",
    "fit_primitives",
    "geometry",
    "info",
    "levelset",
    "metrics",
    "minimize",
    "open_sequence",
    "remove_plane",
    "save_sequence",
    "smooth_union",
    "superpixels",
    "synth",
    "testing",
    "union",
]
