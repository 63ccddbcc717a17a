# SPDX-License-Identifier: MIT
"""The corner of a room: three orthogonal planes for assessing intrinsics (thesis, Table 3.1, Fig. 3.13)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.synth.noise import Noise, noise_of

Array = NDArray[np.float64]
DEFAULT_CAMERA = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
MIN_TOWARDS = (
    0.4  # least part of the way from the corner to the camera along each wall's normal: none is grazing
)


def corner(
    n: int = 1,
    noise: Any = None,
    seed: int = 0,
    *,
    camera: Camera | RGBDCamera | None = None,
    poses: Any = None,
    distance_m: tuple[float, float] = (1.0, 1.8),
    reach_m: float = 6.0,
    fps: float = 30.0,
) -> Sequence:
    """Depth images of the corner of a room, with the exact pose of each.

    The corner's frame has its origin where the three planes x = 0, y = 0 and z = 0 meet; the room is where all three
    coordinates are positive. The same arguments give the same images, bit by bit, in any order of access.

    Parameters
    ----------
    n : int
        Number of frames; with `poses` their number.
    noise : None, sigma in metres, "kinect", `Gaussian(...)`, `Kinect(...)`, or a function (depth, cosine, rng) -> depth
    seed : int
        Seed of the poses and of the noise.
    camera : Camera, optional
        The true camera, including distortion; default: 640 x 480 with 525 px.
    poses : (n, 4, 4) float64 array of T_cam_corner (m), optional
        Default: `corner_poses(n, seed, distance_m)`.
    distance_m : (nearest, farthest)
        Distance of the camera from the corner, if poses are not given.
    reach_m : float
        Beyond this depth (m) nothing is measured.
    fps : float
        Frames per second of the timestamps.

    Returns
    -------
    Sequence
        Without colour; ``ground_truth[i][0]`` is T_cam_corner.

    Raises
    ------
    ValueError
        `n` below 1, poses of wrong shape or with the camera outside the room.

    Examples
    --------
    >>> seq = corner(2, noise="kinect", seed=1)
    >>> seq[0].depth.shape, seq.ground_truth[1][0].shape
    ((480, 640), (4, 4))
    """
    if isinstance(n, (bool, str)) or int(n) != n or n < 1:
        raise ValueError(f"n: expected a number of frames above 0, got {n!r}")
    if not fps > 0:
        raise ValueError(f"fps: expected frames per second above 0, got {fps}")
    if not reach_m > 0:
        raise ValueError(f"reach_m: expected metres above 0, got {reach_m}")
    eye = DEFAULT_CAMERA if camera is None else depth_camera(camera)
    T = corner_poses(int(n), seed, distance_m) if poses is None else _inside(poses)
    truth = {i: {0: T[i]} for i in range(len(T))}
    frames = _Frames(eye, T, noise_of(noise), seed, reach_m, fps)
    return Sequence(frames, RGBDCamera(eye), truth, layout="memory", name="corner")


def corner_poses(n: int, seed: int = 0, distance_m: tuple[float, float] = (1.0, 1.8)) -> Array:
    """(n, 4, 4) T_cam_corner (m) of cameras that look at the corner from all over the room, turned about their axis."""
    near, far = (float(d) for d in distance_m)
    if not 0 < near <= far:
        raise ValueError(f"distance_m: expected 0 < nearest <= farthest, got {distance_m!r}")
    rng = np.random.default_rng([seed, 313])
    out: list[Array] = []
    while len(out) < n:
        towards = np.abs(rng.normal(size=3))
        towards /= np.linalg.norm(towards)
        if towards.min() < MIN_TOWARDS:
            continue
        away = rng.uniform(near, far)
        # The corner lies up to 8 % of the distance beside the middle of the picture.
        out.append(geometry.look_at(away * towards, 0.08 * away * rng.uniform(-1, 1, 3), rng.normal(size=3)))
    return np.array(out)


def render_corner(
    camera: Camera, T_cam_corner: Array, reach_m: float = 6.0
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int8]]:
    """Exact depth (m, 0: beyond reach), cosine of the incidence, and which plane (0, 1, 2 for x, y, z; -1: none).

    The room is convex: a ray from inside meets first the plane at the smallest depth that it runs towards.
    """
    rays = np.concatenate([camera.rays, np.ones((*camera.shape, 1), np.float32)], axis=-1).astype(np.float64)
    normals = T_cam_corner[:3, :3].T  # row k: the normal of plane k, into the room, camera frame
    offsets = -normals @ T_cam_corner[:3, 3]
    along = np.einsum("hwc,kc->hwk", rays, normals)
    with np.errstate(divide="ignore"):
        z = np.where(along < 0, -offsets / along, np.inf)
    which = z.argmin(axis=-1)
    depth = np.take_along_axis(z, which[..., None], axis=-1)[..., 0]
    towards = -np.take_along_axis(along, which[..., None], axis=-1)[..., 0]
    cosine = np.clip(towards / np.linalg.norm(rays, axis=-1), 0, 1)
    seen = depth <= reach_m
    return (
        np.where(seen, depth, 0).astype(np.float32),
        np.where(seen, cosine, 1).astype(np.float32),
        np.where(seen, which, -1).astype(np.int8),
    )


class _Frames:
    """Frames by number, rendered when asked for."""

    def __init__(
        self, camera: Camera, poses: Array, noise: Noise | None, seed: int, reach_m: float, fps: float
    ) -> None:
        self._camera, self._poses, self._noise = camera, poses, noise
        self._seed, self._reach_m, self._fps = seed, reach_m, fps

    def __len__(self) -> int:
        return len(self._poses)

    def __getitem__(self, i: int) -> Frame:
        depth, cosine, _ = render_corner(self._camera, self._poses[i], self._reach_m)
        if self._noise is not None:
            depth = self._noise(depth, cosine, np.random.default_rng([self._seed, 314, i]))
        return Frame(depth, timestamp=i / self._fps, index=i, check_units=False)


def _inside(poses: Any) -> Array:
    T = np.asarray(poses, np.float64)
    if T.ndim != 3 or T.shape[1:] != (4, 4) or not len(T):
        raise ValueError(f"poses: expected shape (n, 4, 4) of T_cam_corner, got {T.shape}")
    T = np.array([geometry.rigid(t, f"poses[{i}]") for i, t in enumerate(T)])
    eyes = -np.einsum("nji,nj->ni", T[:, :3, :3], T[:, :3, 3])
    outside = np.flatnonzero(~(eyes > 0).all(axis=1))
    if len(outside):
        raise ValueError(
            f"poses[{outside[0]}]: expected a camera inside the room (x, y, z > 0 in the corner's frame), "
            f"got one at {eyes[outside[0]].round(3).tolist()} m"
        )
    return T
