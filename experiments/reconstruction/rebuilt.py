# SPDX-License-Identifier: MIT
"""A sequence through a reconstructor: poses, the surface's error while it grows, time and memory."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.reconstruction.seen_part import Truth
from sdftrack import geometry, metrics

Array = NDArray[np.float64]
LOOK_EVERY = 10  # frames between two looks at the growing surface
LOOK_AT = 5  # of this many points of the truth, one
SETTLED_M = 1e-4


@dataclass(frozen=True)
class Errors:
    """Errors of poses relative to the first frame, one per frame: m and rad."""

    metres: Array
    radians: Array


def relative_errors(poses: Array, truth: Array, middle: Array) -> Errors:
    """How far poses have come from the first one, against how far the truth has; both (N, 4, 4) T_cam_obj.

    The two may use different object frames: the first frame joins them. `middle` (true object frame) is the point
    whose place counts.
    """
    shift = geometry.pose(t_m=middle)
    joined = poses @ geometry.inverse(poses[0]) @ truth[0] @ shift
    metres, radians = metrics.pose_error(joined, truth @ shift)
    return Errors(np.atleast_1d(metres), np.atleast_1d(radians))


def settled_at(frames: NDArray[np.int64], errors: Array, within_m: float = SETTLED_M) -> int:
    """First of the frames from which on all errors are that near to the last one."""
    away = np.flatnonzero(np.abs(errors - errors[-1]) > within_m)
    return int(frames[0] if not len(away) else frames[away[-1] + 1])


@dataclass(frozen=True)
class Live:
    """What a run has given, frame by frame; `looks` are the frames of `surface_m`."""

    poses: Array
    status: list[str]
    seconds: Array
    cpu_seconds: Array  # of all threads: what a machine that does other things too would have taken
    looks: NDArray[np.int64]
    surface_m: Array  # mean distance of the part seen so far to the surface as it was
    peak_mb: float
    before_mb: float  # in use before the first frame


def rebuild(
    star: Any, seq: Any, truth: Truth | None, n: int, step: Callable[[int, Any], None] | None = None
) -> Live:
    """Start on the first frame's true mask, track the rest. Without `truth` the growing surface is not looked at."""
    poses, status, seconds, cpu, looks, surface = [], [], [], [], [], []
    before, peak = used_mb("VmRSS"), 0.0
    T_own_true = np.eye(4)
    for i in range(n):
        frame = seq[i]
        mask = seq.masks(0)[0] if i == 0 else None
        reset_peak()
        begin = time.process_time()
        result = star.track(frame) if i else star.start(frame, mask=mask)
        cpu.append(time.process_time() - begin)
        peak = max(peak, used_mb("VmHWM"))
        poses.append(np.array(result.poses[0]))
        status.append(str(result.status[0]))
        seconds.append(result.seconds)
        if i == 0:
            T_own_true = geometry.inverse(poses[0]) @ seq.ground_truth[0][0]
        if truth is not None and (i % LOOK_EVERY == 0 or i == n - 1):
            shown = truth.points[::LOOK_AT][truth.seen_from[::LOOK_AT] <= i]
            looks.append(i)
            surface.append(float(np.abs(star.shape(geometry.transform_points(T_own_true, shown))).mean()))
        if step is not None:
            step(i, result)
    return Live(
        np.array(poses),
        status,
        np.array(seconds),
        np.array(cpu),
        np.array(looks, np.int64),
        np.array(surface),
        peak,
        before,
    )


def reset_peak() -> None:
    """Let the kernel count the peak of the memory in use anew, where it can (Linux)."""
    with contextlib.suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")


def used_mb(name: str) -> float:
    """Memory of the process, MiB: "VmRSS" now, "VmHWM" the peak since the count began; NaN where nobody tells."""
    with contextlib.suppress(OSError), open("/proc/self/status") as file:
        for line in file:
            if line.startswith(name):
                return float(line.split()[1]) / 1024
    return float("nan")
