# SPDX-License-Identifier: MIT
"""Number of occluders of a silhouette, from its missing pieces."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Mask: TypeAlias = NDArray[np.bool_]
MIN_SHARE = 0.0015  # of the grid (6 of 64 x 64 pixels): pieces smaller than this are ragged edges
SEEN_BETWEEN = (
    0.25  # of the object in the hull of two pieces: when more of it is seen, they are two occluders
)


def count_occluders(hidden: Mask, seen: Mask, of_largest: float = 0.0) -> int:
    """Count the pieces of `hidden`; pieces with no visible part of the object between them count as one.

    Pieces smaller than `of_largest` times the largest are not counted.

    One bar in front of four legs hides four pieces, with background between them; between the slats of a fence the
    object is visible.
    """
    import cv2

    n, labels, stats, _ = cv2.connectedComponentsWithStats(hidden.astype(np.uint8), connectivity=8)
    least = max(MIN_SHARE * hidden.size, of_largest * float(stats[1:, cv2.CC_STAT_AREA].max(initial=0)))
    big = [k for k in range(1, n) if stats[k, cv2.CC_STAT_AREA] >= least]
    if len(big) < 2:
        return len(big)
    groups: list[NDArray[np.int32]] = []
    for k in big:
        y, x = np.nonzero(labels == k)
        groups.append(_hull(np.stack([x, y], axis=1).astype(np.int32)))
    merged = True
    while merged and len(groups) > 1:
        merged = False
        for i in range(len(groups)):
            for j in range(i + 1, len(groups)):
                hull = _hull(np.concatenate([groups[i], groups[j]]))
                if _seen_share(hull, hidden, seen) < SEEN_BETWEEN:
                    groups[i] = hull
                    del groups[j]
                    merged = True
                    break
            if merged:
                break
    return len(groups)


def _hull(points: NDArray[np.int32]) -> NDArray[np.int32]:
    import cv2

    return np.asarray(cv2.convexHull(points), np.int32).reshape(-1, 2)


def _seen_share(hull: NDArray[np.int32], hidden: Mask, seen: Mask) -> float:
    """Fraction of the object in a convex region that is visible."""
    import cv2

    inside = np.zeros(seen.shape, np.uint8)
    cv2.fillConvexPoly(inside, hull, 1)
    n_seen = int(np.count_nonzero(seen & (inside > 0)))
    return n_seen / max(1, n_seen + int(np.count_nonzero(hidden & (inside > 0))))
