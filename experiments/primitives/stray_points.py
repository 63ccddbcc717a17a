# SPDX-License-Identifier: MIT
"""Sizes of primitives from clouds in which some of the points are not on the surface."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.registry import experiment
from experiments.table import Table

POINTS, NOISE_M = 2000, 1e-3
BOX_M = 0.15  # half the side of the cube in which the stray points are
RIGHT_M = 2e-3

Array = NDArray[np.float64]


def surface(kind: str, half: bool, rng: np.random.Generator) -> tuple[Array, dict[str, float]]:
    """Points on a solid of random lengths, m, all over it or on the half that a camera sees, and those lengths."""
    turn = np.pi * rng.uniform(-0.5, 0.5, POINTS) * (1 if half else 2)
    if kind == "sphere":
        p, radius = rng.normal(size=(POINTS, 3)), rng.uniform(0.02, 0.08)
        p[:, 0] = np.abs(p[:, 0]) if half else p[:, 0]
        return radius * p / np.linalg.norm(p, axis=1, keepdims=True), {"radius": radius}
    if kind == "cylinder":  # its side; the height is where the points end
        radius, height = rng.uniform(0.02, 0.06), rng.uniform(0.06, 0.2)
        z = rng.uniform(-height / 2, height / 2, POINTS)
        return np.c_[radius * np.cos(turn), radius * np.sin(turn), z], {"radius": radius}
    if kind == "cone":
        radius, height = rng.uniform(0.03, 0.06), rng.uniform(0.08, 0.2)
        along = np.sqrt(rng.uniform(0, 1, POINTS))  # from the apex
        z = height / 2 - height * along
        return np.c_[radius * along * np.cos(turn), radius * along * np.sin(turn), z], {
            "radius": radius,
            "height": height,
        }
    lengths = np.sort(rng.uniform(0.04, 0.2, 3))[::-1]
    areas = lengths.prod() / lengths
    face = rng.choice(3, POINTS, p=areas / areas.sum())
    p = rng.uniform(-0.5, 0.5, (POINTS, 3)) * lengths
    side = 1 if half else rng.choice([-1, 1], POINTS)
    p[np.arange(POINTS), face] = side * lengths[face] / 2
    return p, dict(zip("xyz", lengths.tolist(), strict=True))


def cloud(kind: str, half: bool, share: float, seed: int) -> tuple[Array, dict[str, float]]:
    """A turned surface with noise, 0.8 m away, and stray points everywhere around it."""
    rng = np.random.default_rng([seed, half, round(100 * share), len(kind)])
    p, lengths = surface(kind, half, rng)
    p += rng.normal(0, NOISE_M, p.shape)
    strays = rng.uniform(-BOX_M, BOX_M, (round(POINTS * share / (1 - share)), 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.concatenate([p, strays]) @ turn.T + [0, 0, 0.8], lengths


@experiment(
    "primitives.stray",
    chosen_on="seeds 0 to 9",
    reported_on="seeds 100 to 109",
    short={"n": 2, "shares": (0.2,)},
)
def stray(
    *,
    n: int = 10,
    first: int = 100,
    kinds: tuple[str, ...] = ("cylinder", "box", "sphere", "cone"),
    shares: tuple[float, ...] = (0.0, 0.1, 0.2, 0.3),
) -> Table:
    """Sizes of primitives from clouds in which some of the points are not on the surface.

    2,000 points of 1 mm noise and stray points in a cube of 0.3 m; right: each length within 2 mm.

    Parameters
    ----------
    n
        clouds per kind, share and half
    first
        seed
    kinds
        of solids, comma separated
    shares
        of all points that are stray ones, comma separated
    """
    rows = {}
    for kind in kinds:
        for half in (False, True):
            errors, seconds = [], []
            for share in shares:
                for seed in range(first, first + n):
                    points, lengths = cloud(kind, half, share, seed)
                    began = time.process_time()
                    fit = st.fit_primitive(points, kind, threads=1)
                    seconds.append(time.process_time() - began)
                    errors.append(max(abs(fit.size[name] - length) for name, length in lengths.items()))
            error = np.array(errors)
            rows[f"{kind}, {'the half towards a camera' if half else 'all around'}"] = {
                "clouds": len(error),
                "right": 100 * float(np.mean(error < RIGHT_M)),
                "median": 1e3 * float(np.median(error)),
                "worst": 1e3 * float(error.max()),
                "ms": 1e3 * float(np.median(seconds)),
            }
    columns = {"points": "name", "clouds": "clouds:d", "right %": "right:.0f", "median mm": "median:.2f"}
    columns |= {"worst mm": "worst:.1f", "ms": "ms:.1f"}
    return Table.of("clouds with stray points", columns, rows)
