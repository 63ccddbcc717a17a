# SPDX-License-Identifier: MIT
"""The fixed synthetic set-up of the accuracy tables: camera, motion, noise-free depth and the bound.

Changing a number in this file breaks comparisons with every figure that was printed with it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.bound import MAX_INCIDENCE_RAD, expected_length, pose_information
from sdftrack._internal.files import replacing

Array = NDArray[np.float64]
DISTANCE_M = 0.8
SPREAD_M = np.array([0.10, 0.07, 0.06])  # the path stays this near to its middle: always in view


def default_camera() -> Any:
    """640x480, 525 px, the nominal Kinect."""
    from sdftrack.camera import Camera

    return Camera(525.0, 525.0, 319.5, 239.5, 640, 480)


def motion(frames: int, step_m: float, step_rad: float, seed: int, centre: Array | None = None) -> Array:
    """Poses ``T_cam_obj`` (frames, 4, 4) that advance by exactly `step_m` and `step_rad` each frame.

    The object's `centre` (object frame, m) follows a smooth closed curve about (0, 0, 0.8 m) while the object
    turns about a slowly precessing axis from a random first orientation.
    """
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0, 2 * np.pi, 3)
    fine = np.linspace(0, 2 * np.pi, 20001)
    curve = SPREAD_M * np.column_stack(
        [np.sin(fine + phase[0]), np.sin(2 * fine + phase[1]), np.sin(3 * fine + phase[2])]
    )
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    s = (step_m * np.arange(frames)) % at[-1]
    path = np.column_stack([np.interp(s, at, curve[:, k]) for k in range(3)])
    path[:, 2] += DISTANCE_M
    R = _random_rotation(rng)
    spin = rng.uniform(0, 2 * np.pi)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    for i in range(frames):
        if i:
            a = spin + 2 * np.pi * i * step_rad / 9.0
            axis = np.array([np.cos(a) * 0.8, np.sin(0.7 * a), 0.6 * np.cos(1.3 * a + 1.0)])
            R = _exp(step_rad * axis / np.linalg.norm(axis)) @ R
        poses[i, :3, :3] = R
        poses[i, :3, 3] = path[i] - (0.0 if centre is None else R @ centre)
    return poses


def _exp(w: Array) -> Array:
    angle = float(np.linalg.norm(w))
    if angle < 1e-12:
        return np.eye(3)
    k = w / angle
    K = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


def _random_rotation(rng: np.random.Generator) -> Array:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


@dataclass(frozen=True)
class Truth:
    """Noise-free depth of N frames (cropped to the object) with the poses and the bound.

    Attributes
    ----------
    poses : (N, 4, 4) float64, T_cam_obj
    boxes : list of (top, left)
        Where each crop sits in the image.
    crops : list of float32 m, 0 where the object is not seen
    bound_m, bound_rad : (N,) float64
        Expected error lengths at a noise of ONE metre: times sigma.
    pixels : (N,) int64
    """

    camera: Any
    poses: Array
    boxes: list[tuple[int, int]]
    crops: list[NDArray[np.float32]]
    bound_m: Array
    bound_rad: Array
    pixels: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.poses)

    def depth(self, i: int) -> NDArray[np.float32]:
        """Full image of frame i, float32 m."""
        image = np.zeros((self.camera.height, self.camera.width), np.float32)
        (top, left), crop = self.boxes[i], self.crops[i]
        image[top : top + crop.shape[0], left : left + crop.shape[1]] = crop
        return image


def noisy(depth: NDArray[np.float32], sigma_m: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """Add zero-mean Gaussian noise to every valid measurement (Eq. 3.21)."""
    out = depth.copy()
    seen = out > 0
    if sigma_m > 0:
        out[seen] += (sigma_m * rng.standard_normal(int(seen.sum()))).astype(np.float32)
    return out


def render_truth(
    mesh: Any,
    poses: Array,
    camera: Any,
    threads: int = 0,
    cache: Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> Truth:
    """Cast every pixel of every pose against the mesh's triangles; `cache` keeps the result."""
    kept = None if cache is None else Path(cache) / f"truth_{_key(mesh, poses, camera)}.npz"
    if kept is not None and kept.is_file():
        return _load(kept, camera)
    rays = camera.rays
    boxes: list[tuple[int, int]] = []
    crops: list[NDArray[np.float32]] = []
    bounds = np.full((len(poses), 2), np.nan)
    pixels = np.zeros(len(poses), np.int64)
    for i, T in enumerate(poses):
        depth, normals, _ = mesh.raycast(camera, np.ascontiguousarray(T), threads=threads)
        rows, columns = np.nonzero(depth > 0)
        if not len(rows):
            raise ValueError(f"poses[{i}]: expected the object in view, got no pixel of it; check the pose")
        window = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
        boxes.append((int(rows.min()), int(columns.min())))
        crops.append(depth[window].copy())
        information, pixels[i] = pose_information(
            depth[window], normals[window], rays[window], T[:3, 3], MAX_INCIDENCE_RAD
        )
        bounds[i] = _lengths(information)
        if progress is not None:
            progress(i)
    truth = Truth(camera, np.asarray(poses), boxes, crops, bounds[:, 0], bounds[:, 1], pixels)
    if kept is not None:
        _save(kept, truth)
    return truth


def _lengths(information: Array) -> tuple[float, float]:
    """Bound of translation and rotation at unit noise; inf where the view does not fix the pose."""
    scale = np.sqrt(np.clip(np.diag(information), 1e-300, None))
    normed = information / np.outer(scale, scale)
    if float(np.linalg.eigvalsh(normed)[0]) < 1e-12:
        return np.inf, np.inf
    covariance = np.linalg.inv(normed) / np.outer(scale, scale)
    return expected_length(covariance[:3, :3]), expected_length(covariance[3:, 3:])


def _key(mesh: Any, poses: Array, camera: Any) -> str:
    digest = hashlib.sha256()
    for part in (mesh.vertices, mesh.faces, poses, camera.K):
        digest.update(np.ascontiguousarray(part).tobytes())
    digest.update(repr((camera.width, camera.height, camera.distortion)).encode())
    return digest.hexdigest()[:16]


def _save(path: Path, truth: Truth) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        np.savez_compressed(
            temporary,
            poses=truth.poses,
            boxes=np.array(truth.boxes),
            sizes=np.array([c.shape for c in truth.crops]),
            values=np.concatenate([c.ravel() for c in truth.crops]),
            bounds=np.column_stack([truth.bound_m, truth.bound_rad]),
            pixels=truth.pixels,
        )


def _load(path: Path, camera: Any) -> Truth:
    with np.load(path) as z:
        sizes, values = z["sizes"], z["values"]
        ends = np.cumsum(sizes[:, 0] * sizes[:, 1])
        crops = [
            part.reshape(size) for part, size in zip(np.split(values, ends[:-1]), sizes.tolist(), strict=True)
        ]
        boxes = [(int(a), int(b)) for a, b in z["boxes"]]
        bounds = z["bounds"]
        return Truth(camera, z["poses"], boxes, crops, bounds[:, 0], bounds[:, 1], z["pixels"])
