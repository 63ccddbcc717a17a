# SPDX-License-Identifier: MIT
"""One object tracked through one sequence with known poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.common.pose_errors import Errors, pose_errors, track_frames

WRONG_M, WRONG_RAD = 0.020, np.deg2rad(10.0)  # a frame this far off is lost, whatever the tracker says


@dataclass(frozen=True)
class Run:
    """One sequence tracked: errors, statuses and seconds per frame."""

    errors: Errors
    status: list[str]
    seconds: list[float]


def track_scene(sdf: Any, seq: Any, mode: str, options: Mapping[str, Any]) -> Run:
    """Track object 0 of a sequence from its true first pose."""
    import sdftrack as st

    tracker = st.Tracker(sdf, seq.camera, mode=mode, **options)
    results = track_frames(tracker, seq, [seq.ground_truth[0][0]])
    truth = np.array([seq.ground_truth[i][0] for i in range(len(seq))])
    return Run(
        pose_errors(np.array([r.poses[0] for r in results]), truth),
        [str(r.status[0]) for r in results],
        [r.seconds for r in results],
    )
