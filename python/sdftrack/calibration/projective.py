# SPDX-License-Identifier: MIT
"""The mapping from points of the depth camera to colour pixels, in two forms, with derivatives.

Projective: ``lambda x' = P (Z x) + q`` (thesis Eq. 3.25), stored as ``M = [P K | q]`` on points in metres, 12
parameters up to scale. Rigid: ``x' = pi(T_color_depth p)`` with a known colour camera, 6 numbers.
docs/math/color_to_depth.md, eq. 1, 11 and 12.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.array_equality import Compared
from sdftrack.camera import Camera

Array = NDArray[np.float64]
STEP_M = 1e-6  # of the numerical derivative through a lens


@dataclass(frozen=True, eq=False)
class ProjectiveMap(Compared):
    """``y = M (p, 1)``, pixel ``y_01 / y_2``; `M` is (3, 4), `depth` the depth camera."""

    M: Array
    depth: Camera
    unknowns = 12

    def predict(self, p_cam: Array) -> tuple[Array, Array, Array]:
        """Pixels (N, 2) of points (N, 3), derivatives by the 12 parameters (N, 2, 12) and by the points (N, 2, 3)."""
        p1 = np.column_stack([p_cam, np.ones(len(p_cam))])
        y = p1 @ self.M.T
        with np.errstate(invalid="ignore", divide="ignore"):
            px = y[:, :2] / y[:, 2:]
            J = np.zeros((len(p1), 2, 3, 4))
            for k in (0, 1):
                J[:, k, k] = p1 / y[:, 2:]
                J[:, k, 2] = -p1 * (px[:, k] / y[:, 2])[:, None]
            by_point = (self.M[:2, :3] - px[:, :, None] * self.M[2, :3]) / y[:, 2, None, None]
        px[y[:, 2] <= 0] = np.nan
        return px, J.reshape(-1, 2, 12), by_point

    def moved(self, step: Array) -> ProjectiveMap:
        """M plus a step, renormalised."""
        return ProjectiveMap(_scaled(self.M + step.reshape(3, 4)), self.depth)

    @property
    def scales(self) -> Array:
        """(12,) scale of each parameter, for damping."""
        size = np.array([self.M[0, 0], self.M[1, 1], 1.0])
        return np.repeat(np.abs(size), 4)

    def Pq(self) -> tuple[Array, Array]:
        """(P, q) of Eq. 3.25, with lambda the depth (m) in the colour camera."""
        return self.M[:, :3] @ np.linalg.inv(self.depth.K), self.M[:, 3].copy()

    def Pq_jacobian(self) -> Array:
        """(12, 12) d (P row by row, q) / d (M row by row), at fixed scale."""
        K_inv = np.linalg.inv(self.depth.K)
        J = np.zeros((12, 12))
        for r in range(3):
            J[3 * r : 3 * r + 3, 4 * r : 4 * r + 3] = K_inv.T
            J[9 + r, 4 * r + 3] = 1
        return J @ self.gauge()

    def gauge(self) -> Array:
        """(12, 12) projector of changes of M onto those that preserve |M[2, :3]| = 1 by rescaling."""
        along = np.zeros((3, 4))
        along[2, :3] = self.M[2, :3]
        return np.eye(12) - np.outer(self.M.ravel(), along.ravel())


@dataclass(frozen=True, eq=False)
class RigidMap(Compared):
    """The colour camera at `T_color_depth`; unknowns (v, w): T <- exp(v, w) T, metres and radians."""

    T_color_depth: Array
    color: Camera
    depth: Camera
    unknowns = 6

    def predict(self, p_cam: Array) -> tuple[Array, Array, Array]:
        """As :meth:`ProjectiveMap.predict`, derivatives (N, 2, 6) by (v, w)."""
        R, t = self.T_color_depth[:3, :3], self.T_color_depth[:3, 3]
        p = p_cam @ R.T + t
        by_eye = np.stack(
            [
                (self.color.project(p + STEP_M * e) - self.color.project(p - STEP_M * e)) / (2 * STEP_M)
                for e in np.eye(3)
            ],
            axis=-1,
        )
        turn = np.zeros((len(p), 3, 3))  # -[p]x
        turn[:, 0, 1], turn[:, 0, 2], turn[:, 1, 2] = p[:, 2], -p[:, 1], p[:, 0]
        turn -= np.swapaxes(turn, 1, 2)
        return self.color.project(p), np.concatenate([by_eye, by_eye @ turn], axis=2), by_eye @ R

    def moved(self, step: Array) -> RigidMap:
        return RigidMap(geometry.exp(step) @ self.T_color_depth, self.color, self.depth)

    @property
    def scales(self) -> Array:
        return np.ones(6)

    def Pq(self) -> tuple[Array, Array]:
        """(P, q) for ideal pixels: those of the colour camera without distortion."""
        K = self.color.K
        return K @ self.T_color_depth[:3, :3] @ np.linalg.inv(self.depth.K), K @ self.T_color_depth[:3, 3]

    def Pq_jacobian(self) -> Array:
        """(12, 6) d (P row by row, q) / d (v, w)."""
        R, t, K = self.T_color_depth[:3, :3], self.T_color_depth[:3, 3], self.color.K
        K_inv = np.linalg.inv(self.depth.K)
        J = np.zeros((12, 6))
        for k in range(3):
            J[9:, k] = K[:, k]
            cross = np.cross(np.eye(3)[k], np.eye(3)).T  # [e_k]x
            J[:9, 3 + k] = (K @ cross @ R @ K_inv).ravel()
            J[9:, 3 + k] = K @ cross @ t
        return J


def dlt(p_cam: Array, color_px: Array, depth: Camera) -> ProjectiveMap:
    """The linear solution for M from N >= 6 pairs, both sides normalised (Hartley).

    Parameters
    ----------
    p_cam : (N, 3) m
    color_px : (N, 2)
    depth : Camera
    """
    T3, T2 = _normalising(p_cam), _normalising(color_px)
    p = np.column_stack([p_cam, np.ones(len(p_cam))]) @ T3.T
    u = np.column_stack([color_px, np.ones(len(p))]) @ T2.T
    A = np.zeros((2 * len(p), 12))
    A[0::2, :4], A[0::2, 8:] = p, -u[:, :1] * p
    A[1::2, 4:8], A[1::2, 8:] = p, -u[:, 1:2] * p
    M = np.linalg.inv(T2) @ np.linalg.svd(A, full_matrices=False)[2][-1].reshape(3, 4) @ T3
    front = np.sign(np.median(M[2, :3] @ p_cam.T + M[2, 3]))
    return ProjectiveMap(_scaled(M * (front or 1.0)), depth)


def resection(p_cam: Array, color_px: Array, color: Camera, depth: Camera) -> RigidMap | None:
    """A pose of the colour camera from N >= 4 pairs, not on a line; None if there is none."""
    import cv2

    from sdftrack.calibration.cone import rays_of

    ray = rays_of(color_px, color)
    xy = np.ascontiguousarray(ray[:, :2] / ray[:, 2:])
    try:
        ok, w, t = cv2.solvePnP(
            np.ascontiguousarray(p_cam), xy, np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_SQPNP
        )
    except cv2.error:
        return None
    if not ok or not (np.isfinite(w).all() and np.isfinite(t).all()):
        return None
    return RigidMap(geometry.pose(w.ravel(), t.ravel()), color, depth)


def decompose(M: Array) -> tuple[Array, Array]:
    """K' (3, 3) with K'[2, 2] = 1, and T_color_depth (4, 4), of ``M = K' [R' | t]`` (up to scale).

    K' may have a skew, K'[0, 1]: the 12 parameters do not exclude it.
    """
    A = M[:, :3]
    if np.linalg.det(A) < 0:
        raise ValueError("M: expected a mapping of points in front of the camera, got one that mirrors them")
    # RQ by QR of the reversed matrix.
    flip = np.eye(3)[::-1]
    Q, U = np.linalg.qr((flip @ A).T)
    K, R = flip @ U.T @ flip, flip @ Q.T
    sign = np.diag(np.sign(np.diag(K)))
    K, R = K @ sign, sign @ R
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, np.linalg.solve(K, M[:, 3])
    return K / K[2, 2], T


def _scaled(M: Array) -> Array:
    scaled: Array = M / max(float(np.linalg.norm(M[2, :3])), 1e-300)
    return scaled


def _normalising(x: Array) -> Array:
    """Similarity that puts the mean at 0 and the mean distance at sqrt(dimension)."""
    n = x.shape[1]
    mean = x.mean(axis=0)
    s = np.sqrt(n) / max(float(np.linalg.norm(x - mean, axis=1).mean()), 1e-12)
    T = np.diag([s] * n + [1.0])
    T[:n, n] = -s * mean
    return T
