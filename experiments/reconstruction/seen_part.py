# SPDX-License-Identifier: MIT
"""How near a reconstruction is to the truth, on that part of the truth which the frames have shown.

What counts as shown depends on the true shape and the true poses alone, so that no reconstruction can choose what it
is judged by.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera

Array = NDArray[np.float64]
LARGEST_INCIDENCE_RAD = np.deg2rad(75.0)
SAMPLES = 100_000
COMPLETE_M = 0.003
GUESSED_M = 0.005
DEPTH_MARGIN_M = 2e-4


def sampled(mesh: Any, count: int = SAMPLES, seed: int = 0) -> tuple[Array, Array]:
    """Points spread evenly over a mesh, and its outward normals there: (N, 3) and (N, 3)."""
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    rng = np.random.default_rng(seed)
    at = (np.arange(count) + rng.random(count)) / count * area.sum()
    face = np.minimum(np.searchsorted(np.cumsum(area), at), len(area) - 1)
    r, s = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    a, b, c = np.moveaxis(corners[face], 1, 0)
    return (1 - r) * a + r * ((1 - s) * b + s * c), cross[face] / area[face, None]


def first_seen(mesh: Any, points: Array, normals: Array, camera: Any, poses: Array, every: int = 5) -> Any:
    """Frame that first shows each point, len(poses) where none does: (N,) int.

    A frame shows a point that it looks at less than 75 degrees askew and that nothing of the object hides. Only each
    `every`-th frame is looked at.
    """
    out, camera = np.full(len(points), len(poses)), depth_camera(camera)
    for i in range(0, len(poses), every):
        at = points @ poses[i, :3, :3].T + poses[i, :3, 3]
        range_m = np.linalg.norm(at, axis=1)
        cosine = -np.einsum("ij,ij->i", at, normals @ poses[i, :3, :3].T) / range_m
        open_to = np.flatnonzero((cosine > np.cos(LARGEST_INCIDENCE_RAD)) & (at[:, 2] > 0) & (out > i))
        p, cosine = at[open_to], cosine[open_to]
        u = np.rint(camera.fx * p[:, 0] / p[:, 2] + camera.cx).astype(int)
        v = np.rint(camera.fy * p[:, 1] / p[:, 2] + camera.cy).astype(int)
        inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
        open_to, p, cosine, u, v = (x[inside] for x in (open_to, p, cosine, u, v))
        depth = mesh.raycast(camera, poses[i])[0]
        # Half a pixel aside, the nearest pixel's ray meets a slanted surface at another depth.
        slack = DEPTH_MARGIN_M + 0.71 * p[:, 2] / camera.fx * np.sqrt(1 - cosine**2) / cosine
        shown = (depth[v, u] > 0) & (p[:, 2] < depth[v, u] + slack)
        out[open_to[shown]] = i
    return out


@dataclass(frozen=True)
class Truth:
    """A true shape, points on it, and when each was first shown. Object frame, m."""

    sdf: Any
    camera: Any
    poses: Array
    points: Array
    seen_from: NDArray[np.int64]

    @classmethod
    def of(cls, mesh: Any, sdf: Any, camera: Any, poses: Array, count: int = SAMPLES) -> Truth:
        """Sample a mesh and look at it along its path; `sdf` is its volume."""
        points, normals = sampled(mesh, count)
        return cls(sdf, camera, poses, points, first_seen(mesh, points, normals, camera, poses))

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Which of the points were shown at all."""
        return self.seen_from < len(self.poses)


@dataclass(frozen=True)
class Compared:
    """Mean distances (m) of the seen part, and shares of the truth that lie near the reconstruction."""

    to_truth_m: float
    to_rebuilt_m: float
    offset_m: float  # signed mean of to_truth: positive where the reconstruction is too large
    complete: float  # of the seen part, within 3 mm
    guessed: float  # of the part that no frame shows, within 5 mm; NaN: all is shown
    seen_share: float

    @property
    def chamfer_m(self) -> float:
        return 0.5 * (self.to_truth_m + self.to_rebuilt_m)


def compare(rebuilt: Any, truth: Truth, voxels: int = 200) -> Compared:
    """Distances between a mesh in the truth's frame and the truth, of what the frames show of each.

    Distances are to the surfaces, not between samples of them, which would add their spacing. Of the mesh that part
    is judged which the true views would show of it; what closes it where nobody has looked counts in `guessed` alone.
    """
    import sdftrack as st

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # thin parts: what is thinner than a voxel is not judged here
        field = st.SDF.from_mesh(rebuilt, voxels=voxels, holes="close", unit="m")
    points, normals = sampled(rebuilt, len(truth.points), seed=1)
    shown = first_seen(rebuilt, points, normals, truth.camera, truth.poses) < len(truth.poses)
    signed = truth.sdf(points[shown])
    off = np.abs(field(truth.points))
    missing, unseen = off[truth.seen], off[~truth.seen]
    return Compared(
        float(np.abs(signed).mean()),
        float(missing.mean()),
        float(signed.mean()),
        float((missing < COMPLETE_M).mean()),
        float((unseen < GUESSED_M).mean()) if len(unseen) else float("nan"),
        float(truth.seen.mean()),
    )
