# SPDX-License-Identifier: MIT
"""Things on a table that touch the object: boxes and cans pushed against it from the sides and from behind."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.synth.bodies import Body
from sdftrack.synth.surroundings import Layer, box_mesh, mesh_layer

if TYPE_CHECKING:
    from sdftrack.mesh import Mesh

Array = NDArray[np.float64]
TILT_RAD = float(np.radians(40))  # of the table towards the camera
COUNT = 5
FRONT_RAD = float(np.radians(35))  # nothing stands within this angle before the object
TABLE_M, THICK_M = 0.9, 0.02
TABLE_RGB = (120, 90, 65)


class Tabletop:
    """A table under the object and things in contact with it; all of it moves with the object.

    "Up" is the direction in which a camera that looks down by 40 degrees sees it, averaged over the path: with
    a path of the camera around the object the table stays below.
    """

    def __init__(self, body: Body, poses: Array, rng: np.random.Generator) -> None:
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
        from sdftrack.mesh import Mesh

        return Mesh(self._origin + (mesh.vertices + at) @ self._R.T, mesh.faces)


def _touching(
    points: Array, angle: float, diameter: float, round_: bool, rng: np.random.Generator
) -> Mesh | None:
    """A thing on the table, moved along `angle` towards the object until it touches; table frame.

    None where the object has nothing at that height to touch.
    """
    from sdftrack.mesh import Mesh

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
    from sdftrack.mesh import Mesh

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
