# SPDX-License-Identifier: MIT
"""Trajectories for tests of the motion package."""

import numpy as np

import sdftrack as st

FPS = 30.0


def poses(n, seed=0, reach_m=1.0):
    """(n, 4, 4) unrelated poses: any rotation, up to `reach_m` from the origin."""
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (n, 1, 1))
    T[:, :3, :3] = [st.geometry.exp(np.r_[0, 0, 0, w])[:3, :3] for w in rng.normal(size=(n, 3)) * 2]
    T[:, :3, 3] = rng.uniform(-reach_m, reach_m, (n, 3))
    return T


def trajectory(n=12, seed=0, name="cup", covariance=True, status=None, start_s=0.0, fps=FPS):
    rng = np.random.default_rng(seed + 1)
    A = rng.normal(size=(n, 6, 6)) * 1e-3
    covariances = A @ np.swapaxes(A, 1, 2) if covariance else None
    return st.motion.Trajectory(start_s + np.arange(n) / fps, poses(n, seed), covariances, status, name)


def write_folder(folder, results, timestamps, names=("cup",), obj_ids=(1,)):
    """A result folder, as `sdftrack track` writes it."""
    camera = st.Camera(525.0, 525.0, 3.5, 3.5, 8, 8)
    with st.Recorder(folder, camera, names=list(names), obj_ids=list(obj_ids), video=False) as recorder:
        for i, (result, time) in enumerate(zip(results, timestamps, strict=True)):
            frame = st.Frame(np.full((8, 8), 0.5, np.float32), timestamp=time, index=i)
            recorder.add(frame, result)
    return folder


def results_of(*trajectories):
    """One TrackResult per frame, of trajectories with the same times."""
    out = []
    for i, time in enumerate(trajectories[0].times_s):
        m = len(trajectories)
        out.append(
            st.TrackResult(
                poses=np.array([t.poses[i] for t in trajectories]),
                status=[st.Status(t.status[i]) for t in trajectories], reason=[""] * m,
                confidence=np.ones(m), covariances=np.array([t.covariances[i] for t in trajectories]),
                twists=np.full((m, 6), np.nan), inliers=np.ones(m), runner_up=np.full(m, np.nan),
                energy=0.0, seconds=0.01, timestamp=float(time),
            )
        )  # fmt: skip
    return out
