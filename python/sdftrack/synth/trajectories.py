# SPDX-License-Identifier: MIT
"""Trajectories of an object in front of the camera: functions (n, random numbers, centre) -> (n, 4, 4) T_cam_obj.

`centre` is the middle of the object in its own frame; it is what a path moves, so that an object whose origin
lies outside it stays in view.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry

Array = NDArray[np.float64]
Trajectory = Callable[[int, np.random.Generator, Array], Array]


@dataclass(frozen=True)
class random_walk:
    """A smooth random path with rotation through many views.

    In every frame the centre moves by exactly `step_m` metres (straight line) and the object rotates by exactly
    `step_rad` radians. The centre stays within `spread_m` of (0, 0, `distance_m`) along each axis.
    """

    step_m: float = 0.005
    step_rad: float = float(np.radians(1.5))
    distance_m: float = 0.8
    spread_m: tuple[float, float, float] = (0.10, 0.07, 0.06)

    def __call__(self, n: int, rng: np.random.Generator, centre: Array) -> Array:
        path = _walk(n, self.step_m, np.asarray(self.spread_m, dtype=float), rng) + np.array(
            [0, 0, self.distance_m]
        )
        return _about(path, _turns(n, self.step_rad, rng), centre)


@dataclass(frozen=True)
class orbit:
    """The camera circles the object `turns` times at `distance_m`, `elevation_rad` above its x-y plane."""

    distance_m: float = 0.8
    turns: float = 1.0
    elevation_rad: float = 0.4

    def __call__(self, n: int, rng: np.random.Generator, centre: Array) -> Array:
        angles = rng.uniform(0, 2 * np.pi) + 2 * np.pi * self.turns * np.arange(n) / n
        c, s = np.cos(self.elevation_rad), np.sin(self.elevation_rad)
        eyes = self.distance_m * np.column_stack([c * np.cos(angles), c * np.sin(angles), np.full(n, s)])
        return np.array([geometry.look_at(centre + eye, centre) for eye in eyes])


@dataclass(frozen=True)
class sweep:
    """Motion through the whole image, near and far, with rotation, as required for camera calibration.

    The centre goes left and right as far as `reach_x` (x / z) and twice up and down as far as `reach_y`, from `near_m`
    to `far_m` away and back; the object turns by `step_rad` a frame.
    """

    near_m: float = 0.5
    far_m: float = 1.2
    reach_x: float = 0.40
    reach_y: float = 0.28
    step_rad: float = float(np.radians(2.5))

    def __call__(self, n: int, rng: np.random.Generator, centre: Array) -> Array:
        phase = rng.uniform(0, 2 * np.pi, 3)
        x, y, z = np.sin(np.outer(2 * np.pi * np.arange(n) / n, [1, 2, 1]) + phase).T
        z = self.near_m + (self.far_m - self.near_m) * (1 + z) / 2
        path = np.column_stack([self.reach_x * x * z, self.reach_y * y * z, z])
        return _about(path, _turns(n, self.step_rad, rng), centre)


@dataclass(frozen=True)
class static:
    """The same pose in all frames: random orientation, centre on the axis at `distance_m`."""

    distance_m: float = 0.8

    def __call__(self, n: int, rng: np.random.Generator, centre: Array) -> Array:
        path = np.tile([0.0, 0.0, self.distance_m], (n, 1))
        return _about(path, np.tile(_random_rotation(rng), (n, 1, 1)), centre)


@dataclass(frozen=True)
class leave_and_return:
    """A path that is interrupted for `away` frames, from frame `first` on, and continues elsewhere.

    The object reappears at another location, at least `apart_m` from where it disappeared, and in another orientation.
    Meanwhile its centre is `out_m` to the right of the image centre, outside the image of a usual camera; with `out_m`
    = 0 it stays in view and jumps halfway (to be hidden by `Cover(first, away)`).
    """

    first: int = 20
    away: int = 15
    out_m: float = 3.0
    apart_m: float = 0.08
    walk: random_walk = random_walk()

    def __post_init__(self) -> None:
        if self.first < 1 or self.away < 1:
            raise ValueError(
                f"leave_and_return: expected first and away of at least 1, got {self.first}, {self.away}"
            )
        if not 0 <= self.apart_m <= 2 * max(self.walk.spread_m):
            raise ValueError(
                f"leave_and_return: expected apart_m of 0 to the path's width {2 * max(self.walk.spread_m):g} m, "
                f"got {self.apart_m:g}"
            )

    def __call__(self, n: int, rng: np.random.Generator, centre: Array) -> Array:
        back = self.first + self.away
        before = self.walk(min(n, self.first if self.out_m else back), rng, centre)
        if n <= self.first:
            return before
        gone = before[self.first - 1]
        at = gone[:3, :3] @ centre + gone[:3, 3]
        for _ in range(1000):
            after = self.walk(max(n - back, 1) + self.away, rng, centre)
            here = after[self.away]
            if np.linalg.norm(here[:3, :3] @ centre + here[:3, 3] - at) >= self.apart_m:
                break
        else:
            raise ValueError(
                f"leave_and_return: found no place {self.apart_m:g} m from the last; lower apart_m"
            )
        poses = np.concatenate([np.tile(gone, (back, 1, 1)), after[self.away :]])[:n]
        poses[: len(before)] = before
        hidden = slice(self.first, min(back, n))
        if self.out_m:
            poses[hidden, 0, 3] = self.out_m
        else:
            half = self.first + self.away // 2
            poses[half:back] = after[half - self.first : self.away][: max(n - half, 0)]
        return poses


NAMED: dict[str, Trajectory] = {
    "random": random_walk(),
    "orbit": orbit(),
    "static": static(),
    "sweep": sweep(),
}


def poses_of(trajectory: Any, n: int, rng: np.random.Generator, centre: Array) -> Array:
    """(n, 4, 4) poses of a path given by name, as a function or as the poses themselves."""
    if trajectory is None:
        trajectory = "random"
    if isinstance(trajectory, str):
        if trajectory not in NAMED:
            raise ValueError(
                f"trajectory: expected one of {', '.join(NAMED)}, a path or poses, got {trajectory!r}"
            )
        trajectory = NAMED[trajectory]
    poses = np.asarray(trajectory(n, rng, centre) if callable(trajectory) else trajectory, dtype=np.float64)
    if poses.shape != (n, 4, 4):
        raise ValueError(f"trajectory: expected poses of shape ({n}, 4, 4), got {poses.shape}")
    return np.array([geometry.rigid(T, f"trajectory[{i}]") for i, T in enumerate(poses)])


def _walk(n: int, step: float, spread: Array, rng: np.random.Generator) -> Array:
    """Points on a Lissajous curve that never closes, a straight `step` apart."""
    phase = rng.uniform(0, 2 * np.pi, 3)
    rate = np.array([1.0, 1.618, 2.414]) * rng.uniform(0.9, 1.1, 3)

    def curve(t: float) -> Array:
        return spread * np.sin(rate * t + phase)

    if not 0 <= step < 0.5 * spread.max():
        raise ValueError(f"step_m: expected 0 to half of the spread {spread.max():g} m, got {step:g}")
    points, t = [curve(0.0)], 0.0
    dt = 0.05 * step / max(float(np.linalg.norm(spread * rate)), 1e-12)
    for _ in range(n - 1):
        low = high = t
        while step > 0 and np.linalg.norm(curve(high) - points[-1]) < step:
            low, high = high, high + dt
        for _ in range(60):
            middle = 0.5 * (low + high)
            if np.linalg.norm(curve(middle) - points[-1]) < step:
                low = middle
            else:
                high = middle
        t = high
        points.append(curve(t))
    return np.array(points)


def _turns(n: int, step: float, rng: np.random.Generator) -> Array:
    """Rotations, each `step` radians from the one before, about a slowly wandering axis."""
    R = [_random_rotation(rng)]
    phase, rate = rng.uniform(0, 2 * np.pi, 3), np.array([0.5, 0.81, 1.21]) * rng.uniform(0.9, 1.1, 3)
    for i in range(n - 1):
        axis = np.sin(rate * (i * step) + phase) + np.array([1e-3, 0, 0])
        R.append(geometry.pose(step * axis / np.linalg.norm(axis))[:3, :3] @ R[-1])
    return np.array(R)


def _about(path: Array, R: Array, centre: Array) -> Array:
    poses = np.tile(np.eye(4), (len(path), 1, 1))
    poses[:, :3, :3] = R
    poses[:, :3, 3] = path - R @ centre
    return poses


def _random_rotation(rng: np.random.Generator) -> Array:
    q = rng.normal(size=4)
    q /= np.linalg.norm(q)
    angle = 2 * np.arctan2(np.linalg.norm(q[1:]), q[0])
    return geometry.pose(angle * q[1:] / np.linalg.norm(q[1:]))[:3, :3]
