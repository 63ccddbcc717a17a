# SPDX-License-Identifier: MIT
"""What the brightness of a coloured shape adds: a can that turns about its axis, and meshes with their own colours."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.protocol import load_mesh
from experiments.data import has
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.synth.objects import can_mesh, turning_can

Array = NDArray[np.float64]


def exposed(color: NDArray[np.uint8], i: int) -> NDArray[np.uint8]:
    """Frame i under an exposure that wanders by 30 % and 20 grey values."""
    brighter = color * (1 + 0.3 * np.sin(i / 4)) + 20 * np.sin(i / 6)
    return np.clip(brighter, 0, 255).astype(np.uint8)


class Row:
    """Errors and times of one way through a sequence."""

    def __init__(self) -> None:
        self.errors: list[tuple[float, float]] = []
        self.milliseconds: list[float] = []
        self.turn_sd_deg: list[float] = []
        self.unsure = 0

    def cells(self) -> list[str]:
        """Of a row of the table."""
        e = np.array(self.errors) * [1e3, 180 / np.pi]
        return [
            *(f"{x:.2f}" for x in (*e.mean(axis=0), *e.max(axis=0))),
            f"{np.median(self.turn_sd_deg):.2g}",
            str(self.unsure),
            f"{np.median(self.milliseconds):.2f}",
        ]


def follow(
    shape: st.SDF, sequence: Any, frames: list[st.Frame], exposure: bool = False, **options: Any
) -> Row:
    """Track one object from its true first pose."""
    tracker, row = st.Tracker(shape, sequence.camera, mode="rgbd", **options), Row()
    for i, given in enumerate(frames):
        frame = given
        if exposure and given.color is not None:
            frame = st.Frame(given.depth, exposed(given.color, i), timestamp=given.timestamp)
        truth = sequence.ground_truth[i][0]
        begin = time.perf_counter()
        result = tracker.start(frame, poses=[truth]) if i == 0 else tracker.track(frame)
        row.milliseconds.append(1e3 * (time.perf_counter() - begin))
        row.errors.append(st.metrics.pose_error(result.pose, truth))
        row.turn_sd_deg.append(float(np.degrees(np.sqrt(result.covariances[0, 3:, 3:].trace()))))
        row.unsure += not result.ok
    return row


WAYS = {"shape alone": (False, False), "with its colours": (True, False), "exposure varies": (True, True)}
COLUMNS = ("object, noise, way", "mean mm", "mean deg", "max mm", "max deg", "stated sd, deg", "not ok", "ms")


def _compared(name: str, mesh: st.Mesh, trajectory: Any, n: int, noise: Any, voxels: int) -> list[list[str]]:
    sequence = st.synth.sequence(mesh, n, trajectory, noise, clutter="wall", seed=1)
    frames = [sequence[i] for i in range(n)]
    plain = st.SDF.from_mesh(mesh, voxels)
    painted = plain.colored(mesh)
    return [
        [
            f"{name}, {noise}, {way}",
            *follow(painted if colored else plain, sequence, frames, varies, threads=1).cells(),
        ]
        for way, (colored, varies) in WAYS.items()
    ]


@experiment(
    "photometric",
    uses=["meshes"],
    chosen_on="the can of this experiment, seed 1",
    reported_on="the same can; lm_cat, lm_can, lm_duck, lm_driller where the meshes are at hand",
    short={"only": (), "frames": 4, "voxels": 60},
)
def photometric(
    *,
    data: Path,
    only: tuple[str, ...] = ("lm_cat", "lm_can", "lm_duck", "lm_driller"),
    frames: int = 120,
    voxels: int = 100,
) -> Table:
    """What the brightness of a coloured shape adds: a can that rotates about its axis, and meshes with their colours.

    Parameters
    ----------
    only
        meshes beside the can, comma separated
    """
    rows = []
    for noise in (0.001, "kinect"):
        rows += _compared("can", can_mesh(), turning_can(frames), frames, noise, voxels)
        for name in only if has("meshes", data) else ():
            rows += _compared(name, load_mesh(data, name), "random", frames, noise, voxels)
    return Table(f"{frames} frames before a wall", COLUMNS, rows)
