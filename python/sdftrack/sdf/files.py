# SPDX-License-Identifier: MIT
"""Volumes in .npz files: values, voxel_size, origin, and colors if present."""

from __future__ import annotations

import io
import os
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.files import write_whole

if TYPE_CHECKING:
    from sdftrack.sdf.volume import SDF

__all__ = ["checked_colors", "read_volume", "write_volume"]


def write_volume(
    path: str | os.PathLike[str],
    values: NDArray[np.float32],
    voxel_size: float,
    origin: NDArray[np.float64],
    colors: NDArray[np.uint8] | None,
) -> None:
    """Write a volume, completely or not at all."""
    data = io.BytesIO()
    arrays: dict[str, Any] = {"values": values, "voxel_size": voxel_size, "origin": origin}
    if colors is not None:
        arrays["colors"] = colors
    np.savez_compressed(data, **arrays)
    write_whole(Path(path), data.getvalue())


def read_volume(path: str | os.PathLike[str], kind: type[SDF]) -> SDF:
    """Read a volume, validated by its constructor `kind`. FileNotFoundError; ValueError for an invalid file."""
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"sdf: no such file: {file}")
    try:
        with np.load(io.BytesIO(file.read_bytes()), allow_pickle=False) as data:
            return kind(data["values"], float(data["voxel_size"]), data["origin"], data.get("colors"))
    except (OSError, EOFError, KeyError, ValueError, TypeError, IndexError, zipfile.BadZipFile) as error:
        raise ValueError(f"sdf: cannot read {file}: {error}; expected an .npz written by SDF.save") from error


def checked_colors(colors: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """A copy (*shape, 4) uint8, or an error that names the argument."""
    rgba = np.array(colors, order="C")
    if rgba.dtype != np.uint8:
        raise TypeError(f"colors: expected uint8, got {rgba.dtype}")
    if rgba.shape != (*shape, 4):
        raise ValueError(f"colors: expected RGBA beside the values, {(*shape, 4)}, got {rgba.shape}")
    return rgba
