# SPDX-License-Identifier: MIT
"""Frames from image files, common to all layouts on disk."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.io.datasets.video_images import VideoImage
from sdftrack.io.frames import Expected, read_color, read_depth_units, size_text

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


@dataclass(frozen=True)
class Entry:
    """The files of one frame; `camera` where it is not the sequence's own."""

    depth: Path
    color: Path | VideoImage | None
    depth_scale: float
    timestamp: float | None = None
    camera: Camera | None = None


def image_files(folder: Path) -> list[Path]:
    """The images in a folder, sorted by number if all names are numbers, else by name."""
    if not folder.is_dir():
        return []
    files = [p for p in folder.iterdir() if p.suffix.lower() in IMAGE_SUFFIXES and not p.name.startswith(".")]
    return sorted(files, key=lambda p: (int(p.stem), p.name)) if numbers_of(files) else sorted(files)


def numbers_of(files: Iterable[Path]) -> list[int] | None:
    """The numbers that are the names of the files; None if not all are."""
    names = [p.stem for p in files]
    return [int(name) for name in names] if all(name.isdecimal() for name in names) else None


def numbered(files: Iterable[Path]) -> dict[str, Path]:
    """Files by stem."""
    return {p.stem: p for p in files}


def image_size(root: Path, files: Iterable[Path]) -> tuple[int, int]:
    """(width, height) of the first readable depth image; ValueError if there is none."""
    files, reasons = list(files), []
    if not files:
        raise ValueError(f"{root}: the sequence has no depth images, which the trackers require")
    for file in files[:10]:
        try:
            units = read_depth_units(file, _name(file, root))
            return units.shape[1], units.shape[0]
        except (ValueError, FileNotFoundError) as error:
            reasons.append(str(error))
    raise ValueError(f"{root}: none of the first {len(reasons)} depth images can be read: {reasons[0][:400]}")


class ImageFrames:
    """Reads frames on access; unreadable ones are returned as `Frame.unreadable` with the reason."""

    def __init__(self, root: Path, entries: list[Entry], camera: RGBDCamera) -> None:
        if not entries:
            raise ValueError(f"{root}: the sequence has no depth images, which the trackers require")
        self._root, self._entries, self._camera = root, entries, camera
        self._color_size = self._usable_color_size()
        self._check_first()

    def __len__(self) -> int:
        return len(self._entries)

    def __getitem__(self, i: int) -> Frame:
        entry = self._entries[i]
        try:
            return self._read(entry, i, check_units=False)
        except (ValueError, TypeError, FileNotFoundError) as error:
            return Frame.unreadable(str(error), entry.timestamp, i)

    def _read(self, entry: Entry, i: int, check_units: bool) -> Frame:
        name = _name(entry.depth, self._root)
        camera = entry.camera or self._camera.depth
        units = read_depth_units(entry.depth, name, Expected("the camera", camera.shape))
        color = None
        if self._color_size is not None and entry.color is not None and entry.color.is_file():
            name = _name(entry.color, self._root)
            color = _read(entry.color, name, Expected("the sequence", self._color_size))
        return Frame(
            units,
            color,
            entry.timestamp,
            depth_scale=entry.depth_scale,
            camera=entry.camera,
            index=i,
            check_units=check_units,
        )

    def _check_first(self) -> None:
        """Check the first frame: raise an error for a wrong unit or camera instead of returning bad frames."""
        for i, entry in enumerate(self._entries[:10]):
            try:
                units = read_depth_units(entry.depth)
            except (ValueError, FileNotFoundError):
                continue
            camera = entry.camera or self._camera.depth
            if units.shape != camera.shape:
                raise ValueError(
                    f"{self._root}: depth images of {size_text(units.shape)} pixels with a camera of "
                    f"{size_text(camera.shape)}; is this the depth image's camera?"
                )
            try:
                Frame(units, depth_scale=entry.depth_scale, index=i)
            except ValueError as error:
                raise ValueError(f"{_name(entry.depth, self._root)}: {error}") from None
            return

    def take_color_of_any_size(self) -> None:
        """Also read colour images without a mapping to depth, for estimating that mapping."""
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
            stacklevel=5,
        )
        return None

    def _first_color_size(self) -> tuple[int, int] | None:
        """That of the first colour image that can be read."""
        for entry in self._entries[:10]:
            if entry.color is not None and entry.color.is_file():
                with contextlib.suppress(ValueError):
                    height, width = _read(entry.color).shape[:2]
                    return height, width
        return None


def _read(
    color: Path | VideoImage, name: str | None = None, expected: Expected | None = None
) -> NDArray[np.uint8]:
    if isinstance(color, Path):
        return read_color(color, name, expected)
    image = color.read()
    if expected is not None:
        expected.check(image.shape, name or str(color))
    return image


def _name(file: Path | VideoImage, root: Path) -> str:
    if isinstance(file, VideoImage):
        return str(file)
    return file.relative_to(root).as_posix() if file.is_relative_to(root) else str(file)
