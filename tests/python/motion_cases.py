# SPDX-License-Identifier: MIT
"""Movements with known truth, measured with noise of known covariance."""

import numpy as np
from scipy.spatial.transform import Rotation

from sdftrack.motion import Trajectory

SD_M, SD_RAD = 1e-3, 5e-3


def minimum_jerk(u):
    u = np.clip(u, 0, 1)
    return u**3 * (10 - 15 * u + 6 * u**2)


def reaches(times_s, starts_s, away_m=(0.25, 0.1, 0.0), move_s=0.8, hold_s=0.7):
    """Positions (n, 3) of an object that is carried away and back, once for each start."""
    x = np.zeros((len(times_s), 3))
    for start in starts_s:
        out = minimum_jerk((times_s - start) / move_s)
        back = minimum_jerk((times_s - start - move_s - hold_s) / move_s)
        x += np.outer(out - back, away_m)
    return x + np.array([0, 0, 0.8])


def correlated_noise(n, rng, sd_m=SD_M, sd_rad=SD_RAD):
    """Errors (n, 6) of poses and their covariance (6, 6), positions and rotations correlated."""
    A = rng.normal(size=(6, 6))
    C = A @ A.T
    d = 1 / np.sqrt(np.diag(C))
    C = 0.5 * C * np.outer(d, d) + 0.5 * np.eye(6)
    D = np.diag(np.repeat([sd_m, sd_rad], 3))
    C = D @ C @ D
    return rng.multivariate_normal(np.zeros(6), C, n), C


def measured_poses(positions, rotations, errors):
    """(n, 4, 4) poses with errors (n, 6) added: t + d, Exp(r) R."""
    T = np.tile(np.eye(4), (len(positions), 1, 1))
    T[:, :3, 3] = positions + errors[:, :3]
    T[:, :3, :3] = (Rotation.from_rotvec(errors[:, 3:]) * rotations).as_matrix()
    return T


def noisy(times_s, positions, rotations=None, seed=0, sd_m=SD_M, sd_rad=SD_RAD, **fields):
    """A Trajectory of exact positions (n, 3) and rotations, with noise of the covariance that it states."""
    rng = np.random.default_rng(seed)
    if rotations is None:
        rotations = Rotation.from_rotvec(np.zeros((len(times_s), 3)))
    errors, C = correlated_noise(len(times_s), rng, sd_m, sd_rad)
    poses = measured_poses(positions, rotations, errors)
    return Trajectory(times_s, poses, np.tile(C, (len(times_s), 1, 1)), **fields)
