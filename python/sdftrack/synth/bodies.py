# SPDX-License-Identifier: MIT
"""Shapes and their scene as the renderer and the occluders ask for them: layers, colours, points of the surface."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.io.datasets.sequence import LazyModels
from sdftrack.mesh import Mesh
from sdftrack.synth.surroundings import Layer

SKIN = (205, 155, 130)


@dataclass(frozen=True)
class Stage:
    """The first object, its poses (n, 4, 4) T_cam_obj, the camera, the seed and the frames per second."""

    body: Body
    poses: NDArray[np.float64]
    camera: Camera
    seed: int
    fps: float


class Occluder(Protocol):
    """Something in front of the first object.

    `ready` is called once and returns a function (frame, visible, depth) -> layer, with the (H, W) pixels in
    which the object would be seen and the depth image without the occluder. The layer of a frame depends on
    nothing but these and the frame's number: frames are rendered in any order.
    """

    def ready(self, stage: Stage) -> Callable[[int, NDArray[np.bool_], NDArray[np.float32]], Layer | Any]: ...


Array = NDArray[np.float64]
SPACING_M = 0.0025  # of the surface points: hulls of them are right to 0.03 mm on a curve of 30 mm


class Body:
    """A shape with what the renderer asks of it."""

    def __init__(self, shape: Any, k: int, seed: int) -> None:
        if isinstance(shape, str | os.PathLike):
            shape = Mesh.load(shape)
        if not (hasattr(shape, "raycast") or hasattr(shape, "render")):
            raise TypeError(f"shape_or_mesh: expected SDF, Mesh or a path, got {type(shape).__name__}")
        self.shape = shape
        low, high = shape.bounds if hasattr(shape, "raycast") else _inside_bounds(shape)
        self.centre: Array = 0.5 * (np.asarray(low) + np.asarray(high))
        self.diameter = float(np.linalg.norm(np.asarray(high) - low))
        rng = np.random.default_rng([seed, 7, k])
        self._waves = rng.normal(size=(3, 3)) * 14 / self.diameter
        self._phase = rng.uniform(0, 2 * np.pi, 3)
        self._palette = rng.integers(30, 240, (3, 3)).astype(float)

    def layer(self, camera: Camera, T: Array, color: bool, threads: int) -> Layer:
        """The body alone, at the pose T_cam_obj."""
        colors = None
        if hasattr(self.shape, "raycast"):
            depth, normals, colors = self.shape.raycast(camera, T, threads=threads)
        else:
            depth, normals = self.shape.render(camera, T)
        if not color:
            return Layer.of(camera, depth, normals, None)
        if colors is not None:
            known = colors
            return Layer.of(camera, depth, normals, lambda window: known[window])
        return Layer.of(camera, depth, normals, lambda window: self._texture(camera, depth, window, T))

    @cached_property
    def points(self) -> Array:
        """(N, 3) points of the surface, object frame, m: vertices, points of long edges, random ones of faces."""
        mesh = self.shape if hasattr(self.shape, "raycast") else self.shape.to_mesh()
        corners = mesh.vertices[mesh.faces]
        area = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        rng = np.random.default_rng(0)
        count = min(200_000, int(area.sum() / SPACING_M**2))
        face = rng.choice(len(corners), count, p=area / area.sum())
        a, b = rng.random((2, count, 1))
        over = a + b > 1
        a, b = np.where(over, 1 - a, a), np.where(over, 1 - b, b)
        inner = corners[face, 0] * (1 - a - b) + corners[face, 1] * a + corners[face, 2] * b
        return np.concatenate([mesh.vertices, _edge_points(corners), inner])

    def palette(self, rng: np.random.Generator, count: int) -> Array:
        """(count, 3) colours of random places on the surface."""
        known = self.shape.colors if hasattr(self.shape, "raycast") else None
        if known is not None:
            return np.asarray(known[rng.integers(0, len(known), count)], np.float64)
        places = self.points[rng.integers(0, len(self.points), count)]
        return self._solid(places - self.centre)

    def _solid(self, p_obj: Array) -> Array:
        weight = np.exp(2 * np.sin(p_obj @ self._waves.T + self._phase))
        return weight @ self._palette / weight.sum(axis=1, keepdims=True)

    def _texture(
        self, camera: Camera, depth: NDArray[np.float32], window: tuple[slice, slice], T: Array
    ) -> NDArray[np.uint8]:
        """A solid texture: a smooth function of the point in the object's frame, the same from all sides."""
        near = depth[window]
        colors = np.zeros((*near.shape, 3), np.uint8)
        seen = near > 0
        z = near[seen].astype(float)[:, None]
        points = np.concatenate([camera.rays[window][seen] * z, z], axis=1)
        colors[seen] = self._solid((points - T[:3, 3]) @ T[:3, :3] - self.centre)
        return colors


class Models(LazyModels):
    """{obj_id: Mesh}; the mesh of a signed distance function is made at first use."""

    def __init__(self, bodies: list[Body]) -> None:
        super().__init__({1 + i: body.shape for i, body in enumerate(bodies)}, "m")

    def _load(self, shape: Any) -> Any:
        return shape if hasattr(shape, "raycast") else shape.to_mesh()


def _edge_points(corners: Array) -> Array:
    """Points `SPACING_M` apart on the edges of triangles (F, 3, 3): what sticks out of a body is an edge."""
    a, b = corners.reshape(-1, 3), corners[:, [1, 2, 0]].reshape(-1, 3)
    count = np.linalg.norm(b - a, axis=1) // SPACING_M
    edge = np.repeat(np.arange(len(a)), count.astype(np.intp))
    within = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count.astype(np.intp))
    share = ((within + 1) / (count[edge] + 1))[:, None]
    return a[edge] * (1 - share) + b[edge] * share


def _inside_bounds(sdf: Any) -> tuple[Array, Array]:
    """Box around the voxels inside the surface, object frame, m."""
    inside = np.argwhere(np.asarray(sdf.values) <= 0)[:, ::-1]
    if not len(inside):
        raise ValueError("shape_or_mesh: the signed distance function has no inside")
    origin = np.asarray(sdf.origin)
    return origin + sdf.voxel_size * inside.min(0), origin + sdf.voxel_size * inside.max(0)
