# SPDX-License-Identifier: MIT
"""Objects of synthetic sequences: a duck, a can whose print alone shows how it is turned, things for exercises."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.mesh import Mesh
from sdftrack.sdf import SDF

Array = NDArray[np.float64]
BLEND_M = 0.008  # radius of the rounding where parts meet
GRID_M = 0.002
LOW_M, HIGH_M = np.array([-0.125, -0.09, -0.065]), np.array([0.125, 0.09, 0.135])

# name: centre (m), half axes (m), turn about x, y, z (rad), RGB
PARTS: dict[str, tuple[Any, Any, Any, Any]] = {
    "body": ((0.0, 0.0, 0.0), (0.078, 0.052, 0.045), (0.0, 0.0, 0.0), (246, 200, 44)),
    "tail": ((-0.080, 0.0, 0.026), (0.030, 0.022, 0.012), (0.0, 0.7, 0.0), (246, 200, 44)),
    "head": ((0.052, 0.0, 0.068), (0.037, 0.034, 0.035), (0.0, 0.0, 0.0), (250, 208, 60)),
    "beak": ((0.093, 0.0, 0.060), (0.022, 0.017, 0.007), (0.0, 0.15, 0.0), (235, 110, 32)),
    "left wing": ((-0.008, 0.050, 0.010), (0.042, 0.012, 0.024), (0.25, 0.2, 0.1), (226, 168, 28)),
    "right wing": ((-0.012, -0.054, 0.026), (0.040, 0.011, 0.026), (0.75, 0.5, -0.2), (226, 168, 28)),
    "brim": ((0.046, 0.007, 0.098), (0.030, 0.029, 0.006), (-0.3, -0.15, 0.0), (240, 240, 245)),
    "cap": ((0.045, 0.010, 0.108), (0.022, 0.021, 0.015), (-0.3, -0.15, 0.0), (36, 66, 128)),
}
EYES = (((0.078, 0.020, 0.078), 0.0065), ((0.078, -0.020, 0.078), 0.0065))


def _rotation(w: Any) -> Array:
    x, y, z = w
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    Rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    Ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    Rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return Rz @ Ry @ Rx


def _ellipsoid(p: Array, centre: Any, radii: Any, turn: Any) -> Array:
    """Distance to first order: |q| (|q| - 1) / |q / radii| with q = p / radii; the zero set is exact."""
    local = (p - np.asarray(centre)) @ _rotation(turn)
    q = local / np.asarray(radii)
    k0 = np.linalg.norm(q, axis=-1)
    k1 = np.linalg.norm(q / np.asarray(radii), axis=-1)
    return np.where(k1 > 1e-9, k0 * (k0 - 1.0) / np.maximum(k1, 1e-9), -float(np.min(radii)))


def field(points: Array) -> Array:
    """Signed field (m, negative inside) at points (..., 3); near the surface close to the distance."""
    out: Array | None = None
    for centre, radii, turn, _ in PARTS.values():
        d = _ellipsoid(points, centre, radii, turn)
        if out is None:
            out = d
            continue
        mix = np.clip(0.5 + 0.5 * (out - d) / BLEND_M, 0.0, 1.0)  # polynomial smooth minimum
        out = out * (1 - mix) + d * mix - BLEND_M * mix * (1 - mix)
    assert out is not None
    return out


def colours(points: Array, seed: int = 0) -> NDArray[np.uint8]:
    """RGB (N, 3) uint8 of the nearest part, dark eyes, and a light seeded mottle."""
    distances = np.stack([_ellipsoid(points, c, r, w) for c, r, w, _ in PARTS.values()])
    rgb = np.array([colour for _, _, _, colour in PARTS.values()], np.float64)[np.argmin(distances, axis=0)]
    rng = np.random.default_rng(seed)
    waves = rng.normal(scale=110.0, size=(6, 3))
    mottle = np.sin(points @ waves.T + rng.uniform(0, 2 * np.pi, 6)).sum(axis=1) / 6
    rgb *= 1 + 0.10 * mottle[:, None]
    for centre, radius in EYES:
        rgb[np.linalg.norm(points - np.asarray(centre), axis=1) < radius] = (24, 22, 26)
    return np.clip(rgb, 0, 255).astype(np.uint8)


def duck_mesh(seed: int = 0) -> Mesh:
    """The coloured mesh (st.Mesh, m, object frame): about 0.2 m long, closed."""
    axes = [np.arange(low, high, GRID_M) for low, high in zip(LOW_M, HIGH_M, strict=True)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    values = field(np.stack([x, y, z], axis=-1))
    mesh = SDF(np.ascontiguousarray(values.T, np.float32), GRID_M, LOW_M).to_mesh()
    return Mesh(mesh.vertices, mesh.faces, colours(mesh.vertices, seed))


CAN_RADIUS_M, CAN_HEIGHT_M = 0.033, 0.11
WAVES = 25  # of the print


def can_mesh(around: int = 240, along: int = 160) -> Mesh:
    """A can: nothing but its print, smooth waves of colour, shows how it is turned about its axis (z)."""
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    a, z = np.meshgrid(angle, np.linspace(-0.5, 0.5, along) * CAN_HEIGHT_M)
    side = np.column_stack([CAN_RADIUS_M * np.cos(a).ravel(), CAN_RADIUS_M * np.sin(a).ravel(), z.ravel()])
    vertices = np.vstack([side, [[0, 0, -CAN_HEIGHT_M / 2], [0, 0, CAN_HEIGHT_M / 2]]])
    i, rim = np.arange(around * (along - 1)), np.arange(around)
    right, next_ = i - i % around + (i + 1) % around, (rim + 1) % around
    last = around * (along - 1)
    bottom, top = np.full(around, len(side)), np.full(around, len(side) + 1)
    corners = [
        (i, right, right + around),
        (i, right + around, i + around),
        (bottom, next_, rim),
        (top, rim + last, next_ + last),
    ]
    faces = np.vstack([np.column_stack(c) for c in corners]).astype(np.int32)
    return Mesh(vertices, faces, _print(vertices))


def _print(vertices: Array) -> NDArray[np.uint8]:
    rng = np.random.default_rng(0)
    around, along = np.arctan2(vertices[:, 1], vertices[:, 0]), vertices[:, 2]
    shown = np.zeros(vertices.shape)
    for _ in range(WAVES):
        wave = rng.integers(1, 12) * around + rng.uniform(-150, 150) * along + rng.uniform(0, 2 * np.pi)
        shown += rng.normal(size=3) * np.sin(wave)[:, None]
    return np.clip(128 + 32 * shown / shown.std(), 0, 255).astype(np.uint8)


def turning_can(n: int) -> Array:
    """(n, 4, 4) T_cam_obj of a can that turns about its own axis by 2 degrees a frame, and wanders."""
    poses = np.tile(np.eye(4), (n, 1, 1))
    for i in range(n):
        a, b = np.radians(2 * i), np.radians(100 + 6 * np.sin(i / 15))
        about = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
        tilt = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
        poses[i, :3, :3] = tilt @ about
        poses[i, :3, 3] = [0.03 * np.sin(i / 20), 0.02 * np.cos(i / 17), 0.6 + 0.03 * np.sin(i / 25)]
    return poses


# -- Objects that stand on the plane z = 0 with their origin in the middle of their foot


OBJECT_GRID_M = 0.0015
DUCK_SCALE = 0.6
OBJECT_WAVES, WAVE_PER_M = 12, 150.0  # of the print: about 4 cm long


def exercise_object(name: str) -> Mesh:
    """A closed, coloured mesh that stands on the plane z = 0 with its origin in the middle of its foot.

    Parameters
    ----------
    name : "cup" (with a handle), "ball", "box", "stick" (with a knob at one end, lying), "duck" or "can"
        Ball and can are symmetric: only their print shows how they are rotated.

    Examples
    --------
    >>> low, high = exercise_object("box").bounds
    >>> (high - low).round(2).tolist(), float(low[2].round(3))
    ([0.07, 0.05, 0.11], 0.0)
    """
    if name not in OBJECTS:
        raise ValueError(f"name: expected one of {', '.join(OBJECTS)}, got {name!r}")
    return OBJECTS[name]()


def _cup() -> Mesh:
    def distance(p: Array) -> Array:
        x, y, z = p
        r = np.hypot(x, y)
        outer, inner = _slab(r - 0.038, z, 0.0, 0.095), _slab(r - 0.032, z, 0.007, 0.2)
        # An ellipse of a round bar, whose ends are inside the wall.
        around = np.hypot((x - 0.036) / 0.8, z - 0.048) - 0.028
        handle = np.where(x > 0.033, np.hypot(around, y) - 0.006, 1.0)
        return np.maximum(np.minimum(outer, handle), -inner)

    return _meshed(distance, (-0.04, -0.04, 0.0), (0.068, 0.04, 0.097), (170, 175, 190), 1)


def _ball() -> Mesh:
    return _meshed(
        lambda p: np.sqrt(p[0] ** 2 + p[1] ** 2 + (p[2] - 0.035) ** 2) - 0.035,
        (-0.036, -0.036, 0.0), (0.036, 0.036, 0.071), (200, 70, 60), 2,
    )  # fmt: skip


def _box() -> Mesh:
    half, edge_m = np.array([0.035, 0.025, 0.055]), 0.003

    def distance(p: Array) -> Array:
        q = np.abs(p - np.array([0, 0, 0.055])[:, None, None, None]) - (half - edge_m)[:, None, None, None]
        outside = np.sqrt((np.maximum(q, 0) ** 2).sum(axis=0))
        return outside + np.minimum(q.max(axis=0), 0) - edge_m

    return _meshed(distance, (-0.036, -0.026, 0.0), (0.036, 0.026, 0.111), (90, 150, 90), 3)


def _stick() -> Mesh:
    def distance(p: Array) -> Array:
        x, y, z = p
        bar = np.sqrt(np.maximum(np.abs(x) - 0.06, 0) ** 2 + y**2 + (z - 0.018) ** 2) - 0.012
        knob = np.sqrt((x - 0.054) ** 2 + y**2 + (z - 0.018) ** 2) - 0.018
        return np.minimum(bar, knob)

    return _meshed(distance, (-0.074, -0.02, 0.0), (0.074, 0.02, 0.037), (200, 160, 70), 4)


def _duck() -> Mesh:
    mesh = duck_mesh()
    low, high = DUCK_SCALE * np.asarray(mesh.bounds)
    foot = np.array([*(0.5 * (low + high))[:2], low[2]])
    return Mesh(DUCK_SCALE * mesh.vertices - foot, mesh.faces, mesh.colors)


def _can() -> Mesh:
    mesh = can_mesh()
    return Mesh(mesh.vertices + np.array([0, 0, CAN_HEIGHT_M / 2]), mesh.faces, mesh.colors)


def _slab(radial: Array, z: Array, low: float, high: float) -> Array:
    return np.maximum(radial, np.maximum(low - z, z - high))


def _meshed(
    distance: Callable[[Array], Array],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    color: tuple[int, int, int],
    seed: int,
) -> Mesh:
    """The zero set of a field, which is negative inside, by marching cubes."""
    axes = [
        np.arange(a - 3 * OBJECT_GRID_M, b + 3 * OBJECT_GRID_M, OBJECT_GRID_M)
        for a, b in zip(low, high, strict=True)
    ]
    values = distance(np.stack(np.meshgrid(*axes, indexing="ij")))
    solid = SDF(
        np.ascontiguousarray(values.T, np.float32), OBJECT_GRID_M, [axis[0] for axis in axes]
    ).to_mesh()
    vertices = solid.vertices - [0.0, 0.0, solid.vertices[:, 2].min()]
    return Mesh(vertices, solid.faces, _waves_of_color(vertices, color, seed))


def _waves_of_color(points: Array, color: tuple[int, int, int], seed: int) -> NDArray[np.uint8]:
    """Waves of colour through space."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(OBJECT_WAVES, 3))
    directions *= (
        WAVE_PER_M * rng.uniform(0.5, 1.5, (OBJECT_WAVES, 1)) / np.linalg.norm(directions, axis=1)[:, None]
    )
    waves = np.sin(points @ directions.T + rng.uniform(0, 2 * np.pi, OBJECT_WAVES))
    shown = waves @ rng.normal(size=(OBJECT_WAVES, 3))
    return np.clip(np.array(color) + 40 * shown / shown.std(), 0, 255).astype(np.uint8)


OBJECTS: dict[str, Callable[[], Mesh]] = {
    "cup": _cup, "ball": _ball, "box": _box, "stick": _stick, "duck": _duck, "can": _can,
}  # fmt: skip
