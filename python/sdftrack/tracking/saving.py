# SPDX-License-Identifier: MIT
"""A tracker made again from what its file keeps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera, RGBDCamera
from sdftrack.results import TrackResult
from sdftrack.sdf import SDF

if TYPE_CHECKING:
    from sdftrack.primitives.tracked import FreeSizes
    from sdftrack.tracking.tracker import Tracker

__all__ = ["rebuild"]


def rebuild(
    shapes: list[SDF],
    camera: Camera | RGBDCamera,
    kwargs: dict[str, Any],
    index: int,
    last: TrackResult | None,
    best: NDArray[np.float64],
    free_sizes: FreeSizes | None = None,
) -> Tracker:
    """A tracker that goes on from the poses `best` (M, 4, 4), metres; NaN: not found yet.

    `free_sizes`: of the primitives among the shapes; None in files of earlier versions.
    """
    from sdftrack.tracking.tracker import Tracker

    tracker = Tracker(shapes, camera, **kwargs)
    if free_sizes is not None:
        tracker._free_sizes = free_sizes
    tracker._index, tracker._last, tracker._best = index, last, best
    for k, T in enumerate(best):
        if np.isfinite(T).all():
            tracker._core.set_pose(k, np.ascontiguousarray(T), None)
    return tracker
