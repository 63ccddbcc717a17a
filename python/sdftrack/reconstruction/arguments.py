# SPDX-License-Identifier: MIT
"""A reconstructor's arguments and first frames: errors state the argument, what was expected and given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.validation import number, of_kind, shown
from sdftrack.camera import Camera
from sdftrack.device import device_number
from sdftrack.frame import Frame
from sdftrack.imaging.pose_hint import Place
from sdftrack.options import TrackerOptions
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.sdf import SDF
from sdftrack.sdf.volume import part_inside

MAX_VOXELS = 512
BYTES_PER_VOXEL = 20


def shape_of(core: Any, least: int, margin: int | None = None) -> SDF:
    """A copy of the current distances and colours; colours observed less than `least` are omitted. `margin`: only so
    many voxels around what is inside, if anything is."""
    phi, rgb_seen, origin = core.phi, core.rgb_seen, core.origin
    if margin is not None and (part := part_inside(phi, margin)) is not None:
        phi, rgb_seen = phi[part], rgb_seen[part]
        origin = origin + core.voxel_m * np.array([along.start for along in reversed(part)])
    seen = rgb_seen[..., 3] >= least
    colors, rgb = None, rgb_seen[seen, :3]
    if rgb.any():
        colors = np.zeros(rgb_seen.shape, np.uint8)
        colors[seen, :3] = (rgb + 128) >> 8
        colors[seen, 3] = 255
    return SDF._own(np.array(phi, order="C"), core.voxel_m, origin, colors)


VOXELS = {"quick": 96, "normal": 200, "fine": 300}


def voxels_of(voxels: Any) -> Any:
    """Resolve a named number of voxels; other values are returned unchanged."""
    if not isinstance(voxels, str):
        return voxels
    if voxels not in VOXELS:
        raise ValueError(
            f"voxels: expected a whole number or one of {', '.join(map(repr, VOXELS))}, got {voxels!r}"
        )
    return VOXELS[voxels]


def check_settings(initial: Any, voxels: Any, extent: float | None, device: str, mode: str) -> None:
    """Check types and ranges."""
    if initial is not None:
        of_kind(initial, SDF, "initial", "make one with SDF.from_mesh or SDF.sphere")
    if isinstance(voxels, bool) or not isinstance(voxels, (int, np.integer)):
        raise TypeError(f"voxels: expected a whole number, got {voxels!r}")
    if not 16 <= voxels <= MAX_VOXELS:
        needed = BYTES_PER_VOXEL * number(voxels, "voxels") * float(min(abs(voxels), 2**40)) ** 2 / 2**30
        raise ValueError(
            f"voxels: expected 16 to {MAX_VOXELS}, got {shown(voxels)} (which would need {needed:.3g} GiB)"
        )
    if extent is not None and not 0 < extent < 10:
        raise ValueError(f"extent: expected metres between 0 and 10, got {extent!r}")
    device_number(device)
    if mode not in ("auto", "depth", "rgbd"):
        raise ValueError(f"mode: expected 'auto', 'depth' or 'rgbd', got {mode!r}")


def check_beginning(
    frame: Frame,
    camera: Camera,
    mask: Any,
    box: Any,
    pose: Any,
    initial: SDF | None = None,
    *,
    known: bool = False,
) -> None:
    """Check the first frame and that exactly one hint for the object is given."""
    # `known`: a shape already exists, so its pose may be given.
    of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
    if frame.depth is None:
        raise ValueError(
            f"frame: expected a depth image at the start, got none ({frame.error or 'colour only'})"
        )
    depth = frame.depth
    if depth.shape != (camera.height, camera.width):
        raise ValueError(
            f"depth: expected the camera's size {camera.width} x {camera.height}, got "
            f"{depth.shape[1]} x {depth.shape[0]}; scale the camera with Camera.scaled"
        )
    given = [name for name, v in (("mask", mask), ("box", box), ("pose", pose)) if v is not None]
    if len(given) != 1:
        raise ValueError(f"expected one of mask, box and pose, got {' and '.join(given) or 'none'}")
    if pose is not None and initial is None and not known:
        raise ValueError(
            "pose: requires Reconstructor(camera, initial=sdf), whose pose it is; otherwise give mask or box"
        )


Array = NDArray[np.float64]


def find_object(
    frame: Frame,
    place: Place,
    camera: Camera,
    initial: SDF | None,
    options: ReconstructorOptions,
) -> _core.Beginning:
    """The object at a mask, a box, or the pose of the initial shape (see `sdftrack.imaging.pose_hint`)."""
    assert frame.depth is not None
    shape = None if initial is None else initial._core_args
    return _core.find_object(frame.depth, frame._given, place, camera._core, shape, options)


def find_standing(
    frame: Frame, pose: Array, camera: Camera, shape: SDF, options: ReconstructorOptions
) -> _core.Beginning:
    """The object's pixels at the pose of a shape, whose outline is unknown, with the planes that it stands on."""
    assert frame.depth is not None
    return _core.find_standing(frame.depth, frame._given, pose, camera._core, shape._core_args, options)


def printed_tracker_options() -> TrackerOptions:
    """Options of the thesis' tracker, which does not assess its poses."""
    return TrackerOptions.printed().replace(
        lost_inliers=0.0, weak_inliers=0.0, lost_evidence=0.0, weak_evidence=0.0
    )
