# SPDX-License-Identifier: MIT
"""Round bodies that lie, lean or hover on a table: does what holds those that stand harm the others?"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from experiments.common.primitive_errors import measure
from experiments.primitives.solids import CAMERA, NOISES
from experiments.registry import experiment
from experiments.synth.solids import KINDS, posed_scene
from experiments.table import Table
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives import fit_primitive
from sdftrack.synth.noise import Noise

Array = NDArray[np.float64]
CASES: tuple[tuple[str, str, float, float], ...] = (  # kind, how, lean (deg), height above the table (m)
    ("cylinder", "lies", 90.0, 0.0),
    ("cylinder", "lies, raised by", 85.0, 0.0),
    ("cylinder", "leans by", 1.0, 0.0),
    ("cylinder", "leans by", 3.0, 0.0),
    ("cylinder", "leans by", 6.0, 0.0),
    ("cylinder", "leans by", 20.0, 0.0),
    ("cylinder", "hovers, leans by", 4.0, 0.015),
    ("cylinder", "hovers, leans by", 4.0, 0.05),
    ("cone", "leans by", 3.0, 0.0),
    ("cone", "hovers, leans by", 4.0, 0.05),
)


@experiment(
    "primitives.resting",
    chosen_on="solids that stand (`primitives.synthetic`)",
    reported_on="50 views of each way to lie, lean or hover",
    short={"n": 1, "cases": 1},
)
def resting(*, n: int = 50, cases: int = len(CASES)) -> Table:
    """Round bodies that lie, lean or hover on a table, the kind given.

    Parameters
    ----------
    n
        views of each case
    cases
        the first so many
    """
    rows = [
        [f"{name}, {kind} {_words(how, lean, above)}", *_row(kind, n, noise, CAMERA, lean, above)]
        for name, (noise, _, _) in NOISES.items()
        for kind, how, lean, above in CASES[:cases]
    ]
    head = [
        "noise, kind, how",
        "n",
        "size err",
        "size p95",
        "axis err",
        "axis p95",
        "axis sd",
        "within 3 sd",
        "held lost",
    ]
    title = (
        "Round bodies that do not stand: errors, median and 95th percentile (%, deg); stated deviation of the axis "
        "(median, deg); views whose axis is within three of them"
    )
    return Table(title, head, rows)


def _words(how: str, lean: float, above: float) -> str:
    if how == "lies":
        return how
    angle = 90 - lean if how.startswith("lies") else lean
    return f"{how} {angle:g} deg" + (f", {1e3 * above:g} mm up" if above else "")


def _row(kind: str, count: int, noise: Noise, camera: Camera, lean: float, above: float) -> list[str]:
    errors, unheld = [], 0
    for i in range(count):
        rng = np.random.default_rng([KINDS.index(kind), i, 11])
        scene = posed_scene(kind, camera, rng, lean, above)
        frame = Frame(noise(scene.depth, scene.cosine, rng))
        fit = fit_primitive(frame, kind, camera=camera)
        errors.append(measure(fit, scene))
        unheld += not all(fit.bounded.values())
    size = 100 * np.array([e.size for e in errors])
    axis, sd = (np.array([getattr(e, name) for e in errors]) for name in ("axis_deg", "axis_sd_deg"))
    of: Callable[[Array, float], str] = lambda x, q: f"{np.percentile(x, q):.2f}"  # noqa: E731
    return [
        str(count), of(size, 50), of(size, 95), of(axis, 50), of(axis, 95), of(sd, 50),
        f"{100 * np.mean(axis <= 3 * sd):.0f} %", str(unheld),
    ]  # fmt: skip
