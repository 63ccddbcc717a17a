# SPDX-License-Identifier: MIT
"""A tracker made again from what its file keeps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera, RGBDCamera
from sdftrack.results import Status, TrackResult
from sdftrack.sdf import SDF

if TYPE_CHECKING:
    from sdftrack.primitives.tracked import FreeSizes
    from sdftrack.tracking.tracker import Tracker

__all__ = ["followed", "rebuild"]


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
    tracker._resume(index, last, np.ascontiguousarray(best), free_sizes)
    return tracker


def followed(result: TrackResult | None) -> list[bool]:
    """Who had a pose in a frame; empty where there was none."""
    return [] if result is None else [s in (Status.OK, Status.WEAK) for s in result.status]
