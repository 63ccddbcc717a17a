# SPDX-License-Identifier: MIT
"""Gaps between solids: penetration depth of two poses, contact of copies of a shape, and paths that never penetrate.

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

from sdftrack import geometry
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


# -- Paths of two solids that touch and never penetrate, and the curves that they are made of


# Changing these numbers breaks comparisons with every figure that was printed with them.
MAX_STEP_M, MAX_RAD = 0.005, np.deg2rad(1.5)
CONTACT_M = 0.0005  # wanted gap of a contact; it counts as one up to 1 mm
GAP_RATE_M = 0.002  # per frame: how fast the separation follows a hollow of the shape
DISTANCE_M = 0.8


def apart(solid: Solid, R: Array, middle: Array, direction: Array, gaps: Array) -> Array:
    """(n, 2, 4, 4): two copies of orientation R (n, 2, 3, 3) about `middle`, `gaps` apart along `direction`.

    The separation is at least that of the outermost contact in each frame, and follows it smoothly.
    """
    far = 2 * solid.radius + 0.01
    least = np.array(
        [
            first_contact(solid, [solid.at(Rs[0], m)], Rs[1], m, -d, far, CONTACT_M)
            for Rs, m, d in zip(R, middle, direction, strict=True)
        ]
    )
    for order in (range(1, len(least)), range(len(least) - 2, -1, -1)):
        for i in order:
            neighbour = least[i - 1] if order.step > 0 else least[i + 1]
            least[i] = max(least[i], neighbour - GAP_RATE_M)
    half = 0.5 * (least + gaps - CONTACT_M)[:, None] * direction
    return np.array(
        [[solid.at(Rs[0], m - h), solid.at(Rs[1], m + h)] for Rs, m, h in zip(R, middle, half, strict=True)]
    )


def steps(solid: Solid, poses: Array) -> float:
    """Largest step of a path as a multiple of what is allowed."""
    metres = np.linalg.norm(np.diff(solid.place(poses), axis=0), axis=-1).max(initial=0)
    relative = np.einsum("...ji,...jk->...ik", poses[:-1, :, :3, :3], poses[1:, :, :3, :3])
    cosine = np.clip(0.5 * (np.trace(relative, axis1=-2, axis2=-1) - 1), -1, 1)
    return max(float(metres) / MAX_STEP_M, float(np.arccos(cosine).max(initial=0)) / MAX_RAD)


def wander(n: int, phase: Array) -> Array:
    """A slow path (n, 3) about the middle of the view, at most 0.7 mm a frame."""
    i = np.arange(n)
    rates = np.array([0.012, 0.015, 0.01])
    return np.array([0.03, 0.02, 0.03]) * np.sin(i[:, None] * rates + phase[:3]) + [0, 0, DISTANCE_M]


def spins(first: Array, step_rad: Array, phase: Array) -> Array:
    """(n, M, 3, 3): orientations that turn by step_rad[i] after frame i, each about its own wandering axis."""
    out = [first]
    for i, step in enumerate(step_rad[:-1]):
        turned = []
        for k, R in enumerate(out[-1]):
            axis = np.sin(phase[:3] + 1.7 * k + np.array([0.013, 0.021, 0.03]) * i) + np.array([1e-3, 0, 0])
            turned.append(geometry.pose(step * axis / np.linalg.norm(axis))[:3, :3] @ R)
        out.append(np.array(turned))
    return np.array(out)


def rotations(rng: np.random.Generator, count: int) -> Array:
    q = rng.normal(size=(count, 4))
    angle = 2 * np.arctan2(np.linalg.norm(q[:, 1:], axis=1), q[:, 0])
    return np.array([geometry.pose(a * v)[:3, :3] for a, v in zip(angle, unit(q[:, 1:]), strict=True)])


def unit(v: Array) -> Array:
    out: Array = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return out


def smooth(x: Array) -> Array:
    s = np.clip(x, 0, 1)
    out: Array = s * s * (3 - 2 * s)
    return out


def ramped(s: Array, ramp: float = 0.2) -> Array:
    """0 to 1 at even speed, with that share of the time to get up to it and as much to slow down."""
    top = 1 / (1 - ramp)
    out: Array = np.where(
        s < ramp,
        0.5 * top * s * s / ramp,
        np.where(s > 1 - ramp, 1 - 0.5 * top * (1 - s) ** 2 / ramp, top * (s - 0.5 * ramp)),
    )
    return out
