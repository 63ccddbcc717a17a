# SPDX-License-Identifier: MIT
"""A small body without symmetry, turned before a camera, and what is measured of its reconstruction."""

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from sdftrack import geometry

CAMERA = st.Camera(400.0, 400.0, 159.5, 119.5, 320, 240)
FAR_M = 0.5


@functools.cache
def body() -> st.SDF:
    """A rounded body, about 10 cm long, of a box, a ball and a rod."""
    ball = st.SDF.sphere(0.032, voxels=64).transformed(geometry.pose((0, 0, 0), (0.035, 0.0, 0.01)))
    rod = st.SDF.cylinder(0.014, 0.10, voxels=64).transformed(geometry.pose((0.9, 0, 0), (-0.02, 0.02, 0.01)))
    return st.smooth_union(st.SDF.box((0.08, 0.05, 0.04), voxels=64), ball, rod, radius=0.01)


def turning(n: int, degrees: float, axis: tuple[float, float, float] = (0.2, 1, 0.1)) -> NDArray[np.float64]:
    """(n, 4, 4) poses of a body that turns about an axis, `degrees` in all."""
    unit = np.array(axis) / np.linalg.norm(axis)
    angles = np.radians(degrees) * np.arange(n) / max(1, n - 1)
    return np.array([geometry.pose(a * unit, (0.01 * np.sin(a), 0.0, FAR_M)) for a in angles])


@functools.cache
def sequence(n: int = 36, degrees: float = 108.0, noise: float = 0.001, occluder: Any = None) -> Any:
    return st.synth.sequence(
        body(), n, turning(n, degrees), noise, occluder=occluder, seed=4, camera=CAMERA, clutter="wall",
        threads=1,
    )  # fmt: skip


def first_mask(seq: Any) -> NDArray[np.bool_]:
    mask: NDArray[np.bool_] = seq.masks(0)[0]
    return mask


def begun(frames: int, seq: Any = None, **options: Any) -> tuple[st.Reconstructor, list[Any]]:
    """A reconstructor that has seen the first frames of a sequence, and its results."""
    seq = sequence() if seq is None else seq
    star = st.Reconstructor(seq.camera, **{"voxels": 64, "threads": 1, **options})
    results = [star.start(seq[0], mask=first_mask(seq))]
    return star, results + [star.track(seq[i]) for i in range(1, frames)]


def poses_of(results: list[Any]) -> dict[int, NDArray[np.float64]]:
    return {i: result.pose for i, result in enumerate(results)}


def to_truth(seq: Any, first: NDArray[np.float64]) -> NDArray[np.float64]:
    """Maps the true object frame to the reconstruction's: its pose in frame 0 is `first`."""
    aligned: NDArray[np.float64] = np.linalg.solve(first, seq.ground_truth[0][0])
    return aligned


def pose_errors(seq: Any, poses: dict[int, NDArray[np.float64]]) -> NDArray[np.float64]:
    """(n, 2) metres and radians against the truth, relative to frame 0."""
    X = to_truth(seq, poses[0])
    return np.array([st.metrics.pose_error(T @ X, seq.ground_truth[i][0]) for i, T in poses.items()])


def surface_error(
    seq: Any, star: st.Reconstructor, first: NDArray[np.float64], least: float
) -> NDArray[np.float64]:
    """Distances (m) of the vertices that were seen from the true surface."""
    mesh = star.mesh()
    assert mesh.seen is not None
    X = np.linalg.inv(to_truth(seq, first))
    vertices = mesh.vertices[mesh.seen >= least] @ X[:3, :3].T + X[:3, 3]
    return np.abs(body()(vertices))
