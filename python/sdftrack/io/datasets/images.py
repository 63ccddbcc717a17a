# SPDX-License-Identifier: MIT
"""Frames from image files, common to all layouts on disk."""

from __future__ import annotations

import contextlib
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.text_files import in_order
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.camera.files import read_camera
from sdftrack.frame import PLAUSIBLE_DEPTH_M, Frame
from sdftrack.io.datasets.pairing import frame_numbers, tell_numbers
from sdftrack.io.datasets.sequence import LazyModels
from sdftrack.io.datasets.sequence import Sequence as FrameSequence
from sdftrack.io.datasets.video_images import VideoImage
from sdftrack.io.frames import Expected, header_size, read_color, read_depth_units, size_text

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")
DEPTH_SUFFIXES = (*IMAGE_SUFFIXES, ".pgm", ".npy", ".exr")
COLOR_FOLDERS = ("rgb", "color", "colour", "image", "images", "gray", "grey", "rgb_images", "color_images")
NO_COLOR = (
    "depth", "mask", "label", "seg", "mesh", "model", "annot", "pose", "ir", "infra", "normal", "conf", ".",
)  # fmt: skip
NO_DEPTH = (
    "the sequence has no depth images, which the trackers require; expected them in depth/, or name them: sdftrack "
    "convert --depth-glob"
)
FIRST = 10  # images that are looked at, of the first ones
CAMERA_FILES = (
    "camera.json", "intrinsic.json", "camera_intrinsic.json", "intrinsics.json", "camera_primesense.json", "cam_K.txt",
)  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """The files of one frame; `camera` where it is not the sequence's own."""

    depth: Path
    color: Path | VideoImage | None
    depth_scale: float
    timestamp: float | None = None
    camera: Camera | None = None


def image_files(folder: Path, suffixes: tuple[str, ...] = IMAGE_SUFFIXES) -> list[Path]:
    if not folder.is_dir():
        return []
    return in_order(
        p for p in folder.iterdir() if p.suffix.lower() in suffixes and not p.name.startswith(".")
    )


def depth_files(root: Path) -> list[Path]:
    """The depth images of a layout, with a warning for numbers that are missing or there twice."""
    files = image_files(root / "depth", DEPTH_SUFFIXES)
    tell_numbers(files)
    return files


def sequence_of(
    root: Path,
    layout: str,
    entries: list[Entry],
    camera: Camera | RGBDCamera,
    truth: dict[int, dict[int, NDArray[np.float64]]],
    *,
    colors: int = 0,
    meshes: Sequence[Path] = (),
    video: Any = None,
    **known: Any,
) -> FrameSequence:
    """The sequence of a folder; `colors`: number of colour images there, `meshes`: in metres, the model if there is
    one, `video`: what has the colour images in their place, `known`: further arguments of `Sequence`."""
    rig = camera if isinstance(camera, RGBDCamera) else RGBDCamera(camera)
    frames = ImageFrames(root, entries, rig, colors)
    about = {"models": LazyModels({1: meshes[0]} if len(meshes) == 1 else {}, unit="m"), **known}
    close = video.close if video else None
    return FrameSequence(frames, rig, truth, layout=layout, name=root.name, close=close, **about)


def color_files(root: Path) -> list[Path]:
    """The colour images of a layout, in the first of `COLOR_FOLDERS` that has some."""
    folders = {p.name.lower(): p for p in sorted(root.iterdir(), reverse=True) if p.is_dir()}
    for name in COLOR_FOLDERS:
        if name in folders and (files := image_files(folders[name])):
            return files
    others = [p.name for p in folders.values() if not p.name.startswith(NO_COLOR) and image_files(p)]
    if others:
        warnings.warn(
            f"{root}: no colour: the images in {', '.join(others)} are not read; expected one of "
            f"{', '.join(COLOR_FOLDERS)}",
            stacklevel=6,
        )
    return []


def numbers_of(files: Iterable[Path]) -> list[int] | None:
    names = [p.stem for p in files]
    return [int(name) for name in names] if all(name.isdecimal() for name in names) else None


def by_number(files: Sequence[Path]) -> dict[int, Path]:
    numbers = frame_numbers(files) or numbers_of(files)
    return {} if numbers is None else dict(zip(reversed(numbers), reversed(files), strict=True))


def image_size(root: Path, files: Iterable[Path]) -> tuple[int, int]:
    """(width, height) of most depth images, of which one can be read; ValueError if there is none."""
    files, reasons = list(files), []
    if not files:
        raise ValueError(f"{root}: {NO_DEPTH}")
    for file in files[:FIRST]:
        try:
            units = read_depth_units(file, _name(file, root))
        except (ValueError, FileNotFoundError) as error:
            reasons.append(str(error))
            continue
        height, width = _usual_size(files) or units.shape
        return width, height
    raise ValueError(f"{root}: none of the first {len(reasons)} depth images can be read: {reasons[0][:400]}")


def camera_beside(root: Path, size: tuple[int, int], names: Sequence[str] = CAMERA_FILES) -> Camera | None:
    """The camera in the first of these files that is there; of images of that size, if the file has none."""
    file = next((root / name for name in names if (root / name).is_file()), None)
    return None if file is None else read_camera(Camera, file, *size)


def _usual_size(files: Sequence[Path]) -> tuple[int, int] | None:
    chosen = dict.fromkeys([*files[:FIRST], *files[:: max(1, len(files) // FIRST)]])
    sizes = Counter(size for file in chosen if (size := header_size(file)) is not None)
    return sizes.most_common(1)[0][0] if sizes else None


class ImageFrames:
    """Reads frames on access; unreadable ones are returned as `Frame.unreadable` with the reason."""

    def __init__(self, root: Path, entries: list[Entry], camera: RGBDCamera, colors: int = 0) -> None:
        if not entries:
            raise ValueError(f"{root}: {NO_DEPTH}")
        self._root, self._entries, self._camera = root, entries, camera
        self._float_scale = 1.0
        self._color_size = self._usable_color_size()
        self._check_first()
        self._tell(colors)

    def __len__(self) -> int:
        return len(self._entries)

    def __getitem__(self, i: int) -> Frame:
        entry = self._entries[i]
        try:
            return self._read(entry, i)
        except (ValueError, TypeError, FileNotFoundError) as error:
            return Frame.unreadable(str(error), entry.timestamp, i)

    def _read(self, entry: Entry, i: int) -> Frame:
        camera = entry.camera or self._camera.depth
        name = _name(entry.depth, self._root)
        units = read_depth_units(entry.depth, name, Expected("the camera", camera.shape))
        scale: float | None = entry.depth_scale
        if units.dtype == np.float32:
            units, scale = units * np.float32(self._float_scale), None
        color = None
        if self._color_size is not None and entry.color is not None and entry.color.is_file():
            color = _colors(
                entry.color, _name(entry.color, self._root), Expected("the sequence", self._color_size)
            )
        return Frame(
            units, color, entry.timestamp, depth_scale=scale, camera=entry.camera, index=i, check_units=False
        )

    def _check_first(self) -> None:
        """Check the first frame: raise an error for a wrong unit or camera instead of returning bad frames."""
        other = None
        for i, entry in enumerate(self._entries[:FIRST]):
            try:
                units = read_depth_units(entry.depth)
            except (ValueError, FileNotFoundError):
                continue
            camera = entry.camera or self._camera.depth
            if units.shape != camera.shape:
                other = other or (units.shape, camera.shape)
                continue
            try:
                if units.dtype == np.float32:
                    self._float_scale = self._scale_of(units)
                    Frame(units * np.float32(self._float_scale), index=i)
                else:
                    Frame(units, depth_scale=entry.depth_scale, index=i)
            except ValueError as error:
                raise ValueError(f"{_name(entry.depth, self._root)}: {error}") from None
            return
        if other is not None:
            raise ValueError(
                f"{self._root}: depth images of {size_text(other[0])} pixels with a camera of "
                f"{size_text(other[1])}; is this the depth image's camera?"
            )

    def _scale_of(self, depth: NDArray[Any]) -> float:
        valid = depth[np.isfinite(depth) & (depth > 0)]
        millimetres = bool(valid.size) and float(np.median(valid)) > PLAUSIBLE_DEPTH_M[1]
        unit = "millimetres" if millimetres else "metres"
        warnings.warn(f"{self._root}: depth in floating-point numbers is read as {unit}", stacklevel=7)
        return 1e-3 if millimetres else 1.0

    def _tell(self, colors: int) -> None:
        """A warning for colour that is not used or is missing, and one for times that go back."""
        count = len(self._entries)
        used = sum(isinstance(e.color, Path) and e.color.is_file() for e in self._entries) if colors else 0
        if colors != used or 0 < colors < count:
            warnings.warn(
                f"{self._root}: {used} of {count} frames have colour, by names, numbers or times; there are {colors} "
                "colour images",
                stacklevel=6,
            )
        times = [e.timestamp for e in self._entries if e.timestamp is not None]
        back = [i for i in range(1, len(times)) if times[i] < times[i - 1]]
        if back:
            warnings.warn(
                f"{self._root}: the time goes back {len(back)} times, at first in frame {back[0]}",
                stacklevel=6,
            )

    def take_color_of_any_size(self) -> None:
        self._color_size = self._first_color_size() or self._color_size

    def _usable_color_size(self) -> tuple[int, int] | None:
        """The size of the colour images, or None if they cannot be used."""
        size = self._first_color_size()
        wanted = self._camera.color or (self._camera.depth if self._camera.aligned else None)
        if size is None or wanted is None or size == wanted.shape:
            return size
        warnings.warn(
            f"{self._root}: colour images of {size_text(size)} pixels are ignored: without a mapping they would have "
            f"to be of {size_text(wanted.shape)}",
            stacklevel=6,
        )
        return None

    def _first_color_size(self) -> tuple[int, int] | None:
        images = [e.color for e in self._entries if e.color is not None and e.color.is_file()]
        for image in images[:FIRST]:
            with contextlib.suppress(ValueError):
                height, width = _colors(image, None, None).shape[:2]
                return _usual_size([f for f in images if isinstance(f, Path)]) or (height, width)
        return None


def _colors(color: Path | VideoImage, name: str | None, expected: Expected | None) -> NDArray[np.uint8]:
    if isinstance(color, Path):
        return read_color(color, name, expected)
    image = color.read()
    if expected is not None:
        expected.check(image.shape, name or str(color))
    return image


def _name(file: Path | VideoImage, root: Path) -> str:
    inside = isinstance(file, Path) and file.is_relative_to(root)
    return file.relative_to(root).as_posix() if inside else str(file)  # type: ignore[union-attr]
