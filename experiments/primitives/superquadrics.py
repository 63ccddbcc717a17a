# SPDX-License-Identifier: MIT
"""Superquadrics from one view: how well they are found, and how often the stated intervals hold the truth."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.registry import experiment
from experiments.synth.solids import SolidScene, random_solid, rendered_scene, standing_scene
from experiments.table import Table
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.geometry import log
from sdftrack.primitives import PrimitiveFit, fit_primitive
from sdftrack.synth.noise import Gaussian

Array = NDArray[np.float64]
CAMERA = Camera(525, 525, 319.5, 239.5, 640, 480)
KIND = "superquadric"
CHOSEN, REPORTED = 1, 2  # second part of the seeds
WITHIN = 1.96  # standard deviations of a 95 % interval
WALL_M = 1.0  # behind the solid
# Turns of the object that give the same solid: half turns, and quarter turns about z with x and y exchanged.
QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
TURNS = [np.diag(d) for d in ([1.0, 1, 1], [1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])]


def scenes(where: str, count: int, part: int) -> Iterator[tuple[SolidScene, np.random.Generator]]:
    """`count` random superquadrics, standing on a "table" or in any "pose" without one; the same ones every time."""
    for i in range(count):
        rng = np.random.default_rng([ord(where[0]), i, part])
        size = random_solid(KIND, rng)
        if where == "table":
            yield standing_scene(KIND, size, CAMERA, rng), rng
            continue
        away = rng.uniform(0.6, 1.2)
        T = np.eye(4)
        T[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        T[:3, 2] *= np.linalg.det(T[:3, :3])
        T[:3, 3] = away * np.array([rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 1])
        wall = (np.array([0, 0, -1.0]), away + WALL_M)
        yield rendered_scene(KIND, size, T, wall, CAMERA), rng


def errors(fit: PrimitiveFit, scene: SolidScene) -> tuple[Array, Array]:
    """Errors (11,) of x, y, z (m), turns (rad) and sizes, against the nearest equal solid, and their deviations."""
    true, R_true = np.array(list(scene.size.values())), scene.T_cam_obj[:3, :3]
    swapped = true[[1, 0, 2, 3, 4]]
    equals = [(R_true @ t, true) for t in TURNS] + [(R_true @ QUARTER @ t, swapped) for t in TURNS]
    R = fit.T_cam_obj[:3, :3]
    R_equal, size = max(equals, key=lambda equal: np.trace(equal[0].T @ R))
    turn = np.eye(4)
    turn[:3, :3] = R @ R_equal.T
    shift = fit.T_cam_obj[:3, 3] - scene.T_cam_obj[:3, 3]
    off = np.concatenate([shift, log(turn)[3:], np.array(list(fit.size.values())) - size])
    return off, np.sqrt(np.diag(fit.covariance))


@experiment(
    "primitives.superquadric",
    chosen_on="views of part 1, 40 of each row",
    reported_on="views of part 2",
    short={"n": 1},
)
def superquadric(*, n: int = 60, part: int = REPORTED) -> Table:
    """Random superquadrics, the kind given: errors of axes and exponents, and the share of 95 % intervals that hold.

    Parameters
    ----------
    n
        views of each row
    part
        1: those that settings were chosen on; 2: others
    """
    rows = []
    for where in ("table", "pose"):
        for noise_mm in (0.5, 1.0):
            rows.append([f"{where}, {noise_mm:g} mm", str(n), *_row(where, n, part, noise_mm)])
    head = [
        "view, noise", "n", "axes err %", "p95", "exponents err", "p95 exponents", "held: position", "turns", "axes",
        "exponents", "all", "open", "ok", "ms",
    ]  # fmt: skip
    note = (
        "4-25 cm, exponents 0.1-2, at 0.6-1.2 m, upright on a table or in any pose before a wall, mask given; errors: "
        "median and 95th percentile of the worst axis and exponent; held: share of 95 % intervals that contain the "
        "truth; open: sizes that are not bounded"
    )
    return Table("Random superquadrics", head, rows, [note])


def _row(where: str, n: int, part: int, noise_mm: float) -> list[str]:
    axes, exponents, held, open_sizes, ok, seconds = [], [], [], 0, 0, []
    for scene, rng in scenes(where, n, part):
        frame = Frame(Gaussian(1e-3 * noise_mm)(scene.depth, scene.cosine, rng))
        plane: dict[str, Any] = {} if where == "table" else {"plane": None}
        begin = time.perf_counter()
        fit = fit_primitive(frame, KIND, camera=CAMERA, mask=scene.mask, **plane)
        seconds.append(time.perf_counter() - begin)
        off, sd = errors(fit, scene)
        bounded = np.isfinite(sd)
        relative = np.abs(off[6:9]) / np.array(list(fit.size.values()))[:3]
        axes.append(relative[bounded[6:9]].max(initial=0))
        exponents.append(np.abs(off[9:])[bounded[9:]].max(initial=0))
        held.append(np.where(bounded, np.abs(off) <= WITHIN * sd, np.nan))
        open_sizes += int(np.count_nonzero(~bounded))
        ok += int(fit.ok)
    shares = np.array(held)
    parts = [shares[:, :3], shares[:, 3:6], shares[:, 6:9], shares[:, 9:], shares]
    return [
        *(f"{100 * v:.2f}" for v in (np.median(axes), np.percentile(axes, 95))),
        *(f"{v:.3f}" for v in (np.median(exponents), np.percentile(exponents, 95))),
        *(f"{100 * np.nanmean(share):.1f} %" for share in parts),
        str(open_sizes),
        str(ok),
        f"{1e3 * np.median(seconds):.0f}",
    ]
