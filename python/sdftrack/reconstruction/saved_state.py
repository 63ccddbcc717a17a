# SPDX-License-Identifier: MIT
"""A reconstructor's state: frames and poses, from which the shape is fused again, and their record in a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sdftrack import _core
from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.saved_file import FileKind, array_of
from sdftrack._internal.thread_guard import ReentrantLock
from sdftrack._internal.validation import number, whole
from sdftrack.camera import depth_camera
from sdftrack.device import resolve_device
from sdftrack.options import TrackerOptions
from sdftrack.reconstruction.arguments import MAX_VOXELS, check_settings
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.reconstruction.refining import Keyframe
from sdftrack.tracking.interface import TrackerInterface
from sdftrack.tracking.saved_state import camera_from, camera_record, volume_from, volume_record

if TYPE_CHECKING:
    from sdftrack.reconstruction.reconstructor import Reconstructor

KIND = FileKind("sdftrack.Reconstructor", 1, "Reconstructor.save")
PLAIN = ("voxels", "extent", "mode", "threads")
KEYFRAME = ("index", "region", "depth", "rgb", "foreground", "T_cam_obj", "mask", "recording")
LATTICE = ("voxels", "voxel_m", "origin")
BALL = ("radius_m", "behind_m", "shorter_m")

Size = tuple[int, int]


def state_of(star: Reconstructor) -> dict[str, Any]:
    """Everything except volume and tracker, and the data to rebuild them."""
    state = dict(star.__dict__)
    session, tracker, _ = (state.pop(name) for name in ("_session", "_tracker", "_lock"))
    if state.pop("_any_device"):
        state["device"] = "auto"
    if session is not None:
        core = session.volume.core
        state["saved"] = {
            "beginnings": [session.beginning, *session.later],
            "keyframes": session.keyframes.frames,
            "selection": session.keyframes.record(),
            "index": session.index,
            "lattice": (tuple(core.voxels), core.voxel_m, tuple(core.origin)),
            "fused": session.volume.fused,
            "pose": TrackerInterface(tracker).last_poses[0],
        }
    return state


def restore(star: Reconstructor, state: dict[str, Any]) -> None:
    """Restore the attributes of an empty reconstructor."""
    saved = state.pop("saved", None)
    star.__dict__.update(state)
    star._any_device = star.device == "auto"
    star.device = resolve_device(star.device)
    star._session = star._tracker = None
    star._lock = ReentrantLock()
    if saved is None:
        return
    first, *later = saved["beginnings"]
    session = star._session = star._new_session(first)
    session.restore(later, saved["index"], *saved["lattice"])
    session.keyframes.restore(saved["keyframes"], **saved["selection"])
    star._fuse_all(lambda share: None)  # counts the frames that the shape is made of from now on
    star._tracker = star._new_tracker(session)
    session.set_tracker(star._tracker._core)
    star._go_on(saved["pose"])


def content_of(state: dict[str, Any]) -> dict[str, Any]:
    """Content of a file, from ``Reconstructor.__getstate__`` after a start."""
    saved, initial = state["saved"], state["initial"]
    return {
        **{name: state[name] for name in PLAIN},
        **{name: saved[name] for name in ("selection", "index", "fused", "pose")},
        "camera": camera_record(state["camera"]),
        "initial": None if initial is None else volume_record(initial),
        "options": state["options"].to_dict(),
        "tracker_options": state["tracker_options"].to_dict(),
        "beginnings": [_beginning_record(b) for b in saved["beginnings"]],
        "keyframes": [{name: getattr(k, name) for name in KEYFRAME} for k in saved["keyframes"]],
        "lattice": dict(zip(LATTICE, saved["lattice"], strict=True)),
    }


def state_from(content: dict[str, Any]) -> dict[str, Any]:
    """What ``Reconstructor.__setstate__`` takes, from the content of a file; any error of a wrong value is possible."""
    camera = camera_from(content["camera"])
    size = depth_camera(camera).shape
    options = ReconstructorOptions(**content["options"])
    initial = None if content["initial"] is None else volume_from(content["initial"])
    whole(content["threads"], "threads", 0)
    check_settings(initial, content["voxels"], content["extent"], "cpu", content["mode"])
    beginnings = [_beginning_from(record, size) for record in content["beginnings"]]
    frames = [_keyframe_from(record, size, len(beginnings)) for record in content["keyframes"]]
    saved = {
        "beginnings": beginnings,
        "keyframes": frames,
        "selection": _selection_from(content["selection"], len(frames)),
        "index": whole(content["index"], "index", 0),
        "lattice": _lattice_from(content["lattice"]),
        "pose": rigid_pose(content["pose"], "pose"),
    }
    return {
        **{name: content[name] for name in PLAIN},
        "camera": camera,
        "_frame_camera": depth_camera(camera),
        "initial": initial,
        "options": options,
        "tracker_options": TrackerOptions.from_dict(content["tracker_options"]),
        "saved": saved,
    }


def _selection_from(record: dict[str, Any], n: int) -> dict[str, Any]:
    if not n:
        raise ValueError("keyframes: expected at least one, got none")
    nearest = array_of(record["nearest"], "nearest", np.int64, (n, 2))
    if (nearest < -1).any() or (nearest >= n).any():
        raise ValueError(f"nearest: expected numbers of {n} keyframes, or -1")
    return {
        "views": array_of(record["views"], "views", np.float64, (n, 5)),
        "nearest": nearest,
        "gaps": array_of(record["gaps"], "gaps", np.float64, (n, 2)),
    }


def _beginning_record(beginning: _core.Beginning) -> dict[str, Any]:
    planes = beginning.planes
    return {
        **{name: getattr(beginning, name) for name in ("T_cam_obj", "on_object", "noise_m", "outline")},
        "ball": {
            "centre_cam": np.array(beginning.centre_cam),
            **{name: getattr(beginning, name) for name in BALL},
        },
        "view": None if planes is None else {"from_m": beginning.from_m, "planes": planes},
    }


def _beginning_from(record: dict[str, Any], size: Size) -> _core.Beginning:
    ball, view, outline = record["ball"], record["view"], record["outline"]
    bounds: dict[str, Any] = {}
    if view is not None:
        bounds["from_m"] = array_of(view["from_m"], "from_m", np.float32, size)
        bounds["planes"] = array_of(view["planes"], "planes", np.float64, (None, 5))
    if outline is not None:
        bounds["outline"] = array_of(outline, "outline", np.bool_, size)
    return _core.Beginning(
        rigid_pose(array_of(record["T_cam_obj"], "T_cam_obj", np.float64, (4, 4)), "T_cam_obj"),
        array_of(record["on_object"], "on_object", np.bool_, size),
        array_of(ball["centre_cam"], "centre_cam", np.float64, (3,)).tolist(),
        number(ball["radius_m"], "radius_m"),
        number(ball["behind_m"], "behind_m"),
        number(ball["shorter_m"], "shorter_m"),
        number(record["noise_m"], "noise_m"),
        **bounds,
    )


def _keyframe_from(record: dict[str, Any], size: Size, recordings: int) -> Keyframe:
    values = dict(record)
    height, width = size
    x0, y0, x1, y1 = region = tuple(whole(v, "region", 0) for v in values["region"])
    if not (x0 < x1 <= width and y0 < y1 <= height):
        raise ValueError(f"region: expected pixels of an image of {width} x {height}, got {region}")
    shape = (y1 - y0, x1 - x0)
    array_of(values["depth"], "depth", np.float32, shape)
    if values["rgb"] is not None:
        array_of(values["rgb"], "rgb", np.uint8, (*shape, 3))
    if values["mask"] is None:
        array_of(values["foreground"], "foreground", np.float32, shape)
    else:
        array_of(values["mask"], "mask", np.uint8, shape)
        array_of(values["foreground"], "foreground", np.float32, (0,))
    array_of(values["T_cam_obj"], "T_cam_obj", np.float64, (4, 4))
    rigid_pose(values["T_cam_obj"], "T_cam_obj")
    whole(values["index"], "index", 0)
    whole(values["recording"], "recording", 0, recordings - 1)
    return Keyframe(**{**values, "region": region})


def _lattice_from(record: dict[str, Any]) -> tuple[tuple[int, int, int], float, tuple[float, float, float]]:
    x, y, z = (whole(n, "voxels", 2, MAX_VOXELS) for n in record["voxels"])
    voxel_m = number(record["voxel_m"], "voxel_m")
    ox, oy, oz = (number(o, "origin") for o in record["origin"])
    if not (0 < voxel_m < np.inf and np.isfinite([ox, oy, oz]).all()):
        raise ValueError(f"voxel_m, origin: expected finite metres, got {voxel_m}, {[ox, oy, oz]}")
    return (x, y, z), voxel_m, (ox, oy, oz)
