# SPDX-License-Identifier: MIT
"""Which readings of a frame are near a surface that is known from before."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.primitives.kinds import TABLE
from sdftrack.primitives.segmentation import SegmentedFrame, pieces

__all__ = ["distance_to", "mask_near"]

NEAR_M = 0.03  # readings so near, at up to 1 m, may be the object's after it has moved a little
STILL_M = 0.008  # and so near where it has not moved: what it touches is not in the mask then
SPREADS = 4.0  # of the median distance: what a band about a surface has to hold
ALONE = 0.6  # share of a piece that is near: the piece is the object and nothing else


def distance_to(seen: SegmentedFrame, kind: str, lengths: list[float], T_cam_obj: NDArray[np.float64]) -> Any:
    """Of every reading to the surface (H, W), m as at 1 m of depth, above which it shrinks; inf without a reading."""
    T = np.linalg.inv(T_cam_obj)
    points = np.ascontiguousarray(seen.points.reshape(-1, 3) @ T[:3, :3].T + T[:3, 3])
    phi, _, _ = _core.primitive_distances(TABLE[kind].member, lengths, points)
    away = np.abs(phi).reshape(seen.depth.shape) / seen.growth
    return np.where(seen.depth > 0, away, np.inf)


def mask_near(
    seen: SegmentedFrame, kind: str, lengths: list[float], T_cam_obj: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]] | None:
    """Where an object is that was at a pose: a mask of it, and the whole piece that it is in.

    Of the pieces that stand off the table the one with the most readings near the old surface, or, where none has any,
    the one that comes nearest to it. Of a piece that holds other things too (it touches them) what lies in a band about
    the surface, as wide as its own readings need. None: nothing stands within its own size of where it was.
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
