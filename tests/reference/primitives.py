# SPDX-License-Identifier: MIT
"""Solids of unknown size in plain numpy: distances by looking for the nearest point, rays by small steps.

Slow and obvious; nothing here uses the formulas of the core.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def distance(kind: str, size: dict[str, float], points: Array) -> Array:
    """Signed distance (m, negative inside) of points (N, 3) to a solid, its own frame.

    size : as in `sdftrack.fit_primitive`.
    """
    if kind == "sphere":
        return np.asarray(np.linalg.norm(points, axis=1) - size["radius"])
    if kind == "box":
        return _convex(points, lambda p: _nearest_in_box(p, size), lambda p: _depth_in_box(p, size))
    if kind in ("cylinder", "cone"):
        return _round(kind, size, points)
    if kind == "plane":  # which has no inside
        return np.asarray(np.linalg.norm(points - _nearest_on_patch(points, size), axis=1))
    if kind == "superquadric":
        return np.array([_superquadric(p, size) for p in np.abs(points)])
    return np.array([_ellipsoid(p, np.array([size["rx"], size["ry"], size["rz"]])) for p in points])


def _convex(points: Array, nearest: Any, depth: Any) -> Array:
    """The way to the nearest point of the solid outside, the depth below the nearest face inside."""
    out = np.linalg.norm(points - nearest(points), axis=1)
    return np.where(out > 0, out, -depth(points))


def _nearest_on_patch(points: Array, size: dict[str, float]) -> Array:
    half = np.array([size["width"] / 2, size["height"] / 2, 0])
    return np.clip(points, -half, half)


def _edges(size: dict[str, float]) -> Array:
    return np.array([size["x"], size["y"], size["z"]])


def _nearest_in_box(points: Array, size: dict[str, float]) -> Array:
    return np.clip(points, -_edges(size) / 2, _edges(size) / 2)


def _depth_in_box(points: Array, size: dict[str, float]) -> Array:
    return np.asarray((_edges(size) / 2 - np.abs(points)).min(axis=1))


def _round(kind: str, size: dict[str, float], points: Array) -> Array:
    """A polygon in the half plane (r, z), turned: distances to its sides as line segments."""
    R, h = size["radius"], size["height"] / 2
    corners = [(0, -h), (R, -h), (R, h), (0, h)] if kind == "cylinder" else [(0, -h), (R, -h), (0, h)]
    at = np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
    least = np.full(len(points), np.inf)
    inside = np.ones(len(points), bool)
    for a, b in zip(np.array(corners[:-1], float), np.array(corners[1:], float), strict=True):
        along = b - a
        t = np.clip((at - a) @ along / (along @ along), 0, 1)
        least = np.minimum(least, np.linalg.norm(at - a - t[:, None] * along, axis=1))
        inside &= along[0] * (at[:, 1] - a[1]) - along[1] * (at[:, 0] - a[0]) > 0  # left of each side
    return np.where(inside, -least, least)


def _ellipsoid(p: Array, a: Array) -> float:
    """Bisection for the root of sum (a p / (t + a^2))^2 = 1, t above minus the least a^2."""
    p = np.where(np.abs(p) < 1e-12, 1e-12, np.abs(p))
    low, high = -(a.min() ** 2), float(np.linalg.norm(a * p)) + 1e-9
    for _ in range(100):
        t = (low + high) / 2
        if ((a * p / (t + a**2)) ** 2).sum() > 1:
            low = t
        else:
            high = t
    nearest = a**2 * p / (high + a**2)
    sign = 1 if ((p / a) ** 2).sum() > 1 else -1
    return float(sign * np.linalg.norm(p - nearest))


def superquadric_norm(size: dict[str, float], points: Array) -> Array:
    """1 on the surface, t at t times a point of it; of points (N, 3)."""
    x, y, z = np.abs(points / [size["rx"], size["ry"], size["rz"]]).T
    level = (x ** (2 / size["e2"]) + y ** (2 / size["e2"])) ** (size["e2"] / size["e1"])
    return np.asarray((level + z ** (2 / size["e1"])) ** (size["e1"] / 2))


def _superquadric(p: Array, size: dict[str, float]) -> float:
    """The nearest of the surface's points in the first octant, by ever finer grids of directions about the best."""
    middle, reach, nearest = np.full(2, np.pi / 4), np.pi / 4, np.inf
    steps = np.stack(np.meshgrid(*[np.linspace(-1, 1, 33)] * 2), axis=-1).reshape(-1, 2)
    for _ in range(30):
        polar, turn = np.clip(middle + reach * steps, 0, np.pi / 2).T
        way = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
        away = np.linalg.norm(p - way / superquadric_norm(size, way)[:, None], axis=1)
        middle, nearest = np.array([polar, turn])[:, away.argmin()], min(nearest, away.min())
        reach *= 0.5
    return float(nearest if superquadric_norm(size, p[None])[0] > 1 else -nearest)


def printed_field(kind: str, size: dict[str, float], points: Array) -> Array:
    """The thesis' form (Eq. 3.27): the field of a unit solid, of points (N, 3) under the inverse of S = diag(s)."""
    scale = {
        "sphere": lambda s: [s["radius"]] * 3,
        "box": lambda s: [s["x"], s["y"], s["z"]],
        "ellipsoid": lambda s: [s["rx"], s["ry"], s["rz"]],
        "plane": lambda s: [s["width"], s["height"], 1.0],
    }.get(kind, lambda s: [s["radius"], s["radius"], s["height"]])(size)
    unit_kind = "sphere" if kind == "ellipsoid" else kind
    unit = dict.fromkeys(
        {"sphere": ["radius"], "box": ["x", "y", "z"], "plane": ["width", "height"]}.get(
            unit_kind, ["radius", "height"]
        ),
        1.0,
    )
    return distance(unit_kind, unit, points / np.array(scale))
