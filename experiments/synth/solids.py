# SPDX-License-Identifier: MIT
"""Solids on a table seen by a depth camera, upright, leaning, or hiding a length: exact ray intersections, no mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.geometry import pose

Array = NDArray[np.float64]
SIZES = {kind["name"]: kind["sizes"] for kind in _core.primitive_kinds()}
KINDS = tuple(kind["name"] for kind in _core.primitive_kinds() if kind["in_auto"])
EXPONENTS = (0.1, 2.0)
FAR_M = 3.0  # no measurement beyond
LOOK_DOWN_RAD = (np.radians(25), np.radians(55))  # so that the top is seen, and a side


@dataclass(frozen=True)
class SolidScene:
    """A depth image with its truth.

    Attributes
    ----------
    depth : (H, W) float32 m, without noise; 0: nothing there
    cosine : (H, W) float32
        Cosine of the angle between ray and surface normal, which determines the loss of grazing measurements.
    mask : (H, W) bool
        Pixels of the solid.
    """

    kind: str
    size: dict[str, float]
    T_cam_obj: Array
    plane: tuple[Array, float]
    depth: NDArray[np.float32]
    cosine: NDArray[np.float32]
    mask: NDArray[np.bool_]


def ray_depth(kind: str, size: dict[str, float], origin: Array, rays: Array) -> tuple[Array, Array]:
    """Where rays ``origin + t rays`` meet a solid, all in its own frame.

    Parameters
    ----------
    kind, size : see `sdftrack.fit_primitive`
    origin : (3,) float64 m
    rays : (N, 3) float64

    Returns
    -------
    t : (N,) float64
        Of the first hit, inf: none.
    normals : (N, 3) float64
    """
    solids: dict[str, Callable[[dict[str, float], Array, Array], tuple[Array, Array]]] = {
        "sphere": lambda s, o, r: _ellipsoid(np.full(3, s["radius"]), o, r),
        "ellipsoid": lambda s, o, r: _ellipsoid(np.array([s["rx"], s["ry"], s["rz"]]), o, r),
        "box": lambda s, o, r: _box(np.array([s["x"], s["y"], s["z"]]), o, r),
        "cylinder": lambda s, o, r: _tapered(s["radius"], s["radius"], s["height"], o, r),
        "cone": lambda s, o, r: _tapered(s["radius"], 0.0, s["height"], o, r),
        "superquadric": _superquadric,
        "plane": lambda s, o, r: _patch(s["width"], s["height"], o, r),
    }
    with np.errstate(divide="ignore", invalid="ignore"):
        return solids[kind](size, origin, rays)


def _ellipsoid(radii: Array, origin: Array, rays: Array) -> tuple[Array, Array]:
    o, d = origin / radii, rays / radii
    a, b, c = (d * d).sum(1), d @ o, o @ o - 1
    root = b * b - a * c
    t = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
    n = (origin + np.where(np.isfinite(t), t, 0)[:, None] * rays) / radii**2
    return t, n / np.linalg.norm(n, axis=1, keepdims=True)


def _box(edges: Array, origin: Array, rays: Array) -> tuple[Array, Array]:
    one, two = (-edges / 2 - origin) / rays, (edges / 2 - origin) / rays
    near, far = np.minimum(one, two), np.maximum(one, two)
    axis = near.argmax(axis=1)
    t = near.max(axis=1)
    n = np.zeros_like(rays)
    at = np.arange(len(rays))
    n[at, axis] = -np.sign(rays[at, axis])
    return np.where((t < far.min(axis=1)) & (t > 0), t, np.inf), n


def _superquadric(size: dict[str, float], origin: Array, rays: Array) -> tuple[Array, Array]:
    """Bisection between the camera and the ray's deepest point, which thirds find: the function is convex."""
    axes, e1, e2 = np.array([size["rx"], size["ry"], size["rz"]]), size["e1"], size["e2"]

    def norm(t: Array) -> Array:
        x, y, z = np.abs((origin + t[:, None] * rays) / axes).T
        level = (x ** (2 / e2) + y ** (2 / e2)) ** (e2 / 2)
        return np.asarray((level ** (2 / e1) + z ** (2 / e1)) ** (e1 / 2))

    near, far = (
        np.zeros(len(rays)),
        np.full(len(rays), 2 * np.linalg.norm(origin) / np.linalg.norm(rays, axis=1).min()),
    )
    for _ in range(70):
        one, two = near + (far - near) / 3, far - (far - near) / 3
        nearer = norm(one) < norm(two)
        near, far = np.where(nearer, near, one), np.where(nearer, two, far)
    hits = norm(near) < 1
    outside, inside = np.zeros(len(rays)), near
    for _ in range(50):
        middle = (outside + inside) / 2
        within = norm(middle) < 1
        outside, inside = np.where(within, outside, middle), np.where(within, middle, inside)
    p = origin + inside[:, None] * rays
    u = np.abs(p / axes)
    level = (u[:, 0] ** (2 / e2) + u[:, 1] ** (2 / e2)) ** (e2 / 2)
    across = level ** (2 / e1 - 2 / e2)
    n = (
        np.sign(p)
        / axes
        * u ** (2 / np.array([e2, e2, e1]) - 1)
        * np.column_stack([across, across, np.ones(len(p))])
    )
    return np.where(hits, inside, np.inf), n / np.linalg.norm(n, axis=1, keepdims=True)


def _patch(width: float, height: float, origin: Array, rays: Array) -> tuple[Array, Array]:
    t = -origin[2] / rays[:, 2]
    p = origin + t[:, None] * rays
    hits = (t > 0) & (np.abs(p[:, 0]) <= width / 2) & (np.abs(p[:, 1]) <= height / 2)
    n = np.zeros_like(rays)
    n[:, 2] = -np.sign(rays[:, 2])
    return np.where(hits, t, np.inf), n


def _tapered(base: float, top: float, height: float, origin: Array, rays: Array) -> tuple[Array, Array]:
    """Radius `base` at -height / 2, `top` at +height / 2: x^2 + y^2 = (m - k z)^2 between its ends."""
    k, m = (base - top) / height, (base + top) / 2
    reach, fall = m - k * origin[2], -k * rays[:, 2]
    a = rays[:, 0] ** 2 + rays[:, 1] ** 2 - fall**2
    b = rays[:, :2] @ origin[:2] - reach * fall
    c = origin[:2] @ origin[:2] - reach**2
    root = np.sqrt(b * b - a * c)
    best = np.full(len(rays), np.inf)
    normals = np.zeros_like(rays)

    def offer(t: Array, fits: NDArray[np.bool_], n: Array) -> None:
        nearer = fits & (t > 0) & (t < best)
        best[nearer] = t[nearer]
        normals[nearer] = n[nearer]

    for t in ((-b - root) / a, (-b + root) / a):
        p = origin + t[:, None] * rays
        side = np.column_stack([p[:, 0], p[:, 1], k * (m - k * p[:, 2])])
        fits = (np.abs(p[:, 2]) <= height / 2) & (m - k * p[:, 2] >= 0)
        offer(t, fits, side / np.linalg.norm(side, axis=1, keepdims=True))
    for z, radius in ((-height / 2, base), (height / 2, top)):
        t = (z - origin[2]) / rays[:, 2]
        p = origin + t[:, None] * rays
        offer(t, (p[:, :2] ** 2).sum(1) <= radius**2, np.broadcast_to([0.0, 0.0, np.sign(z)], rays.shape))
    return best, normals


def random_solid(kind: str, rng: np.random.Generator) -> dict[str, float]:
    """Sizes (m) of a solid that is 4 to 25 cm long in every direction; of a superquadric also exponents of 0.1 to 2."""
    lengths = rng.uniform(0.04, 0.25, 3)
    halved = {"radius", "rx", "ry", "rz"}
    size = {
        name: float(v / 2 if name in halved else v) for name, v in zip(SIZES[kind], lengths, strict=False)
    }
    return {**size, **{name: float(rng.uniform(*EXPONENTS)) for name in SIZES[kind] if name in ("e1", "e2")}}


def standing_scene(
    kind: str,
    size: dict[str, float],
    camera: Camera,
    rng: np.random.Generator,
    distance_m: tuple[float, float] = (0.6, 1.2),
) -> SolidScene:
    """The solid upright on a table, near the middle of the image, turned at random about the vertical."""
    down = rng.uniform(*LOOK_DOWN_RAD)
    up = np.array([0, -np.cos(down), -np.sin(down)])
    heights = {
        "sphere": 2 * size.get("radius", 0),
        "box": size.get("z", 0),
        "ellipsoid": 2 * size.get("rz", 0),
        "superquadric": 2 * size.get("rz", 0),
    }
    height = heights.get(kind, size.get("height", 0.0))
    middle = rng.uniform(*distance_m) * np.array([rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 1])
    turn = rng.uniform(0, 2 * np.pi)
    u = np.cross(up, [0, 0, 1.0])
    u /= np.linalg.norm(u)
    x = np.cos(turn) * u + np.sin(turn) * np.cross(up, u)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(up, x), up]), middle
    offset = float(-(up @ middle) + height / 2)  # of the table under it
    return rendered_scene(kind, size, T, (up, offset), camera)


def _half_diagonal(kind: str, size: dict[str, float]) -> float:
    """Radius (m) of a ball about the middle that holds a solid."""
    half = {"radius": 1.0, "rx": 1.0, "ry": 1.0, "rz": 1.0}
    return float(
        np.linalg.norm([half.get(name, 0.5) * v for name, v in size.items() if name not in ("e1", "e2")])
    )


def _near_rays(rays: Array, centre: Array, radius: float) -> NDArray[np.bool_]:
    """Rays (N, 3) from the camera that pass within `radius` of a point: the others need no look."""
    along = rays @ centre
    squares: Array = np.einsum("ni,ni->n", rays, rays)
    out: NDArray[np.bool_] = centre @ centre - along**2 / squares <= (1.001 * radius) ** 2
    return out


def rendered_scene(
    kind: str, size: dict[str, float], T: Array, plane: tuple[Array, float], camera: Camera
) -> SolidScene:
    """A shape before or on a plane ``n . p + d = 0`` (m, camera frame, n towards the camera)."""
    rays = camera.back_project(np.ones(camera.shape, np.float32)).astype(np.float64).reshape(-1, 3)
    R, t = T[:3, :3], T[:3, 3]
    near = _near_rays(rays, t, _half_diagonal(kind, size))
    z, normals = np.full(len(rays), np.inf), np.zeros_like(rays)
    z[near], normals[near] = ray_depth(kind, size, -R.T @ t, rays[near] @ R)
    n, d = plane
    with np.errstate(divide="ignore"):
        table = np.where(rays @ n < 0, -d / (rays @ n), np.inf)
    mask = z < table
    depth = np.where(mask, z, table)
    cosine = np.abs(np.where(mask, np.einsum("ni,ni->n", normals @ R.T, rays), rays @ n))
    cosine /= np.linalg.norm(rays, axis=1)
    depth = np.where(depth < FAR_M, depth, 0)
    shape = camera.shape
    return SolidScene(
        kind,
        size,
        T,
        plane,
        depth.reshape(shape).astype(np.float32),
        cosine.reshape(shape).astype(np.float32),
        mask.reshape(shape),
    )


# -- Round bodies on a table that do not stand upright


def posed_scene(
    kind: str, camera: Camera, rng: np.random.Generator, lean_deg: float, above_m: float
) -> SolidScene:
    """A random solid whose axis leans from the table's normal in a random direction, its lowest point `above_m`."""
    upright = standing_scene(kind, random_solid(kind, rng), camera, rng)
    about = rng.uniform(0, 2 * np.pi)
    turn = np.radians(lean_deg) * np.array([np.cos(about), np.sin(about), 0.0])
    T = upright.T_cam_obj @ pose(turn.tolist(), [0.0, 0.0, 0.0])
    normal, offset = upright.plane
    reach = _core.primitive_reach(
        _core.PrimitiveKind.__members__[kind], list(upright.size.values()), (-(T[:3, :3].T @ normal)).tolist()
    )[0]
    T[:3, 3] += (above_m + reach - (normal @ T[:3, 3] + offset)) * normal
    return rendered_scene(kind, upright.size, T, upright.plane, camera)


# -- Views of a solid in which one of its lengths is unobservable


WALL_M = 1.0  # behind the solid


def open_view(
    kind: str, rng: np.random.Generator, camera: Camera
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], str]:
    """A box from the front, a cylinder from its end, a cone from below, on the camera's axis.

    Returns
    -------
    depth, cosine : (H, W) float32
    mask : (H, W) bool
    hidden : str
        The unobservable length.
    """
    size = random_solid(kind, rng)
    away = rng.uniform(0.6, 1.2)
    length = size["z"] if kind == "box" else size["height"]
    # z of the solid along the view; a cone's base faces the camera.
    turn = rng.uniform(0, 2 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    t = np.array([0, 0, away + length / 2])
    rays = camera.back_project(np.ones(camera.shape, np.float32)).astype(np.float64).reshape(-1, 3)
    z, normals = ray_depth(kind, size, -R.T @ t, rays @ R)
    seen = np.isfinite(z)
    depth = np.where(seen, z, away + length + WALL_M)
    cosine = np.abs(np.where(seen, np.einsum("ni,ni->n", normals @ R.T, rays), rays[:, 2]))
    cosine /= np.linalg.norm(rays, axis=1)
    hidden = "z" if kind == "box" else "height"
    shape = camera.shape
    return (
        depth.reshape(shape).astype(np.float32),
        cosine.reshape(shape).astype(np.float32),
        seen.reshape(shape),
        hidden,
    )
