# SPDX-License-Identifier: MIT
"""Time of fitting primitives to 5,000 points, and to a frame with a mask."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.primitives.kinect_objects import objects_of
from experiments.registry import experiment
from experiments.synth.solids import random_solid, standing_scene
from experiments.table import Table
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives import fit_primitive
from sdftrack.primitives.result import SOLIDS
from sdftrack.primitives.segmentation import SegmentedFrame
from sdftrack.primitives.solver import FitRequest, solve
from sdftrack.synth.noise import Kinect

CAMERA = Camera(525, 525, 319.5, 239.5, 640, 480)
POINTS = 5000
OBJECTS = (("00", 2), ("22", 3), ("33", 2), ("43", 2))  # scenes of OSD


@experiment(
    "primitives.times",
    uses=["osd"],
    chosen_on="the same solids and objects",
    reported_on="a solid of each kind, and four objects of osd",
    short={"turns": 1},
)
def primitive_times(*, data: Path, turns: int = 15) -> list[Table]:
    """Processor time of a fit of each kind, and of all kinds, on one thread: the least of some turns.

    Parameters
    ----------
    turns
        fits of which the fastest counts
    """
    return [_points_table(turns), _frames_table(data / "osd", turns)]


def _points_table(turns: int) -> Table:
    rows = []
    for kind in SOLIDS:
        points = _cloud(kind)
        own, every = (
            _least_ms(partial(fit_primitive, points, asked, threads=1), turns) for asked in (kind, "auto")
        )
        rows.append([kind, f"{own:.1f}", f"{every:.1f}"])
    return Table(
        f"A fit to {POINTS:,} points, one thread, CPU time, ms", ["points of a", "fit", "auto"], rows
    )


def _frames_table(osd: Path, turns: int) -> Table:
    rows = []
    for name, frame, mask in _masked_frames(osd):
        camera = frame.camera
        assert isinstance(camera, Camera)
        seen = SegmentedFrame.of(frame, camera, "auto", mask)
        view = seen.view(seen.labels(mask, False))
        requests = {kind: FitRequest(kind, None, 0, "exact", 1) for kind in (*SOLIDS, "auto")}
        alone = {kind: _least_ms(partial(solve, view, request), turns) for kind, request in requests.items()}
        whole = _least_ms(partial(fit_primitive, frame, "auto", mask=mask, threads=1), turns)
        slowest = max(alone[kind] for kind in SOLIDS)
        cells = [*alone.values(), whole, slowest]
        rows.append([name, str(np.count_nonzero(mask)), *(f"{ms:.1f}" for ms in cells)])
    columns = ["object", "pixels", *SOLIDS, "auto", "all of auto", "slowest kind"]
    return Table("A frame of 640 x 480 with a mask, one thread, CPU time, ms", columns, rows)


def _least_ms(work: Callable[[], object], turns: int) -> float:
    spent = []
    for _ in range(turns):
        began = time.thread_time()
        work()
        spent.append(time.thread_time() - began)
    return 1e3 * min(spent)


def _cloud(kind: str) -> NDArray[np.float64]:
    """What a camera sees of a solid, 1 mm of noise along the rays; 5,000 points, m."""
    rng = np.random.default_rng(5)
    scene = standing_scene(kind, random_solid(kind, rng), CAMERA, rng, (0.6, 0.65))
    points = CAMERA.back_project(scene.depth)[scene.mask].astype(np.float64)
    points = points[rng.permutation(len(points))[:POINTS]]
    noisy: NDArray[np.float64] = points * (1 + rng.normal(0, 0.001, (len(points), 1)) / points[:, 2:])
    return noisy


def _masked_frames(osd: Path) -> Iterator[tuple[str, Frame, NDArray[np.bool_]]]:
    """A solid of each kind with a Kinect's noise, and recorded objects where they are."""
    for kind in SOLIDS:
        rng = np.random.default_rng(5)
        scene = standing_scene(kind, random_solid(kind, rng), CAMERA, rng, (0.6, 0.65))
        yield kind, Frame(Kinect()(scene.depth, scene.cosine, rng), camera=CAMERA), scene.mask
    if not (osd / "camera.json").is_file():
        return
    for name, number in OBJECTS:
        frame, masks = objects_of(osd, name)
        yield f"learn{name} {number}", frame, masks[number]
