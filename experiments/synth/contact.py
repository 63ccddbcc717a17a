# SPDX-License-Identifier: MIT
"""Gaps between solids: penetration depth of two poses, and contact of copies of a shape.

A gap is the least value of one solid's signed distance at points of the other's surface, taken both ways: below
zero it is a depth of penetration. Two copies at nearly one pose have their surfaces on each other, so points inside
count too: a place d deep in one solid and e deep in the other says that these are d + e from apart. Between the
points a gap is blind to less than the thickness of an edge.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.metrics.scores import _surface_points

Array = NDArray[np.float64]
POINTS, INNER = 3000, 1000
NEAR_M = 0.02  # points farther than this outside the other's ball are not looked up
SHARE = (
    0.6  # of a gap that one may safely go on: far from the volume its distances are too large, by up to half
)
MIN_STEP_M = 0.001


@dataclass(frozen=True)
class Solid:
    """A shape by its distances, points of its surface and inside it, and the ball (m, object frame) that holds it.

    Attributes
    ----------
    points : (N, 3) float64
        Of the surface.
    inside, depth : (K, 3), (K,) float64
        Places inside, and how deep (m) each of them is.
    """

    sdf: Any
    points: Array
    inside: Array
    depth: Array
    centre: Array
    radius: float

    @classmethod
    def of(cls, mesh: Any, sdf: Any, points: int = POINTS) -> Solid:
        """From a mesh and its volume."""
        centre = mesh.bounds.mean(axis=0)
        radius = float(np.linalg.norm(mesh.vertices - centre, axis=1).max())
        inside, depth = _inner_points(sdf)
        return cls(sdf, _surface_points(mesh, points, 0), inside, depth, centre, radius)

    def at(self, R: Array, place: Array) -> Array:
        """T_cam_obj with the ball's centre at `place`."""
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, place - R @ self.centre
        return T

    def place(self, T: Array) -> Array:
        """The ball's centre under poses (..., 4, 4)."""
        there: Array = T[..., :3, :3] @ self.centre + T[..., :3, 3]
        return there


def gap(solid: Solid, a: Array, b: Array) -> float:
    """Gap (m, below zero: penetration) between copies at two poses; far apart that of the balls."""
    apart = float(np.linalg.norm(solid.place(a) - solid.place(b))) - 2 * solid.radius
    if apart > NEAR_M:
        return apart
    return min(_one_way(solid, a, b), _one_way(solid, b, a))


def _one_way(solid: Solid, of: Array, in_: Array) -> float:
    p, _ = _near(solid, solid.points, of, in_)
    least = float(solid.sdf(p).min()) if len(p) else NEAR_M
    if least >= 0:  # nothing of one surface is in the other: nor is what it encloses, or all of it is
        p = (solid.inside[:1] @ of[:3, :3].T + of[:3, 3] - in_[:3, 3]) @ in_[:3, :3]
        return min(least, _sunk(solid, p, solid.depth[:1]) or least)
    p, kept = _near(solid, solid.inside, of, in_)
    return min(least, _sunk(solid, p, solid.depth[kept]))


def _near(solid: Solid, points: Array, of: Array, in_: Array) -> tuple[Array, NDArray[np.bool_]]:
    p = (points @ of[:3, :3].T + of[:3, 3] - in_[:3, 3]) @ in_[:3, :3]
    near = ((p - solid.centre) ** 2).sum(axis=1) < (solid.radius + NEAR_M) ** 2
    return p[near], near


def _sunk(solid: Solid, p: Array, depth: Array) -> float:
    """Both depths together, below zero, at the worst place that is inside both."""
    phi = solid.sdf(p) if len(p) else np.zeros(0)
    both = phi < 0
    return float((phi[both] - depth[both]).min()) if both.any() else 0.0


def _inner_points(sdf: Any) -> tuple[Array, Array]:
    """Up to `INNER` voxel centres inside, (K, 3), and their depths (K,), the deepest one first."""
    at = np.argwhere(np.asarray(sdf.values) < -2 * sdf.voxel_size)
    depth = -np.asarray(sdf.values, np.float64)[tuple(at.T)]
    order = np.argsort(-depth, kind="stable")[:: max(1, len(depth) // INNER)]
    return np.asarray(sdf.origin) + sdf.voxel_size * at[order][:, ::-1], depth[order]


def min_gap(solid: Solid, poses: Iterable[Array]) -> float:
    """The smallest gap of any pair; inf for one object."""
    return min((gap(solid, a, b) for a, b in combinations(list(poses), 2)), default=float("inf"))


def deepest(solid: Solid, poses: Array, counts: NDArray[np.bool_] | None = None) -> Array:
    """Deepest penetration (m, 0: none) of any pair in each frame of (n, M, 4, 4) poses.

    `counts` (n, M) leaves out objects that have no pose in a frame.
    """
    out = np.zeros(len(poses))
    for i, frame in enumerate(poses):
        kept = frame if counts is None else frame[counts[i]]
        out[i] = max(0.0, -min_gap(solid, kept))
    return out


def first_contact(
    solid: Solid, others: list[Array], R: Array, start: Array, toward: Array, far_m: float, gap_m: float
) -> float:
    """How far (m) along -`toward` from `start` a copy stands that came in along `toward` until it touched.

    It comes from `far_m` and halts where the gap to one of `others` is `gap_m` (to 0.05 mm, never less), at the
    latest at `start`.
    """

    def free(s: float) -> float:
        T = solid.at(R, start - s * toward)
        return min(gap(solid, T, other) for other in others)

    last, s = far_m, far_m
    while (room := free(s) - gap_m) >= 0:
        if s <= 0:
            return 0.0
        last, s = s, max(0.0, s - max(SHARE * room, MIN_STEP_M))
    low, high = s, last
    while high - low > 5e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if free(middle) >= gap_m else (middle, high)
    return high
