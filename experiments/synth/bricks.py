# SPDX-License-Identifier: MIT
"""Five toy bricks of different shape and one colour (Figure 5.13): one is carried by a hand before the others."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from sdftrack import geometry
from sdftrack.synth.grip import Grip
from sdftrack.synth.surroundings import Table

Array = NDArray[np.float64]
Box = tuple[tuple[float, float, float], tuple[float, float, float]]  # edges and centre, mm
BRICKS: tuple[tuple[Box, ...], ...] = (
    (((64, 32, 32), (0, 0, -16)), ((32, 32, 32), (-16, 0, 16))),
    (((96, 32, 24), (0, 0, -12)), ((32, 32, 24), (0, 0, 12))),
    (((64, 32, 32), (0, 0, 0)),),
    (((48, 48, 48), (0, 0, 0)),),
    (((80, 32, 20), (0, 0, 16)), ((20, 32, 32), (-30, 0, -10)), ((20, 32, 32), (30, 0, -10))),
)
VOXEL_M, MARGIN_M = 0.001, 0.012
RGB = (200, 60, 50)
EYE_M, LOOK_AT_M = (0.0, -0.62, 0.48), (0.0, 0.0, 0.03)  # on the table z = 0
APART_M, BEHIND_M = 0.11, 0.06  # of the four that stand on the table
SWING_M, PERIOD, HIGH_M, NEAR_M = 0.25, 300, 0.13, -0.10  # of the carried one, in frames across the view
HIDDEN = 0.4  # of it, by the fingers
NOISE_M = 0.001


def brick(boxes: tuple[Box, ...]) -> Any:
    """The SDF of some boxes together."""
    sizes, centres = (1e-3 * np.array([box[k] for box in boxes]) for k in range(2))
    low = (centres - sizes / 2).min(axis=0) - MARGIN_M
    count = np.ceil(((centres + sizes / 2).max(axis=0) + MARGIN_M - low) / VOXEL_M).astype(int) + 1
    axes = [low[k] + VOXEL_M * np.arange(count[k]) for k in range(3)]
    p = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).transpose(2, 1, 0, 3)
    field = np.full(p.shape[:3], np.inf)
    for size, centre in zip(sizes, centres, strict=True):
        q = np.abs(p - centre) - size / 2
        box = np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0)
        field = np.minimum(field, box)
    return st.SDF(field.astype(np.float32), VOXEL_M, origin=low)


def handled(shapes: list[Any], frames: int, threads: int = 0) -> Any:
    """A sequence in which a hand carries the first brick back and forth before the others, of which two turn.

    Depth with 1 mm of noise, and colour. No two bricks touch.
    """
    meshes = []
    for shape in shapes:
        mesh = shape.to_mesh()
        meshes.append(
            st.Mesh(mesh.vertices, mesh.faces, np.tile(np.array(RGB, np.uint8), (len(mesh.vertices), 1)))
        )
    T_cam_table = geometry.look_at(np.array(EYE_M), np.array(LOOK_AT_M))
    poses = np.empty((frames, len(meshes), 4, 4))
    for i in range(frames):
        a = 2 * np.pi * i / PERIOD
        carried = geometry.pose((0.15 * np.sin(2 * a), 0.2 * np.sin(3 * a), 1.0 * np.sin(a)))
        carried[:3, 3] = [-SWING_M * np.cos(a), NEAR_M + 0.01 * np.sin(2 * a), HIGH_M + 0.01 * np.sin(3 * a)]
        poses[i, 0] = carried
        for k, mesh in enumerate(meshes[1:]):
            turn = np.deg2rad(35) * np.sin(a + k) * (k % 2) + 0.3 * k
            place = (APART_M * (k - 1.5), BEHIND_M, -float(mesh.bounds[0, 2]))
            poses[i, 1 + k] = geometry.pose((0, 0, turn), place)
    normal = T_cam_table[:3, 2]
    table = Table(tuple(normal), -float(normal @ T_cam_table[:3, 3]))
    return st.synth.sequence(
        meshes, frames, T_cam_table @ poses, NOISE_M, Grip(HIDDEN), clutter=table, threads=threads
    )
