# SPDX-License-Identifier: MIT
"""TUM RGB-D: depth.txt, rgb.txt and groundtruth.txt, associated by time; 5000 units per metre."""

from __future__ import annotations

import math
import os
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.text_files import read_text
from sdftrack._internal.validation import shown
from sdftrack.camera import Camera
from sdftrack.io.datasets import images
from sdftrack.io.datasets.pairing import in_seconds, paired
from sdftrack.io.datasets.sequence import Sequence, register
from sdftrack.io.datasets.video_images import VideoImage, VideoImages, is_part
from sdftrack.io.report_file import read_tum

DEPTH_SCALE = 1 / 5000
NAME_BYTES = 255  # between slashes, on most file systems: each call fails with a longer one
LONGEST_GAP_S = 0.02  # as in the data set's own association script
# The calibrations that the data set publishes; depth images are registered to the colour camera.
PUBLISHED = {
    "freiburg1": Camera(517.306408, 516.469215, 318.643040, 255.313989, 640, 480,
                        (0.262383, -0.953104, -0.005358, 0.002628, 1.163314)),
    "freiburg2": Camera(520.908620, 521.007327, 325.141442, 249.701764, 640, 480,
                        (0.231222, -0.784899, -0.003257, -0.000105, 0.917205)),
    "freiburg3": Camera(535.4, 539.2, 320.1, 247.6, 640, 480),
}  # fmt: skip
DEFAULT = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)


@register("tum", "depth.txt, rgb.txt", lambda root: (root / "depth.txt").is_file())
def open_tum(root: Path) -> Sequence:
    if not (root / "depth.txt").is_file():
        raise FileNotFoundError(f"{root / 'depth.txt'}: a TUM sequence needs this file")
    depth_times, depth_files, _ = _read_list(root / "depth.txt")
    color_times, color_files, numbers = _read_list(root / "rgb.txt")
    video = VideoImages.of(root) if any(is_part(p.name) for p in color_files) else None
    found: list[Path | VideoImage] = [
        VideoImage(video, n) if video and is_part(p.name) else p
        for p, n in zip(color_files, numbers, strict=True)
    ]
    camera = _camera(root, images.image_size(root, depth_files))
    color = [None if j is None else found[j] for j in _nearest(color_times, depth_times)]
    if color_files and video is None and not any(color):
        warnings.warn(
            f"{root}: no colour image within {1e3 * LONGEST_GAP_S:g} ms of a depth image; other clocks? paired by the "
            "names of the files",
            stacklevel=4,
        )
        color = [*paired(depth_files, color_files)]
    entries = [
        images.Entry(file, image, DEPTH_SCALE, float(time))
        for file, time, image in zip(depth_files, depth_times, color, strict=True)
    ]
    truth = {}
    if (root / "groundtruth.txt").is_file():
        pose_times, T_world_cam = read_tum(root / "groundtruth.txt")
        nearest = _nearest(in_seconds(pose_times, str(root / "groundtruth.txt")), depth_times)
        # The still world is the one object.
        truth = {i: {0: geometry.inverse(T_world_cam[j])} for i, j in enumerate(nearest) if j is not None}
    return images.sequence_of(
        root, "tum", entries, camera, truth, colors=0 if any(color) else len(color_files),
        meshes=sorted(root.glob("*.ply")), video=video, objects=[1] if truth else None,
    )  # fmt: skip


def _camera(root: Path, size: tuple[int, int]) -> Camera:
    camera = images.camera_beside(root, size)
    if camera is not None:
        return camera
    if size != (DEFAULT.width, DEFAULT.height):
        raise ValueError(
            f"{root}: no camera for images of {size[0]} x {size[1]}; put a camera.json beside depth.txt"
        )
    for key, camera in PUBLISHED.items():
        if key in root.resolve().name:
            return camera
    warnings.warn(f"{root}: no camera.json; using the data set's default camera (525 px)", stacklevel=4)
    return DEFAULT


def _read_list(path: Path) -> tuple[NDArray[np.float64], list[Path], list[int]]:
    """Times, files, and the third word of lines whose file is a video: the number of the image there."""
    times: list[int | float] = []
    files, numbers = [], []
    if path.is_file():
        for number, line in enumerate(read_text(path).splitlines(), 1):
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            try:
                times.append(int(words[0]) if words[0].isdecimal() else float(words[0]))
                longest = max(map(len, os.fsencode(words[1]).split(b"/")))
                if not math.isfinite(float(times[-1])) or longest > NAME_BYTES:
                    raise ValueError
                files.append(path.parent / words[1])
                numbers.append(int(words[2]) if is_part(words[1]) else -1)
            except (ValueError, IndexError):
                raise ValueError(
                    f"{path}, line {number}: expected 'timestamp file', got {shown(line)}"
                ) from None
    return in_seconds(times, str(path)), files, numbers


def _nearest(times: NDArray[np.float64], wanted: NDArray[np.float64]) -> list[int | None]:
    if not len(times):
        return [None] * len(wanted)
    order = np.argsort(times, kind="stable")
    ascending = times[order]
    after = np.searchsorted(ascending, wanted)
    before = np.searchsorted(ascending, ascending[np.maximum(after - 1, 0)])  # the first of equal times
    either = order[np.stack([before, np.minimum(after, len(times) - 1)])]
    either.sort(axis=0)  # of two that are equally near, the one that the file has first
    gaps_s = np.abs(times[either] - wanted)
    nearest = gaps_s.argmin(axis=0)[None]
    best, gap_s = (np.take_along_axis(a, nearest, 0)[0] for a in (either, gaps_s))
    return [j if near else None for j, near in zip(best.tolist(), gap_s <= LONGEST_GAP_S, strict=True)]
