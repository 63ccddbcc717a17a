# SPDX-License-Identifier: MIT
"""Recorded sequences that commands read: their options, the frames of them, and several in turn."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack.cli.common import above_zero, floats
from sdftrack.cli.objects import about_file
from sdftrack.cli.options import Usage, option


def known_layout(value: str) -> str:
    from sdftrack.io.datasets import LAYOUTS

    known = ["auto", *LAYOUTS]
    if value not in known:
        raise Usage(f"expected one of {', '.join(known)}, got {value!r}")
    return value


@dataclass(frozen=True, kw_only=True)
class Layout:
    layout: str = option(
        "auto",
        "auto, bop, tum, open3d, k1, folders, lerobot, realsense, azure, ros1, ros2 or mcap (docs/data.md).",
        check=known_layout,
    )
    depth_topic: str | None = option(
        None, "Depth images of a bag that has several topics of them.", metavar="TOPIC"
    )
    color_topic: str | None = option(
        None, "Colour images of a bag, likewise; none: without colour.", metavar="TOPIC"
    )
    episode: int | None = option(None, "Episode of a LeRobot data set (first: 0).", min=0)

    @property
    def opening(self) -> dict[str, Any]:
        names = ("layout", "depth_topic", "color_topic", "episode")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, kw_only=True)
class Frames:
    start: int = option(0, "First frame.", min=0)
    stop: int | None = option(None, "End frame (exclusive).", min=0)
    step: int = option(1, "Every n-th frame.", min=1)

    @property
    def part(self) -> slice:
        return slice(self.start, self.stop, self.step)

    def numbers(self, seq: Any, folder: Path, options: str = "--start, --stop") -> range:
        numbers = range(len(seq))[self.part]
        if not len(numbers):
            raise ValueError(f"{options}: expected some of the {len(seq)} frames of {folder}, got none")
        return numbers


@dataclass(frozen=True, kw_only=True)
class Rate:
    fps: float | None = option(
        None,
        "Frames per second of a recording that has no times; without it, there are no trajectory files (TUM).",
        check=above_zero("frames per second"),
    )


def fitting(frame: Any, camera: Any, fps: float | None = None) -> Any:
    """The frame, or an unreadable one if its size differs from the camera's; `fps`: of frames without times."""
    if fps is not None and frame.timestamp is None and frame.index is not None:
        frame = frame.replace(timestamp=frame.index / fps)
    lens = frame.camera if frame.camera is not None else camera
    shape = getattr(lens, "depth", lens).shape
    if frame.depth is None or frame.depth.shape == shape:
        return frame
    size = " x ".join(map(str, frame.depth.shape[::-1]))
    return st.Frame.unreadable(
        f"the depth image is {size}, the camera {shape[1]} x {shape[0]}", frame.timestamp, frame.index
    )


def first_readable(numbers: range, seq: Any, folder: Path, fps: float | None = None) -> tuple[range, Any]:
    """The frames from the first one on that can be read, and that one; a warning names what was passed over. ValueError
    with the reason if none of the first frames can be read."""
    passed: list[str] = []
    for n, i in enumerate(numbers[:MOST_UNREADABLE]):
        frame = fitting(seq[i], seq.camera, fps)
        if not frame.error:
            if passed:
                warnings.warn(f"{folder}: {passed[0]}; the start is in image {seq.ids[i]}", stacklevel=2)
            return numbers[n:], frame
        passed.append(f"image {seq.ids[i]} cannot be used ({frame.error})")
    raise ValueError(f"{folder}: {passed[0]}, nor can the {len(passed) - 1} after it")


class Selected:
    """The frames of a sequence with these numbers, each as `changed(frame, number)` makes it when it is asked for."""

    def __init__(self, seq: Any, numbers: range, changed: Callable[[Any, int], Any]) -> None:
        self.seq, self.numbers, self._changed = seq, numbers, changed

    def __len__(self) -> int:
        return len(self.numbers)

    def __getitem__(self, i: int) -> Any:
        return self._changed(self.seq[self.numbers[i]], self.numbers[i])

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))


def folder_each(sequences: Sequence[Path], out: Path) -> list[Path]:
    """Output folder of each sequence: `out` for a single one, else a subfolder of its name."""
    if len(sequences) == 1:
        return [out]
    names: list[str] = []
    for folder in sequences:
        own = folder.resolve().name
        numbered = (f"{own}_{k}" if k else own for k in itertools.count())
        names.append(next(name for name in numbered if name not in names))
    return [out / name for name in names]


def each_sequence(
    folders: Sequence[Path], out: Path, work: Callable[[Path, Path], None], *also: type[Exception]
) -> None:
    """Call `work(sequence, output folder)` for each; with several, failures are reported at the end."""
    targets = folder_each(folders, out)
    for folder, target in zip(folders, targets, strict=True):
        if target.resolve() == folder.resolve():  # --overwrite or not: its mesh.ply is not ours to replace
            raise ValueError(f"--out: expected another folder than the sequence {folder}, got the same")
    failed: list[str] = []
    told: tuple[type[Exception], ...] = (OSError, ValueError, TypeError, RuntimeError, *also)
    for folder, target in zip(folders, targets, strict=True):
        try:
            work(folder, target)
        except told as error:
            if len(folders) == 1:
                raise
            text = " ".join(str(error).split())
            failed.append(text if text.startswith(str(folder)) else f"{folder}: {text}")
    if failed:
        raise RuntimeError(f"{len(failed)} of {len(folders)} sequences failed: " + "; ".join(failed))


MOST_UNREADABLE = 10


@dataclass(frozen=True, kw_only=True)
class CameraSize:
    width: int | None = option(None, "Width of the images (of depth if any), px.", min=1)
    height: int | None = option(None, "Height of the images (of depth if any), px.", min=1)
    fps: float | None = option(None, "Frames per second.", check=above_zero("frames per second"))

    def opened(
        self,
        address: str,
        waiting: int,
        *,
        color_alone: bool = False,
        camera: Path | None = None,
        **more: Any,
    ) -> Any:
        """`open_camera` with the options that were given. `color_alone`: a camera without depth is enough."""
        if is_webcam(address) and not color_alone:
            raise Usage(
                "expected a camera with depth, got a webcam; sdftrack live --camera webcam:0 follows an outline "
                "(--contour) or a known shape (--mode rgb)"
            )
        given = {"width": self.width, "height": self.height, "fps": self.fps, "camera": camera, **more}
        return st.open_camera(address, waiting=waiting, **{k: v for k, v in given.items() if v is not None})


def is_webcam(address: str) -> bool:
    return address.partition(":")[0] == "webcam"


def parse_intrinsics(text: str, name: str) -> tuple[float, float, float, float]:
    fx, fy, cx, cy = floats(text, 4) or (0.0,) * 4
    if not (fx > 0 and fy > 0):
        raise Usage(f"expected fx,fy,cx,cy in pixels, fx and fy above 0, got {text!r}", name)
    return fx, fy, cx, cy


def load_camera(file: Path, shape: tuple[int, int], what: str) -> Any:
    from sdftrack.camera.files import read_camera, warn_if_doubtful

    height, width = shape
    with about_file("--camera", file):
        camera = read_camera(st.Camera, file, width, height)
    warn_if_doubtful(camera, str(file))
    if camera.shape != (height, width):
        raise ValueError(
            f"--camera {file}: expected the size of {what} {width} x {height}, got {camera.width} x {camera.height}"
        )
    return camera
