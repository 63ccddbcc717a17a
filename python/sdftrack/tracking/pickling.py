# SPDX-License-Identifier: MIT
"""Restores trackers from files of version 0.1, which refer to the function here."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera, RGBDCamera
from sdftrack.primitives.tracked import FreeSizes
from sdftrack.results import TrackResult
from sdftrack.sdf import SDF
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
    """Restore a tracker that continues from the poses `best` (M, 4, 4), metres; NaN: not found yet.

    `free_sizes`: state of the primitives among the shapes; None in the oldest files.
    """
    tracker = Tracker.__new__(Tracker)
    progress = (index, last, best, free_sizes)
    tracker.__setstate__({"shapes": shapes, "camera": camera, "arguments": kwargs, "progress": progress})
    return tracker
