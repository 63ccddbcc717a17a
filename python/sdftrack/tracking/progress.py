# SPDX-License-Identifier: MIT
"""How far a tracker has come in a sequence, for its copies and files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.primitives.tracked import FreeSizes
from sdftrack.results import TrackResult


@dataclass(frozen=True, eq=False)
class Progress:
    """State of a tracker beside its shapes, camera and settings; shares nothing that changes with it.

    Attributes
    ----------
    core : bytes
        All that the core has learned; other versions cannot read it, and continue from `index`, `last` and `best`.
    index : int
        Of the last frame; -1: not started.
    last : TrackResult or None
    best : (M, 4, 4) float64
        The last good pose of each object; NaN: none yet.
    free_sizes : FreeSizes
    frame_camera : Camera
        That of the depth image of the last frame.
    reported : list of (4, 4) float64 or None
        For symmetric objects: the pose that the next one is to be near.
    modes : list of str
        ``mode_used``.
    """

    core: bytes
    index: int
    last: TrackResult | None
    best: NDArray[np.float64]
    free_sizes: FreeSizes
    frame_camera: Camera
    reported: list[NDArray[np.float64] | None]
    modes: list[str]
