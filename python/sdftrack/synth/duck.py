# SPDX-License-Identifier: MIT
"""A bath duck with a cap: the built-in shape of the figures and the demo, made of smoothly united ellipsoids.

It has no symmetry (the cap is tilted, one wing is raised) and both broad and thin parts.
"""

from __future__ import annotations

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
