# SPDX-License-Identifier: MIT
"""Open3D and Redwood: color/ (rgb/, image/, a video), depth/, intrinsic.json, trajectory.log; 1000 units/m."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

from sdftrack import geometry
from sdftrack._internal.text_files import contents, read_json
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.camera.files import read_camera
from sdftrack.io.datasets.images import (
    COLOR_FOLDERS,
    DEPTH_SUFFIXES,
    Entry,
    ImageFrames,
    color_files,
    depth_files,
    image_files,
    image_size,
    numbers_of,
)
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.pairing import paired, times_of
from sdftrack.io.datasets.sequence import LazyModels, Sequence
from sdftrack.io.datasets.video_images import VideoImage, VideoImages
from sdftrack.io.trajectories import read_log

UNITS_PER_M = 1000.0
DEFAULT = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)  # PrimeSense's, which Redwood's recordings use
CAMERA_FILES = ("intrinsic.json", "camera_intrinsic.json", "intrinsics.json", "camera_primesense.json")
TRAJECTORIES = ("trajectory.log", "scene/trajectory.log")


def _detect(root: Path) -> bool:
    if not (root / "depth").is_dir():
        return False
    if any((root / name).is_file() for name in CAMERA_FILES):
        return True
    color = any((root / name).is_dir() for name in COLOR_FOLDERS)
    first = next(iter(image_files(root / "depth", DEPTH_SUFFIXES)), None)
    redwood = first is not None and re.fullmatch(r"\d+-\d+", first.stem) is not None
    return color and ((root / "color").is_dir() or redwood or (root / TRAJECTORIES[0]).is_file())


@register("open3d", "depth/, color/, intrinsic.json", _detect)
def open_open3d(root: Path) -> Sequence:
    depth, color = depth_files(root), color_files(root)
    video = None if color else VideoImages.of(root)
    camera, units = _camera(root, image_size(root, depth))
    images = paired(depth, color)
    times = times_of(depth, str(root / "depth"))

    def color_of(i: int, p: Path) -> Path | VideoImage | None:
        if video is not None:
            number = re.match(r"\d+", p.stem)
            return VideoImage(video, int(number[0])) if number else None
        return images[i]

    entries = [
        Entry(p, color_of(i, p), 1 / units, None if times is None else float(times[i]))
        for i, p in enumerate(depth)
    ]
    truth = {}
    for name in TRAJECTORIES:
        if (root / name).is_file():
            poses = read_log(root / name)
            truth = {i: {0: geometry.inverse(T)} for i, T in poses.items() if 0 <= i < len(depth)}
            break
    meshes = sorted(root.glob("*.ply"))
    return Sequence(
        ImageFrames(root, entries, RGBDCamera(camera), len(color)),
        camera,
        truth,
        LazyModels({1: meshes[0]} if len(meshes) == 1 else {}, unit="m"),
        objects=[1] if truth else None,
        ids=numbers_of(depth),
        layout="open3d",
        name=root.name,
        close=video.close if video else None,
    )


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
