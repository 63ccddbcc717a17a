# SPDX-License-Identifier: MIT
"""Association of measurements with a previously known surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.primitives.kinds import TABLE
from sdftrack.primitives.segmentation import SegmentedFrame, pieces

__all__ = ["distance_to", "mask_near"]

NEAR_M = 0.03  # measurements so near, at up to 1 m, may be the object's after it has moved a little
STILL_M = 0.008  # and so near where it has not moved: what it touches is not in the mask then
SPREADS = 4.0  # of the median distance: what a band about a surface has to hold
ALONE = 0.6  # share of a piece that is near: the piece is the object and nothing else


def distance_to(seen: SegmentedFrame, kind: str, lengths: list[float], T_cam_obj: NDArray[np.float64]) -> Any:
    """Distance of every measurement to the surface (H, W), m, normalised to the noise at 1 m; inf if missing."""
    T = np.linalg.inv(T_cam_obj)
    points = np.ascontiguousarray(seen.points.reshape(-1, 3) @ T[:3, :3].T + T[:3, 3])
    phi, _, _ = _core.primitive_distances(TABLE[kind].member, lengths, points)
    away = np.abs(phi).reshape(seen.depth.shape) / seen.growth
    return np.where(seen.depth > 0, away, np.inf)


def mask_near(
    seen: SegmentedFrame, kind: str, lengths: list[float], T_cam_obj: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]] | None:
    """Mask of an object that was at a pose, and the whole connected piece that contains it.

    Among the pieces on the table, the one with the most measurements near the old surface, or the nearest one if none
    has any. If a piece contains other objects too (they touch), only a band around the surface is used, as wide as its
    measurements require. None: there is nothing within the object's size of its old location.
    """
    away = distance_to(seen, kind, lengths, T_cam_obj)
    found = pieces(seen)
    if not found:
        return None
    held = [int(np.count_nonzero(away[piece] < NEAR_M)) for piece in found]
    if not max(held):
        nearest = [float(away[piece].min()) for piece in found]
        k = int(np.argmin(nearest))
        return None if nearest[k] > max(2 * max(lengths), NEAR_M) else (found[k], found[k])
    k = int(np.argmax(held))
    piece = found[k]
    if held[k] >= ALONE * np.count_nonzero(piece):
        return piece, piece
    band = SPREADS * float(np.median(away[piece & (away < NEAR_M)]))
    return piece & (away < np.clip(band, STILL_M, NEAR_M)), piece
