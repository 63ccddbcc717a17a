# SPDX-License-Identifier: MIT
"""Volumes in .npz files: values, voxel_size, origin, and colors if present; also those of ``numpy.savez``."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal import saved_file

if TYPE_CHECKING:
    from sdftrack.sdf.volume import SDF

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

    def volume(data: Any) -> SDF:
        return kind(data["values"], float(data["voxel_size"]), data["origin"], data.get("colors"))

    return saved_file.read(path, KIND, volume, plain=NAMES)


def checked_colors(colors: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """A copy (*shape, 4) uint8, or an error that names the argument."""
    rgba = np.array(colors, order="C")
    if rgba.dtype != np.uint8:
        raise TypeError(f"colors: expected uint8, got {rgba.dtype}")
    if rgba.shape != (*shape, 4):
        raise ValueError(f"colors: expected RGBA beside the values, {(*shape, 4)}, got {rgba.shape}")
    return rgba
