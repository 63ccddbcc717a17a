# SPDX-License-Identifier: MIT
"""Lower bound of the pose error from noisy depth: the Cramer-Rao bound of the visible pixels.

A pixel's ray ``z r`` (``r`` with z = 1) meets the surface at the hit ``X`` with normal ``n``. Moving the
object by ``t = t^ + d``, ``R = Exp(w) R^`` (camera axes, about the object's origin ``o``) changes the depth
to first order by ``dz = (n . d + ((X - o) x n) . w) / (n . r)``: the rotation of the normal itself cancels at the hit.
With independent noise of standard deviation sigma on z the covariance of any unbiased estimate is at least ``(sum
(dz/dp)(dz/dp)^T / sigma^2)^-1``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_INCIDENCE_RAD = np.deg2rad(80.0)  # beyond, no depth camera delivers what the formula promises

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PoseBound:
    """Cramer-Rao bound of one frame.

    Attributes
    ----------
    covariance : (6, 6) float64
        Of (x, y, z, rx, ry, rz), m and rad, camera axes, about the object's origin.
    translation_m, rotation_rad : float
        Expected length of the translation and the rotation error of an estimate that attains the bound.
    pixels : int
        Number of visible pixels used.
    """

    covariance: Array
    translation_m: float
    rotation_rad: float
    pixels: int


def pose_information(
    depth: NDArray[np.floating],
    normals: NDArray[np.floating],
    rays: NDArray[np.floating],
    origin: Array,
    max_incidence_rad: float = MAX_INCIDENCE_RAD,
) -> tuple[Array, int]:
    """Sum of ``(dz/dp)(dz/dp)^T`` over the object's visible pixels.

    Parameters
    ----------
    depth : (H, W) float, m, noise-free, 0 where the object is not seen
    normals : (H, W, 3) float, unit, camera frame, exact
    rays : (H, W, 2) float
        x / z and y / z of each pixel's ray.
    origin : (3,) float64, m
        The object's origin in the camera frame.

    Returns
    -------
    (6, 6) float64, unit (m, rad), and the number of pixels.
    """
    seen = depth > 0
    z = depth[seen].astype(np.float64)
    r = np.column_stack([rays[seen].astype(np.float64), np.ones(len(z))])
    n = normals[seen].astype(np.float64)
    slope = np.einsum("ij,ij->i", n, r)
    cosine = np.abs(slope) / (np.linalg.norm(r, axis=1) * np.linalg.norm(n, axis=1))
    keep = cosine >= np.cos(max_incidence_rad)
    z, r, n, slope = z[keep], r[keep], n[keep], slope[keep]
    lever = z[:, None] * r - origin
    J = np.concatenate([n, np.cross(lever, n)], axis=1) / slope[:, None]
    return J.T @ J, len(z)


def expected_length(covariance: Array, order: int = 64) -> float:
    """E|e| of a zero-mean Gaussian vector in three dimensions.

    ``e = rho C^(1/2) u`` with ``u`` uniform on the sphere and ``rho`` a chi variable of three degrees, so
    ``E|e| = 2 sqrt(2 / pi) mean_u sqrt(u^T C u)``; the mean by Gauss-Legendre in z times equal angles about
    it.
    """
    values = np.sort(np.clip(np.linalg.eigvalsh(np.asarray(covariance, np.float64)), 0.0, None))
    z, weight = np.polynomial.legendre.leggauss(order)
    angle = (np.arange(order) + 0.5) * (np.pi / order)
    rho2 = 1.0 - z**2
    across = values[1] * np.cos(angle) ** 2 + values[0] * np.sin(angle) ** 2
    square = values[2] * z[:, None] ** 2 + rho2[:, None] * across
    mean = float(weight @ np.sqrt(square).mean(axis=1)) / 2.0
    return float(2.0 * np.sqrt(2.0 / np.pi) * mean)


def pose_bound(
    depth: NDArray[np.floating],
    normals: NDArray[np.floating],
    rays: NDArray[np.floating],
    origin: Array,
    sigma_m: float,
    max_incidence_rad: float = MAX_INCIDENCE_RAD,
) -> PoseBound:
    """Cramer-Rao bound of one frame; arguments as in `pose_information`.

    ``sigma_m`` is the depth noise, m. An unobservable direction (rotation of a body of revolution) has infinite
    covariance: ValueError states the smallest eigenvalue.
    """
    information, pixels = pose_information(depth, normals, rays, origin, max_incidence_rad)
    scale = np.sqrt(np.clip(np.diag(information), 1e-300, None))
    normed = information / np.outer(scale, scale)
    smallest = float(np.linalg.eigvalsh(normed)[0]) if pixels else 0.0
    if smallest < 1e-12:
        raise ValueError(
            f"pose_bound: expected six observable directions, got {pixels} pixels whose weakest direction "
            f"has relative information {smallest:.1e}; use a view or an object that fixes the pose"
        )
    covariance = sigma_m**2 * np.linalg.inv(normed) / np.outer(scale, scale)
    return PoseBound(
        covariance, expected_length(covariance[:3, :3]), expected_length(covariance[3:, 3:]), pixels
    )
