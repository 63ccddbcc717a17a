# SPDX-License-Identifier: MIT
"""What is in the picture beside the object: a wall, a table, things behind it, and a hand before it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack.camera import Camera
from sdftrack.mesh import Mesh

Array = NDArray[np.float64]
TABLE_RGB = (120, 90, 65)
CLUTTER = ("wall", "table", "objects", "touching")


@dataclass(frozen=True)
class Table:
    """A table at a known place: the plane ``normal . p + d_m = 0``, camera frame, unit normal towards the camera."""

    normal: tuple[float, float, float]
    d_m: float


@dataclass
class Layer:
    """Depth (m, 0 = nothing), cosine of the incidence and colour of one thing, in a window of the image."""

    depth: NDArray[np.float32]
    cosine: NDArray[np.float32]
    color: NDArray[np.uint8]
    top: int = 0
    left: int = 0

    def put(self, other: Layer) -> tuple[tuple[slice, slice], NDArray[np.bool_]]:
        """Draw `other` where it is nearer; returns its window and where in it."""
        h, w = other.depth.shape
        window = (slice(other.top, other.top + h), slice(other.left, other.left + w))
        under = self.depth[window]
        nearer = (other.depth > 0) & ((under == 0) | (other.depth < under))
        under[nearer] = other.depth[nearer]
        self.cosine[window][nearer] = other.cosine[nearer]
        self.color[window][nearer] = other.color[nearer]
        return window, nearer

    def copy(self) -> Layer:
        return Layer(self.depth.copy(), self.cosine.copy(), self.color.copy())

    @classmethod
    def empty(cls, camera: Camera) -> Layer:
        shape = camera.shape
        return cls(np.zeros(shape, np.float32), np.ones(shape, np.float32), np.zeros((*shape, 3), np.uint8))

    @classmethod
    def of(
        cls,
        camera: Camera,
        depth: NDArray[np.float32],
        normals: NDArray[np.float32],
        colors: Callable[[tuple[slice, slice]], NDArray[np.uint8]] | None,
    ) -> Layer:
        """The window where there is depth, lit by a lamp at the camera (up to 40 % darker where it turns away)."""
        rows, columns = np.flatnonzero(depth.any(axis=1)), np.flatnonzero(depth.any(axis=0))
        if not len(rows):
            return cls(depth[:0, :0], depth[:0, :0], np.zeros((0, 0, 3), np.uint8))
        window = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        n, (x, y) = normals[window], np.moveaxis(camera.rays[window], -1, 0)
        along = -(n[..., 0] * x + n[..., 1] * y + n[..., 2]) / np.sqrt(x * x + y * y + 1)
        cosine = np.where(n.any(axis=-1), np.clip(along, 0, 1), 1).astype(np.float32)
        color = np.zeros((*cosine.shape, 3), np.uint8)
        if colors is not None:
            color = (colors(window) * (0.6 + 0.4 * cosine[..., None])).astype(np.uint8)
        return cls(depth[window], cosine, color, int(rows[0]), int(columns[0]))


def background(
    camera: Camera, kind: str | Table | None, distance_m: float, rng: np.random.Generator
) -> Layer:
    """The still part of the scene, all of it (but a `Table`) farther than the object at `distance_m` gets."""
    scene = Layer.empty(camera)
    if kind is None:
        return scene
    if not (isinstance(kind, Table) or kind in CLUTTER):
        raise ValueError(f"clutter: expected None or one of {', '.join(CLUTTER)}, got {kind!r}")
    back = distance_m + 0.5
    scene.put(plane_layer(camera, np.array([0.1, 0.0, -1.0]), np.array([0, 0, back]), (150, 155, 160), rng))
    if kind == "wall":
        return scene
    if isinstance(kind, Table):
        normal = np.array(kind.normal)
        scene.put(plane_layer(camera, normal, -kind.d_m * normal, TABLE_RGB, rng))
        return scene
    scene.put(
        plane_layer(camera, np.array([0.0, -1.0, -0.25]), np.array([0, 0.3, distance_m]), TABLE_RGB, rng)
    )
    if kind == "objects":
        for i in range(10):
            at = np.array(
                [rng.uniform(-0.5, 0.5), rng.uniform(-0.3, 0.25), distance_m + rng.uniform(0.27, 0.45)]
            )
            color = tuple(int(c) for c in rng.integers(40, 230, 3))
            size = rng.uniform(0.05, 0.12, 3)
            vertices, faces = _sphere_grid()
            mesh = Mesh(vertices * (0.6 * size), faces) if i % 2 else box_mesh(size)
            scene.put(mesh_layer(mesh, camera, geometry.pose(rng.normal(size=3), at), color))
    return scene


def mesh_layer(mesh: Mesh, camera: Camera, T: Array, color: tuple[int, ...]) -> Layer:
    """A mesh of one colour."""
    depth, normals, _ = mesh.raycast(camera, T)
    return Layer.of(camera, depth, normals, lambda window: np.array(color, np.uint8))


def plane_layer(
    camera: Camera, normal: Array, point: Array, color: tuple[int, ...], rng: np.random.Generator
) -> Layer:
    """A plane through a point (m, camera frame), seen from the side that its normal points to, up to 6 m away."""
    layer = Layer.empty(camera)
    n = normal / np.linalg.norm(normal)
    x, y = camera.rays[..., 0].astype(float), camera.rays[..., 1].astype(float)
    along = n[0] * x + n[1] * y + n[2]
    with np.errstate(divide="ignore"):
        z = np.where(along < -1e-6, (n @ point) / along, 0)
    z[(z < 0) | (z > 6)] = 0
    layer.depth[:] = z
    layer.cosine[:] = np.clip(-along / np.sqrt(x * x + y * y + 1), 0, 1)
    # Broad stripes and a grain, fixed to the plane.
    p = np.stack([x * z, y * z, z], axis=-1) @ rng.normal(size=(3, 2)) * 15
    tone = 1 + 0.12 * np.sin(p[..., 0]) * np.sin(p[..., 1]) + 0.02 * rng.standard_normal(z.shape)
    layer.color[:] = np.clip(np.array(color) * tone[..., None], 0, 255)
    return layer


def hand_mesh(scale_m: float) -> Mesh:
    """A palm, four fingers, a thumb and a forearm that points along +y; `scale_m` long without the forearm."""
    # Origin at the tips of the fingers' middle, fingers towards -y, palm facing +z.
    parts: list[tuple[tuple[float, ...], tuple[float, ...], float]] = [
        ((-0.14, 0.62, 0), (-0.14, 0.85, 0), 0.17),
        ((0.14, 0.62, 0), (0.14, 0.85, 0), 0.17),
    ]
    for x, tip in ((-0.22, 0.1), (-0.075, 0.0), (0.075, 0.02), (0.21, 0.14)):
        parts.append(((x, 0.55, 0), (1.15 * x, 0.07 + tip, 0.05), 0.075))
    parts.append(((-0.26, 0.8, 0), (-0.5, 0.48, 0.05), 0.085))
    parts.append(((0, 0.95, 0), (0, 2.6, -0.1), 0.19))
    meshes = [_capsule(scale_m * np.array(a), scale_m * np.array(b), scale_m * r) for a, b, r in parts]
    first = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    faces = np.concatenate([m.faces + n for m, n in zip(meshes, first, strict=True)])
    return Mesh(np.concatenate([m.vertices for m in meshes]), faces)


def _sphere_grid(rows: int = 12, columns: int = 20) -> tuple[Array, NDArray[np.int32]]:
    """Unit sphere with poles on z; the middle row of vertices stands twice, so that it can be pulled apart."""
    half = np.linspace(0, np.pi / 2, rows // 2 + 1)
    polar = np.concatenate([half, np.pi - half[::-1]])
    around = 2 * np.pi * np.arange(columns) / columns
    p, a = np.meshgrid(polar, around, indexing="ij")
    v = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(len(polar) - 1), np.arange(columns), indexing="ij")
    k, right = i * columns + j, i * columns + (j + 1) % columns
    quads = np.stack([k, k + columns, right + columns, right], axis=-1).reshape(-1, 4)
    return v, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)


def _capsule(a: Array, b: Array, radius: float) -> Mesh:
    v, f = _sphere_grid()
    z = (b - a) / np.linalg.norm(b - a)
    x = np.cross(z, [1.0, 0, 0] if abs(z[0]) < 0.9 else [0.0, 1, 0])
    x /= np.linalg.norm(x)
    upper = np.arange(len(v)) < len(v) // 2
    p = radius * v @ np.stack([x, np.cross(z, x), z]) + np.where(upper[:, None], b, a)
    return Mesh(p, f)


def box_mesh(size: Array) -> Mesh:
    corners = 0.5 * size * np.array([[x, y, z] for x in (-1.0, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Mesh(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


# -- A table under the object, and boxes and cans on it that are pushed against the object


TILT_RAD = float(np.radians(40))  # of the table towards the camera
COUNT = 5
FRONT_RAD = float(np.radians(35))  # nothing stands within this angle before the object
TABLE_M, THICK_M = 0.9, 0.02


class Tabletop:
    """A table under the object and things in contact with it; all of it moves with the object."""

    # "Up" is the direction in which a camera that looks down by 40 degrees sees it, averaged over the path: with a path
    # of the camera around the object the table stays below.

    def __init__(self, body: Any, poses: Array, rng: np.random.Generator) -> None:
        up_cam = np.array([0, -np.cos(TILT_RAD), -np.sin(TILT_RAD)])
        up = np.einsum("nji,j->ni", poses[:, :3, :3], up_cam)
        mean = up.mean(axis=0)
        mean = mean if np.linalg.norm(mean) > 0.2 else up[0]
        z = mean / np.linalg.norm(mean)
        toward = poses[0, :3, :3].T @ np.array([0, 0, -1.0])  # to the first camera, across the table
        x = toward - (toward @ z) * z
        x /= np.linalg.norm(x)
        self._R = np.column_stack([x, np.cross(z, x), z])  # table frame to object frame
        points = (body.points - body.centre) @ self._R
        self._origin = body.centre + points[:, 2].min() * z
        points[:, 2] -= points[:, 2].min()
        table = box_mesh(np.array([TABLE_M, TABLE_M, THICK_M]))
        self._things = [(self._placed(table, np.array([0, 0, -THICK_M / 2])), TABLE_RGB)]
        step = (2 * np.pi - 2 * FRONT_RAD) / COUNT
        for i in range(COUNT):
            angle = FRONT_RAD + (i + rng.uniform(0.2, 0.8)) * step
            thing = _touching(points, angle, body.diameter, round_=bool(i % 2), rng=rng)
            r, g, b = (int(c) for c in rng.integers(40, 230, 3))
            if thing is not None:
                self._things.append((self._placed(thing, np.zeros(3)), (r, g, b)))

    @property
    def things(self) -> list[Mesh]:
        """The table and what stands on it, object frame, m."""
        return [mesh for mesh, _ in self._things]

    def layers(self, camera: Camera, T_cam_obj: Array) -> list[Layer]:
        """One picture of each thing."""
        return [mesh_layer(mesh, camera, T_cam_obj, color) for mesh, color in self._things]

    def _placed(self, mesh: Mesh, at: Array) -> Mesh:
        return Mesh(self._origin + (mesh.vertices + at) @ self._R.T, mesh.faces)


def _touching(
    points: Array, angle: float, diameter: float, round_: bool, rng: np.random.Generator
) -> Mesh | None:
    """A thing on the table, moved along `angle` towards the object until it touches; table frame."""
    # None where the object has nothing at that height to touch.
    height, half = rng.uniform(0.3, 0.8) * diameter, rng.uniform(0.12, 0.25) * diameter
    away, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    aside = rng.uniform(-0.1, 0.1) * diameter
    low = points[points[:, 2] < height, :2]
    side = low @ across - aside
    beside = np.abs(side) < half
    if not beside.any():
        return None
    # How far the thing's middle may come: its face (half) or its round wall stops at the first point.
    wall = np.sqrt(half**2 - side[beside] ** 2) if round_ else half
    distance = float(np.max(low[beside] @ away + wall))
    middle = np.array([*(distance * away + aside * across), height / 2])
    if round_:
        return _cylinder(half, height, middle)
    box = box_mesh(np.array([2 * half, 2 * half, height]))
    turn = np.array([[*away, 0], [*across, 0], [0, 0, 1.0]])
    return Mesh(box.vertices @ turn + middle, box.faces)


def _cylinder(radius: float, height: float, middle: Array) -> Mesh:
    n = 64
    a = 2 * np.pi * np.arange(n) / n
    ring = radius * np.column_stack([np.cos(a), np.sin(a)])
    z = np.full((n, 1), height / 2)
    v = np.concatenate(
        [np.hstack([ring, -z]), np.hstack([ring, z]), [[0, 0, -height / 2], [0, 0, height / 2]]]
    )
    i, j = np.arange(n), (np.arange(n) + 1) % n
    wall = np.concatenate([np.stack([i, j, n + j], axis=1), np.stack([i, n + j, n + i], axis=1)])
    caps = [
        np.stack([j, i, np.full(n, 2 * n)], axis=1),
        np.stack([n + i, n + j, np.full(n, 2 * n + 1)], axis=1),
    ]
    return Mesh(v + middle, np.concatenate([wall, *caps]))
