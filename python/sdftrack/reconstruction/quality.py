# SPDX-License-Identifier: MIT
"""The surface of a reconstruction as a mesh, and its expected accuracy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.array_equality import Compared
from sdftrack.mesh import Mesh

# Measured on lm_cat, lm_duck and spot, 96 and 200 voxels: true errors are 0.6 to 1.2 times those expected.
SHARED = 0.6


@dataclass(frozen=True, eq=False)
class Quality(Compared):
    """Quality of a reconstruction.

    Attributes
    ----------
    seen_share : float
        Fraction of the surface vertices that were observed (0..1); the rest is guessed.
    expected_error_m : (V,) float32
        Sd of the surface position at each vertex of ``mesh()``: 0.6 of the sensor noise, as neighbours share their
        observations, over the square root of their number, at least an eighth of a voxel; infinite where unobserved.
    frames : int
        Number of fused frames.
    summary : str
        One human-readable sentence.
    """

    seen_share: float
    expected_error_m: NDArray[np.float32]
    frames: int
    summary: str


def surface_mesh(core: Any) -> Mesh:
    """Watertight mesh of the zero set with mean observed colours; `seen` in equivalent frontal views."""
    vertices, faces, colors, seen = core.mesh()
    return Mesh(vertices, faces, colors, seen=seen)


def seen_part(mesh: Mesh, min_seen: float) -> Mesh:
    """The faces whose vertices were all observed at least this often: open where the rest is guessed."""
    assert mesh.seen is not None
    kept = mesh.faces[(mesh.seen >= min_seen)[mesh.faces].all(axis=1)]
    used, faces = np.unique(kept, return_inverse=True)
    return Mesh(
        mesh.vertices[used],
        faces.reshape(-1, 3).astype(np.int32),
        None if mesh.colors is None else mesh.colors[used],
        seen=mesh.seen[used],
    )


def quality_of(mesh: Mesh, fused: int, voxel_m: float, noise_m: float, min_seen: float) -> Quality:
    """Quality of the result of `surface_mesh`, from `fused` frames with the sensor's noise (m)."""
    assert mesh.seen is not None
    with np.errstate(divide="ignore"):  # infinite where nothing was observed
        errors = np.maximum(SHARED * noise_m / np.sqrt(mesh.seen), voxel_m / 8).astype(np.float32)
    share = float((mesh.seen >= min_seen).mean())
    rest = "" if share > 0.9 else "; turn the object further to see the rest"
    frames = f"{fused} frame{'s' * (fused != 1)}"
    text = f"{100 * share:.0f} % of the surface was observed in {frames}{rest}"
    return Quality(share, errors, fused, text)
