# SPDX-License-Identifier: MIT
"""Write a sequence in a layout supported by other programs; docs/data.md describes the layouts."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.files import replacing_folder, write_json, write_text
from sdftrack._internal.validation import of_kind
from sdftrack.camera import Camera, depth_camera
from sdftrack.frame import Frame
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.io.frames import write_color, write_depth_units, write_mask
from sdftrack.io.trajectories import write_log, write_tum

__all__ = ["save_sequence"]

MM_PER_M = 1000.0
FRAME_PERIOD_S = 1 / 30  # for TUM's files, where a sequence has no times


def save_sequence(path: str | os.PathLike[str], seq: Sequence, layout: str = "bop") -> None:
    """Write `seq` into the new or empty folder `path`, completely or not at all.

    Parameters
    ----------
    path : folder
    seq : Sequence
    layout : "bop", "tum" or "open3d"
        bop: every pose, mask and model; depth in 0.1 mm (in 1 mm beyond 6.5 m). tum: one object, depth in
        0.2 mm up to 13.1 m. open3d: one object, depth in 1 mm up to 65.5 m. An unreadable frame has no images in bop
        and is omitted in the others. Colour that is not aligned to depth is omitted, with a UserWarning, because none
        of the three can store the mapping.

    Raises
    ------
    FileExistsError
        The folder is not empty.
    ValueError
        Something that the layout cannot represent: lens distortion (bop, open3d), changing cameras or several objects
        (tum, open3d), depth beyond its range.
    """
    of_kind(seq, Sequence, "seq")
    writers: dict[str, Callable[[Path, Sequence], None]] = {
        "bop": _save_bop,
        "tum": _save_tum,
        "open3d": _save_open3d,
    }
    if layout not in writers:
        raise ValueError(f"layout: expected one of {', '.join(writers)}, got {layout!r}")
    if not seq.camera.aligned:
        warnings.warn(
            f"{path}: colour is omitted: the {layout} layout requires it to be aligned to depth", stacklevel=2
        )
    with replacing_folder(path) as folder:
        writers[layout](folder, seq)


def _save_bop(folder: Path, seq: Sequence) -> None:
    cameras: dict[str, Any] = {}
    truth: dict[str, Any] = {}
    for name in ("depth", "rgb", "mask_visib", "models"):
        (folder / name).mkdir()
    for i, frame in enumerate(seq):
        im_id = seq.ids[i]
        camera = seq.camera.depth if frame.camera is None else depth_camera(frame.camera)
        _check_no_lens(camera, "bop")
        mm = 0.1
        if frame.depth is not None:
            mm = 0.1 if frame.depth.max() < 6.5 else 1.0
            write_depth_units(folder / "depth" / f"{im_id:06d}.png", _units(frame, MM_PER_M / mm))
        _write_color(folder / "rgb" / f"{im_id:06d}.png", frame, seq)
        cameras[str(im_id)] = {"cam_K": camera.K.ravel().tolist(), "depth_scale": mm}
        poses = sorted(seq.ground_truth.get(i, {}).items())
        truth[str(im_id)] = [
            {
                "obj_id": seq.objects[k],
                "cam_R_m2c": T[:3, :3].ravel().tolist(),
                "cam_t_m2c": (MM_PER_M * T[:3, 3]).tolist(),
            }
            for k, T in poses
        ]
        masks = seq.masks(i)
        for place, (k, _) in enumerate(poses):
            if k in masks:
                write_mask(folder / "mask_visib" / f"{im_id:06d}_{place:06d}.png", masks[k])
    write_json(folder / "scene_camera.json", cameras)
    if seq.ground_truth:
        write_json(folder / "scene_gt.json", truth)
    for obj_id, mesh in seq.models.items():
        type(mesh)(MM_PER_M * np.asarray(mesh.vertices), mesh.faces, mesh.colors).save(
            folder / "models" / f"obj_{obj_id:06d}.ply"
        )
    _remove_empty(folder)


def _save_tum(folder: Path, seq: Sequence) -> None:
    lists: dict[str, list[str]] = {"depth": ["# timestamp filename"], "rgb": ["# timestamp filename"]}
    times: list[float] = []
    poses: list[tuple[float, NDArray[np.float64]] | None] = []
    truth = _one_object(seq, "tum")
    for name in lists:
        (folder / name).mkdir()
    for i, frame in enumerate(seq):
        if frame.depth is None:
            continue
        time = i * FRAME_PERIOD_S if frame.timestamp is None else frame.timestamp
        file = f"{time:.6f}.png"
        if times and f"{times[-1]:.6f}.png" == file:
            raise ValueError(f"timestamp: frames {i - 1} and {i} have the same time {time:.6f} s")
        write_depth_units(folder / "depth" / file, _units(frame, 5000.0))
        lists["depth"].append(f"{time:.6f} depth/{file}")
        if _write_color(folder / "rgb" / file, frame, seq):
            lists["rgb"].append(f"{time:.6f} rgb/{file}")
        times.append(time)
        poses.append((time, geometry.inverse(truth[i])) if i in truth else None)
    for name, lines in lists.items():
        write_text(folder / f"{name}.txt", "\n".join(lines) + "\n")
    known = [p for p in poses if p is not None]
    if known:
        write_tum(folder / "groundtruth.txt", [t for t, _ in known], [T for _, T in known])
    seq.camera.depth.save(folder / "camera.json")
    _write_model(folder, seq)
    _remove_empty(folder)


def _save_open3d(folder: Path, seq: Sequence) -> None:
    camera = seq.camera.depth
    _check_no_lens(camera, "open3d")
    truth = _one_object(seq, "open3d")
    for name in ("depth", "color"):
        (folder / name).mkdir()
    poses = {}
    frames = ((i, frame) for i, frame in enumerate(seq) if frame.depth is not None)
    for n, (i, frame) in enumerate(frames):
        write_depth_units(folder / "depth" / f"{n:06d}.png", _units(frame, MM_PER_M))
        _write_color(folder / "color" / f"{n:06d}.png", frame, seq)
        if i in truth:
            poses[n] = geometry.inverse(truth[i])
    write_json(
        folder / "intrinsic.json",
        {
            "width": camera.width,
            "height": camera.height,
            "intrinsic_matrix": camera.K.T.ravel().tolist(),  # column by column
            "depth_scale": MM_PER_M,
        },
    )
    if poses:
        write_log(folder / "trajectory.log", list(poses), np.array(list(poses.values())))
    _write_model(folder, seq)
    _remove_empty(folder)


def _units(frame: Frame, units_per_m: float) -> NDArray[np.uint16]:
    assert frame.depth is not None
    farthest = float(frame.depth.max())
    if round(farthest * units_per_m) > 65535:
        raise ValueError(
            f"depth: frame {frame.index} has {farthest:.2f} m, 16 bits are limited to {65535 / units_per_m:.2f} m; "
            "crop the depth or choose another layout"
        )
    return np.rint(frame.depth.astype(np.float64) * units_per_m).astype(np.uint16)


def _write_color(path: Path, frame: Frame, seq: Sequence) -> bool:
    if frame.color is None or not seq.camera.aligned:
        return False
    write_color(path, frame.color)
    return True


def _one_object(seq: Sequence, layout: str) -> dict[int, NDArray[np.float64]]:
    """Poses of the only object; these layouts store a camera trajectory relative to the object."""
    if len(seq.objects) > 1:
        raise ValueError(f"layout: {layout} holds one object's poses, got {len(seq.objects)}; use 'bop'")
    for frame in seq:
        if frame.camera is not None and depth_camera(frame.camera) != seq.camera.depth:
            raise ValueError(
                f"layout: {layout} holds one camera, but frame {frame.index} has its own; use 'bop'"
            )
    return {i: T for i, poses in seq.ground_truth.items() for T in poses.values()}


def _write_model(folder: Path, seq: Sequence) -> None:
    for mesh in seq.models.values():
        mesh.save(folder / "model.ply")


def _check_no_lens(camera: Camera, layout: str) -> None:
    if camera.distortion:
        raise ValueError(f"camera: the {layout} layout has no lens distortion; rectify the images or use tum")


def _remove_empty(folder: Path) -> None:
    for inside in folder.iterdir():
        if inside.is_dir() and not any(inside.iterdir()):
            inside.rmdir()
