# SPDX-License-Identifier: MIT
"""Zones and paths that the object should enter or follow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_closing, binary_opening

from sdftrack._internal.text_files import read_text
from sdftrack._internal.validation import number, numbers
from sdftrack.motion.definitions import Compute, Context, Definition, on_repetition
from sdftrack.motion.posterior import MotionSamples

Array = NDArray[np.float64]


def definitions_of_target(target: Target, number: int) -> list[Definition]:
    """Measures of a target: time in it, entries, nearest and mean distance, error at the end."""
    what = {"Sphere": "sphere", "Box": "box", "Path": "path"}[type(target).__name__]
    aim = "the last point of the path" if isinstance(target, Path) else "its centre"
    of = f"target {number} ({what})"

    def measure(name: str, label: str, unit: str, text: str, wide: float, compute: Compute) -> Definition:
        source = "Distance of a point from a shape"
        return Definition(
            f"target{number}_{name}", label, unit, text, source, wide, False, on_repetition(compute)
        )

    def outside(samples: MotionSamples) -> Array:
        return np.maximum(target.distances(samples.positions_m), 0)

    def inside(samples: MotionSamples) -> Mask:
        return np.asarray(target.distances(samples.positions_m) <= 0)

    def error(samples: MotionSamples, context: Context) -> Array:
        end = context.movements[0][1] if context.movements else context.end_s
        k = int(np.clip(np.searchsorted(samples.times_s, end - 1e-9), 0, len(samples.times_s) - 1))
        return np.asarray(np.linalg.norm(samples.positions_m[:, k] - target.aim_m, axis=-1))

    return [
        measure(
            "time", f"Time in {of}", "s", f"Time of the repetition in which the point is in {of}.", 0.3,
            lambda samples, _: inside(samples).sum(axis=1) / samples.rate_hz,
        ),
        measure(
            "nearest", f"Nearest distance from {of}", "m",
            f"Smallest distance of the point from {of} in the repetition, 0 inside.", 0.01,
            lambda samples, _: outside(samples).min(axis=1),
        ),
        measure(
            "mean", f"Mean distance from {of}", "m",
            f"Mean distance of the point from {of} over the repetition, 0 inside.", 0.01,
            lambda samples, _: outside(samples).mean(axis=1),
        ),
        measure(
            "entries", f"Entries into {of}", "1",
            f"Number of times that the point comes into {of}, a start inside as one: stays and absences shorter than "
            "0.1 s are not counted.", 2,
            lambda samples, _: beginnings(settled(inside(samples), samples.rate_hz)).sum(axis=1).astype(np.float64),
        ),
        measure(
            "error", f"Error at the end for {of}", "m",
            f"Distance of the point from {aim} at the end of the first movement of the repetition, or of the "
            "repetition where its movements are not told apart.", 0.01, error,
        ),
    ]  # fmt: skip


FORMS = "sphere:x,y,z,r, box:x0,y0,z0,x1,y1,z1 or path:FILE.csv,r (metres)"


@dataclass(frozen=True)
class Sphere:
    """A ball about `center_m` (3,), reference frame."""

    center_m: Any
    radius_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center_m", _points(self.center_m, "center_m", (3,)))
        object.__setattr__(self, "radius_m", _radius(self.radius_m))

    @property
    def aim_m(self) -> Array:
        """(3,) the centre."""
        return np.asarray(self.center_m)

    def distances(self, points: Array) -> Array:
        """(...,) distances of points (..., 3) from the surface, negative inside."""
        return np.asarray(np.linalg.norm(points - self.center_m, axis=-1) - self.radius_m)


@dataclass(frozen=True)
class Box:
    """A box between two corners, along the axes of the reference frame."""

    low_m: Any
    high_m: Any

    def __post_init__(self) -> None:
        low, high = _points(self.low_m, "low_m", (3,)), _points(self.high_m, "high_m", (3,))
        if not (low < high).all():
            raise ValueError(
                f"box: expected low < high along each axis, got {low.tolist()} and {high.tolist()}"
            )
        object.__setattr__(self, "low_m", low)
        object.__setattr__(self, "high_m", high)

    @property
    def aim_m(self) -> Array:
        """(3,) the centre."""
        return np.asarray(0.5 * (self.low_m + self.high_m))

    def distances(self, points: Array) -> Array:
        """(...,) distances of points (..., 3) from the surface, negative inside."""
        beyond = np.maximum(self.low_m - points, points - self.high_m)
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=-1)
        return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0))


@dataclass(frozen=True)
class Path:
    """A line through points (K, 3) that should be followed within `radius_m`."""

    points_m: Any
    radius_m: float

    def __post_init__(self) -> None:
        points = _points(self.points_m, "points_m", (None, 3))
        if len(points) < 2:
            raise ValueError(f"path: expected at least two points, got {len(points)}")
        object.__setattr__(self, "points_m", points)
        object.__setattr__(self, "radius_m", _radius(self.radius_m))

    @property
    def aim_m(self) -> Array:
        """(3,) the end of the line."""
        return np.asarray(self.points_m[-1])

    def distances(self, points: Array) -> Array:
        """(...,) distances of points (..., 3) from the line less its radius."""
        nearest = np.full(points.shape[:-1], np.inf)
        for a, b in zip(self.points_m[:-1], self.points_m[1:], strict=True):
            length2 = max(float((b - a) @ (b - a)), 1e-18)
            along = np.clip((points - a) @ (b - a) / length2, 0, 1)
            nearest = np.minimum(nearest, np.linalg.norm(points - a - along[..., None] * (b - a), axis=-1))
        return np.asarray(nearest - self.radius_m)


Target = Sphere | Box | Path


def parse_target(text: str) -> Target:
    """A target written as text; ValueError with the forms that are possible.

    >>> parse_target("sphere:0,0,0.8,0.05").radius_m
    0.05
    """
    if not isinstance(text, str):
        raise TypeError(f"target: expected text, got {type(text).__name__}")
    kind, _, rest = text.partition(":")
    parts = [p.strip() for p in rest.split(",")]
    try:
        if kind == "sphere" and len(parts) == 4:
            return Sphere([float(p) for p in parts[:3]], float(parts[3]))
        if kind == "box" and len(parts) == 6:
            return Box([float(p) for p in parts[:3]], [float(p) for p in parts[3:]])
        if kind == "path" and len(parts) == 2:
            return Path(_read_points(FilePath(parts[0])), float(parts[1]))
    except ValueError as error:
        raise ValueError(f"target {text!r}: {error}; expected {FORMS}") from None
    raise ValueError(f"target: expected {FORMS}, got {text!r}")


def _read_points(path: FilePath) -> Array:
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    try:
        lines = read_text(path).splitlines()
        if not any(line.partition("#")[0].strip() for line in lines):
            raise ValueError("no points")
        return np.loadtxt(lines, delimiter=",", comments="#", ndmin=2, dtype=np.float64)
    except ValueError:
        raise ValueError(f"{path}: expected lines of x,y,z in metres") from None


def _points(value: ArrayLike, name: str, shape: tuple[int | None, ...]) -> Array:
    array = numbers(value, name)
    wanted = "three coordinates" if len(shape) == 1 else "points (K, 3)"
    if array.ndim != len(shape) or array.shape[-1] != 3 or not np.isfinite(array).all():
        raise ValueError(f"{name}: expected {wanted}, finite, in metres, got shape {array.shape}")
    if np.abs(array).max() > 100:
        raise ValueError(f"{name}: expected metres, got {np.abs(array).max():g}; in mm? divide by 1000")
    return array


def _radius(value: float) -> float:
    radius = number(value, "radius_m")
    if not 0 < radius <= 10:
        raise ValueError(f"radius_m: expected more than 0 and at most 10 m, got {value!r}")
    return radius


Mask = NDArray[np.bool_]
MIN_S = 0.1  # noise at a threshold makes many short stretches of one


def settled(holds: Mask, rate_hz: float, min_s: float = MIN_S) -> Mask:
    """(S, n) `holds` without breaks and then without stretches that are shorter than `min_s`."""
    # A stretch or break at either end of the recording stays: how long it goes on beyond is not known.
    count = max(1, round(min(min_s * rate_hz, holds.shape[1] + 1)))  # what is longer than all is no different
    beyond = 3 * count  # both filters take something off the ends
    wide = np.pad(holds, ((0, 0), (beyond, beyond)), mode="edge")
    window = np.ones((1, count), dtype=bool)
    done = binary_opening(binary_closing(wide, window), window)
    return np.asarray(done[:, beyond:-beyond])


def beginnings(holds: Mask) -> Mask:
    """(S, n) True at the first sample of each stretch."""
    before = np.pad(holds, ((0, 0), (1, 0)))[:, :-1]
    return np.asarray(holds & ~before)
