# SPDX-License-Identifier: MIT
"""What the core wants to have: volumes and colours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.sdf import SDF

__all__ = ["rgb_seen", "volume_of"]


def volume_of(shape: SDF) -> tuple[NDArray[np.float32], float, list[float]]:
    """Values, voxel size and origin (m)."""
    return shape.values, shape.voxel_size, shape.origin.tolist()


def rgb_seen(rgba: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """A shape's colours as the core has them: 256 times each, and after them how much was seen."""
    out = rgba.astype(np.uint16) * np.uint16(256)
    known = rgba[..., 3] > 0
    out[..., 3] = np.where(known, 65535, 0)
    black = known & ~rgba[..., :3].any(axis=-1)
    out[black, 2] = 1  # 0, 0, 0 stands for an unknown colour
    return out
