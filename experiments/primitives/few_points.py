# SPDX-License-Identifier: MIT
"""How often a primitive is found in few points, and whether its covariance is right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.primitives.solids import EVERY_KIND, Kind
from experiments.registry import experiment
from experiments.synth.solids import KINDS, ray_depth
from experiments.table import Table

SIZES = {
    "sphere": {"radius": 0.05},
    "cylinder": {"radius": 0.04, "height": 0.11},
    "cone": {"radius": 0.06, "height": 0.13},
    "box": {"x": 0.10, "y": 0.06, "z": 0.08},
    "ellipsoid": {"rx": 0.05, "ry": 0.08, "rz": 0.035},
}
NOISE_M = 5e-4
RIGHT = 0.1  # of each length
COUNTS = (12, 20, 35, 50, 100, 200)
MIDDLE_M = np.array([0.03, -0.02, 0.8])

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Few:
    """Of many clouds: shares found within 10 % and of status ok, and errors over sd where there is one."""

    found: float
    ok: float
    error: float
    z: Array
    open_share: float


def few_points(kind: str, count: int, rng: np.random.Generator) -> Array:
    """(count, 3) m, where rays from all around a solid first hit it."""
    out: list[Array] = []
    while len(out) < count:
        origin = rng.normal(size=3)
        origin *= 0.5 / np.linalg.norm(origin)
        rays = rng.uniform(-0.06, 0.06, (6, 3)) - origin
        t, _ = ray_depth(kind, SIZES[kind], origin, rays)
        hit = np.isfinite(t)
        out.extend(origin + t[hit, None] * rays[hit])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points: Array = np.array(out[:count]) @ turn.T + MIDDLE_M + rng.normal(0, NOISE_M, (count, 3))
    return points


def found_and_z(kind: str, count: int, seed: int) -> tuple[bool, bool, float, Array, int]:
    """Of one cloud: right, ok, largest relative error, errors over sd, and how many lengths have none."""
    points = few_points(kind, count, np.random.default_rng([KINDS.index(kind), count, seed]))
    fit = st.fit_primitive(points, kind, seed=seed, threads=1)
    size, true = np.array(list(fit.size.values())), np.array(list(SIZES[kind].values()))
    variance = np.diag(fit.covariance)[6:]
    if kind in ("box", "ellipsoid"):  # whose axes may come in any order
        order = np.argsort(size)
        size, variance, true = size[order], variance[order], np.sort(true)
    told = np.isfinite(variance)
    error = float(np.abs(size / true - 1).max())
    return error < RIGHT, fit.ok, error, ((size - true) / np.sqrt(variance))[told], int((~told).sum())


def run(kind: str, count: int, runs: int) -> Few:
    """`runs` clouds of `count` points."""
    rows = [found_and_z(kind, count, seed) for seed in range(runs)]
    z = np.concatenate([row[3] for row in rows])
    return Few(
        float(np.mean([row[0] for row in rows])),
        float(np.mean([row[1] for row in rows])),
        float(np.median([row[2] for row in rows])),
        z,
        sum(row[4] for row in rows) / (runs * len(SIZES[kind])),
    )


@experiment(
    "primitives_few",
    chosen_on="the same solids, seeds 0 to 39",
    reported_on="the same solids, seeds 0 to 39",
    short={"n": 1, "counts": (50,)},
)
def few(
    *,
    n: int = 40,
    kinds: tuple[Kind, ...] = EVERY_KIND,
    counts: tuple[int, ...] = COUNTS,
) -> Table:
    """How often a primitive is found in few points, and whether its covariance is right.

    The points lie all over a solid that is rotated at random, 0.5 mm of noise.

    Parameters
    ----------
    n
        clouds per row
    kinds
        of solids, comma separated
    counts
        numbers of points, comma separated
    """
    rows = {}
    for kind in kinds:
        for count in counts:
            found = run(kind, count, n)
            rows[f"{kind}, {count} points"] = {
                **{key: 100 * getattr(found, key) for key in ("found", "error", "ok", "open_share")},
                "rms_z": float(np.sqrt(np.mean(found.z**2))) if len(found.z) else None,
                "within": 100 * float(np.mean(np.abs(found.z) < 2)) if len(found.z) else None,
            }
    columns = {"kind, points": "name", "found %": "found:.0f", "error %": "error:.1f", "ok %": "ok:.0f"}
    columns |= {"no sd %": "open_share:.0f", "rms z": "rms_z:.2f", "within 2 sd %": "within:.0f"}
    return Table.of(f"{n} clouds a row", columns, rows)
