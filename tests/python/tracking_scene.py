# SPDX-License-Identifier: MIT
"""A box before a small camera, cast triangle by triangle: truth that does not come from the volume tracked with."""

import numpy as np

import sdftrack as st
from sdftrack import geometry

SIZE_M = np.array([0.12, 0.09, 0.06])  # no two sides alike
CAMERA = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)
POSE = geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.5])  # three faces seen
NOISE_M = 0.001
WALL_M = 1.2


def box_mesh(size=SIZE_M):
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * size
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
             [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip
    return st.Mesh(corners, np.array(faces, np.int32))


def depth_of(T=POSE, camera=CAMERA, noise_m=NOISE_M, seed=0, wall_m=WALL_M, size=SIZE_M):
    """Depth image (float32, m) of the box in front of a wall, with Gaussian noise on the box."""
    clean = box_mesh(size).raycast(camera, T)[0]
    noisy = clean + np.random.default_rng(seed).normal(0, noise_m, clean.shape)
    return np.where(clean > 0, noisy, wall_m).astype(np.float32)


def frame_of(T=POSE, **options):
    timestamp = options.pop("timestamp", None)
    return st.Frame(depth_of(T, **options), timestamp=timestamp)


def wall_frame():
    return st.Frame(np.full(CAMERA.shape, WALL_M, np.float32))


def followed(tracker, frames, **place):
    """Results of a tracker that starts in the first frame at `place`."""
    frames = list(frames)
    return [tracker.start(frames[0], **place), *map(tracker.track, frames[1:])]


def increment(d):
    """The motion by which the optimiser moves T_obj_cam: d[:3] in metres, d[3:] four times an MRP."""
    r = np.array(d[3:6]) / 4
    s, K = r @ r, np.cross(np.eye(3), r)
    T = np.eye(4)
    T[:3, :3] += (8 * K @ K + 4 * (1 - s) * K) / (1 + s) ** 2
    T[:3, 3] = d[:3]
    return T
