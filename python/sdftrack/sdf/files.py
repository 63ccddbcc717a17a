# SPDX-License-Identifier: MIT
"""Volumes in .npz files: values, voxel_size, origin, and colors if present."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal import saved_file
from sdftrack._internal.array_archive import ArrayArchive

if TYPE_CHECKING:
    from sdftrack.sdf.volume import SDF

__all__ = ["checked_colors", "read_volume", "write_volume"]

KIND = saved_file.FileKind("sdftrack.SDF", 1, "SDF.save")
NAMES = ("values", "voxel_size", "origin", "colors")


def write_volume(
    path: str | os.PathLike[str],
    values: NDArray[np.float32],
    voxel_size: float,
    origin: NDArray[np.float64],
    colors: NDArray[np.uint8] | None,
) -> None:
    """Write a volume, completely or not at all."""
    arrays: dict[str, Any] = {"values": values, "voxel_size": np.array(voxel_size), "origin": origin}
    if colors is not None:
        arrays["colors"] = colors
    saved_file.write(path, KIND, arrays, compress=True)


def read_volume(path: str | os.PathLike[str], kind: type[SDF]) -> SDF:
    """Read a volume, validated by its constructor `kind`. FileNotFoundError; ValueError for an invalid file."""
    file = saved_file.found(path, KIND)
    data = saved_file.read(file, KIND) if saved_file.is_sealed(file) else _plain(file)
    with saved_file.consistent(file, KIND):
        return kind(data["values"], float(data["voxel_size"]), data["origin"], data.get("colors"))


def _plain(file: Path) -> dict[str, NDArray[Any]]:
    """The arrays of an .npz without header and checksum: of numpy.savez, or of version 0.1."""
    try:
        with ArrayArchive(file, file.stat().st_size) as archive:
            if archive.text(saved_file.HEADER, saved_file.MOST_HEADER_BYTES) is not None:
                raise ValueError("a truncated or damaged one")
            return {name: archive.array(name) for name in NAMES if name in archive}
    except ValueError as error:
        raise ValueError(f"{file}: expected a file of {KIND.writer}, got {error}") from None


def checked_colors(colors: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """A copy (*shape, 4) uint8, or an error that names the argument."""
    rgba = np.array(colors, order="C")
    if rgba.dtype != np.uint8:
        raise TypeError(f"colors: expected uint8, got {rgba.dtype}")
    if rgba.shape != (*shape, 4):
        raise ValueError(f"colors: expected RGBA beside the values, {(*shape, 4)}, got {rgba.shape}")
    return rgba
