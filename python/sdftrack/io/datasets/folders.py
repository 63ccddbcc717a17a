# SPDX-License-Identifier: MIT
"""Plain folders (rgb/, depth/ in mm, masks/, cam_K.txt, perhaps annotated_poses/, mesh/); Open3D and Redwood (color/,
depth/, intrinsic.json, trajectory.log; 1000 units/m)."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.text_files import contents, in_order, read_json, read_text
from sdftrack.camera import Camera
from sdftrack.camera.files import read_camera
from sdftrack.io.datasets import images
from sdftrack.io.datasets.pairing import paired, times_of
from sdftrack.io.datasets.sequence import Sequence, register
from sdftrack.io.datasets.video_images import VideoImage, VideoImages
from sdftrack.io.frames import read_mask
from sdftrack.io.report_file import read_log

DEPTH_SCALE = 1e-3


@register(
    "folders",
    "cam_K.txt, depth/, rgb/, masks/",
    lambda root: (root / "cam_K.txt").is_file(),
    ("depth_glob", "color_glob", "camera"),
)
def open_folders(
    root: Path, depth_glob: str | None = None, color_glob: str | None = None, camera: Path | None = None
) -> Sequence:
    """`depth_glob`, `color_glob`: patterns of the files below the folder; `camera`: its file, if not beside them."""
    depth = images.depth_files(root) if depth_glob is None else _matching(root, depth_glob, "depth_glob")
    color = images.color_files(root) if color_glob is None else _matching(root, color_glob, "color_glob")
    file = root / "cam_K.txt" if camera is None and depth_glob is None else camera
    if file is not None and not file.is_file():
        raise FileNotFoundError(f"{file}: this layout needs the camera's 3 x 3 matrix there")
    masks = paired(depth, images.image_files(root / "masks"), "masks")
    size = images.image_size(root, depth)
    lens = images.camera_beside(root, size) if file is None else read_camera(Camera, file, *size)
    if lens is None:
        raise FileNotFoundError(f"camera: no file of the camera in {root}; pass one")
    times = times_of(depth, str(root / "depth"))
    entries = [
        images.Entry(p, image, DEPTH_SCALE, None if times is None else float(times[i]))
        for i, (p, image) in enumerate(zip(depth, paired(depth, color), strict=True))
    ]
    poses = {}
    annotated = images.image_files(root / "annotated_poses", (".txt",))
    for i, file in enumerate(paired(depth, annotated, "poses")):
        if file is not None:
            with contents(file, "the 16 numbers of T_cam_obj, metres"):
                poses[i] = {0: np.array(read_text(file).split(), dtype=float).reshape(4, 4)}
    meshes = sorted(q for q in (root / "mesh").glob("*") if q.suffix in (".obj", ".ply", ".stl", ".glb"))

    def read_masks(i: int) -> dict[int, NDArray[np.bool_]]:
        file = masks[i]
        return {} if file is None else {0: read_mask(file, f"masks/{file.name}")}

    return images.sequence_of(
        root, "folders", entries, lens, poses, colors=len(color), meshes=meshes,
        objects=[1] if poses or masks or len(meshes) == 1 else [], ids=images.numbers_of(depth), masks=read_masks,
    )  # fmt: skip


def _matching(root: Path, pattern: str, name: str) -> list[Path]:
    found = in_order(p for p in root.glob(pattern) if p.is_file())
    if not found:
        raise ValueError(f"{name}: nothing in {root} matches {pattern!r}")
    return found


UNITS_PER_M = 1000.0
DEFAULT = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)  # PrimeSense's, which Redwood's recordings use
CAMERA_FILES = ("intrinsic.json", "camera_intrinsic.json", "intrinsics.json", "camera_primesense.json")
TRAJECTORIES = ("trajectory.log", "scene/trajectory.log")


def _detect(root: Path) -> bool:
    if not (root / "depth").is_dir():
        return False
    if any((root / name).is_file() for name in CAMERA_FILES):
        return True
    first = next(iter(images.image_files(root / "depth", images.DEPTH_SUFFIXES)), None)
    redwood = first is not None and re.fullmatch(r"\d+-\d+", first.stem) is not None
    color = any((root / name).is_dir() for name in images.COLOR_FOLDERS)
    return color and ((root / "color").is_dir() or redwood or (root / TRAJECTORIES[0]).is_file())


@register("open3d", "depth/, color/, intrinsic.json", _detect)
def open_open3d(root: Path) -> Sequence:
    depth, color = images.depth_files(root), images.color_files(root)
    video = None if color else VideoImages.of(root)
    camera, units = _camera(root, images.image_size(root, depth))
    found: list[Path | VideoImage | None] = [*paired(depth, color)]
    if video is not None:
        numbers = [re.match(r"\d+", p.stem) for p in depth]
        found = [VideoImage(video, int(number[0])) if number else None for number in numbers]
    times = times_of(depth, str(root / "depth"))
    entries = [
        images.Entry(p, found[i], 1 / units, None if times is None else float(times[i]))
        for i, p in enumerate(depth)
    ]
    log = next((root / name for name in TRAJECTORIES if (root / name).is_file()), None)
    poses = {} if log is None else read_log(log)
    truth = {i: {0: geometry.inverse(T)} for i, T in poses.items() if 0 <= i < len(depth)}
    return images.sequence_of(
        root, "open3d", entries, camera, truth, colors=len(color), meshes=sorted(root.glob("*.ply")), video=video,
        objects=[1] if truth else None, ids=images.numbers_of(depth),
    )  # fmt: skip


def _camera(root: Path, size: tuple[int, int]) -> tuple[Camera, float]:
    for name in CAMERA_FILES:
        if (root / name).is_file():
            values = read_json(root / name)
            with contents(root / name, "a JSON object with the camera"):
                units = float(values.get("depth_scale", UNITS_PER_M))
            if not units > 1:
                raise ValueError(
                    f"{root / name}: depth_scale: expected units per metre (1000), got {units:g}"
                )
            return read_camera(Camera, root / name, *size), units
    if size == (DEFAULT.width, DEFAULT.height):
        warnings.warn(f"{root}: no intrinsic.json; using PrimeSense's camera (525 px)", stacklevel=4)
        return DEFAULT, UNITS_PER_M
    raise ValueError(f"{root}: no camera for images of {size[0]} x {size[1]}; put an intrinsic.json there")
