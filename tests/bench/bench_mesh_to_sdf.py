# SPDX-License-Identifier: MIT
"""Shapes: volume from a mesh, re-distancing, rendering. Changing these numbers breaks comparisons."""

from collections.abc import Callable

import numpy as np
from harness import benchmark

import sdftrack as st

VOXELS = 200
CAMERA = st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
POSE = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.8], [0, 0, 0, 1]])


def ripple_mesh() -> st.Mesh:
    """Closed, 20,000 faces, 0.2 m: a ball with ripples, about as many triangles as a scanned object."""
    n = 100
    theta = np.linspace(0, np.pi, n + 1)[1:-1, None]
    phi = np.linspace(0, 2 * np.pi, n, endpoint=False)[None, :]
    r = 0.09 + 0.01 * np.sin(6 * theta) * np.cos(5 * phi)
    ring = np.stack([r * np.sin(theta) * np.cos(phi), r * np.sin(theta) * np.sin(phi), r * np.cos(theta)], -1)
    vertices = np.concatenate([ring.reshape(-1, 3), [[0, 0, 0.09], [0, 0, -0.09]]])
    i, j = np.meshgrid(np.arange(n - 2), np.arange(n), indexing="ij")
    a, b = (i * n + j).ravel(), (i * n + (j + 1) % n).ravel()
    c, d = a + n, b + n
    k, last = np.arange(n), (n - 2) * n
    top = np.stack([np.full(n, len(vertices) - 2), k, (k + 1) % n], 1)
    bottom = np.stack([np.full(n, len(vertices) - 1), last + (k + 1) % n, last + k], 1)
    return st.Mesh(vertices, np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1), top, bottom]))


@benchmark("sdf/from_mesh_200", items=VOXELS**3, unit="voxel")
def from_mesh() -> Callable[[], object]:
    mesh = ripple_mesh()
    return lambda: st.SDF.from_mesh(mesh, voxels=VOXELS)


@benchmark("sdf/redistanced_100", items=100**3, unit="voxel")
def redistanced() -> Callable[[], object]:
    sdf = st.SDF.from_mesh(ripple_mesh(), voxels=100)
    return sdf.redistanced


@benchmark("render/sdf_vga", items=640 * 480, unit="pixel")
def render_sdf() -> Callable[[], object]:
    sdf = st.SDF.from_mesh(ripple_mesh(), voxels=VOXELS)
    return lambda: sdf.render(CAMERA, POSE)


@benchmark("render/mesh_vga", items=640 * 480, unit="pixel")
def render_mesh() -> Callable[[], object]:
    mesh = ripple_mesh()
    return lambda: mesh.raycast(CAMERA, POSE)
