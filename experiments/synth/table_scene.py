# SPDX-License-Identifier: MIT
"""Boxes on a table, with ground truth for each pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.synth.noise import Kinect
from sdftrack.synth.surroundings import box_mesh

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
# Of `table_scene`; changing these numbers breaks comparisons with tests/bench/bench_parts.py.
ABOVE_M, PITCH_RAD = 0.6, np.radians(45)
BOXES = (
    ((0.12, 0.1, 0.08), -0.15),
    ((0.1, 0.2, 0.1), 0.05),
    ((0.2, 0.05, 0.1), 0.25),
)  # size, place across, m


@dataclass(frozen=True)
class TableScene:
    """A frame, its camera, and the pixels of table and objects; `height_m` above the labelled table."""

    name: str
    frame: Any
    camera: Any
    table: Mask
    objects: Mask
    height_m: Array


def table_scene(seed: int = 0) -> TableScene:
    """Three boxes on a table 0.6 m below a camera that looks down by 45 degrees, noise of structured light.

    The boxes are 120 x 100 x 80, 100 x 200 x 100 and 200 x 50 x 100 mm. `seed`: of the noise.
    """
    camera = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
    n = np.array([0, -np.cos(PITCH_RAD), -np.sin(PITCH_RAD)])
    forward = np.array([0, n[2], -n[1]])
    rays = np.concatenate([camera.rays, np.ones((*camera.shape, 1))], axis=-1)
    along = rays @ n
    depth = np.where(along < 0, -ABOVE_M / np.minimum(along, -1e-6), 0)
    depth[depth > 3] = 0
    cosine, objects = np.clip(-along / np.linalg.norm(rays, axis=-1), 0, 1), np.zeros(depth.shape, bool)
    for size, across in BOXES:
        middle = -ABOVE_M * n + 0.4 * forward + [across, 0, 0] + 0.5 * size[1] * n
        mesh, T = box_mesh(np.array(size)), geometry.pose((PITCH_RAD, 0, 0), middle)
        seen, normals, _ = mesh.raycast(camera, T)
        near = (seen > 0) & ((seen < depth) | (depth == 0))
        depth[near], objects[near] = seen[near], True
        cosine[near] = np.abs((normals * rays).sum(-1) / np.linalg.norm(rays, axis=-1))[near]
    noisy = Kinect()(depth.astype(np.float32), cosine.astype(np.float32), np.random.default_rng(seed))
    height = (depth[..., None] * rays) @ n + ABOVE_M
    read = noisy > 0
    frame = Frame(noisy, check_units=False)
    return TableScene("boxes", frame, camera, read & ~objects, read & objects, height)
