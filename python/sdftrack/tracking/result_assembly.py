# SPDX-License-Identifier: MIT
"""Builds a `TrackResult` from the core's result of a frame: arrays and lists with one entry per object."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.results import Status, Steps, TrackResult

__all__ = ["assembled", "followed", "modes_of"]

STATUS = {s.value: s for s in Status}


def assembled(
    found: dict[str, Any],
    *,
    seconds: float,
    timestamp: float | None,
    membership: NDArray[np.float32] | None,
    foreground: NDArray[np.float32] | None,
    sensor: str = "",
) -> TrackResult:
    """Wrap `found`; all decisions about a frame are made in the core."""
    steps = [Steps(trials) for trials in found["steps"]]
    return TrackResult(
        poses=found["poses"],
        status=[STATUS[s] for s in found["status"]],
        reason=found["reason"],
        confidence=found["confidence"],
        covariances=found["covariances"],
        twists=found["twists"],
        inliers=found["inliers"],
        runner_up=found["runner_up"],
        energy=float(found["energy"].mean()),
        iterations=sum(map(len, steps)),
        steps=steps,
        seconds=seconds,
        timestamp=timestamp,
        index=found["index"],
        membership=membership,
        foreground=foreground,
        sensor=sensor,
        systematic=found["systematic"],
    )


def modes_of(found: dict[str, Any], alone: str = "rgbd") -> list[str]:
    """The mode of each object, as in ``mode_used``; `alone`: the mode if colours were used."""
    return [alone if used else "depth" for used in found["color_used"]]


def followed(result: TrackResult | None) -> list[bool]:
    """Which objects had a pose in a frame; empty if there was no frame."""
    return [] if result is None else [s in (Status.OK, Status.WEAK) for s in result.status]
