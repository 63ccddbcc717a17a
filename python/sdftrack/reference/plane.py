# SPDX-License-Identifier: MIT
"""A plane in a depth image, in numpy: docs/math/planes.md, whose equation numbers stand beside the formulas.

A plane is held as ``g``, the three numbers of its inverse depth: 1 / Z = g . r on the ray r = (x, y, 1) (eq. 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "KINECT", "Noise", "bend", "bend_terms", "feet", "fit", "height_m", "height_sigma_m", "inverse_plane", "off_plane",
    "normal_form",
]  # fmt: skip

Array = NDArray[np.float64]
TUKEY = 4.685  # 95 % efficiency for Gaussian noise
MAD = 1.4826  # of the median of |e| to one sd
SIGMAS = 3.0  # of the noise, that a reading of the plane may be off
FLOOR_M = 0.0005  # of the noise: a sensor that rounds has readings without any scatter
BEND_SD = 0.01  # of depth, that a term of the bend is expected to have: 1 cm at 1 m
FOOT = 2.0  # times the tolerance, that a foot may reach from what stands out


@dataclass(frozen=True)
class Noise:
    """Sd of a depth: near_m + per_m (Z - 0.4 m)^2, and the sideways jitter of a pixel."""

    near_m: float = 0.0012
    per_m: float = 0.0019
    lateral_px: float = 0.5

    def sigma_m(self, z: Array) -> Array:
        out: Array = self.near_m + self.per_m * (np.asarray(z, np.float64) - 0.4) ** 2
        return out


KINECT = Noise()  # Nguyen, Izadi and Lovell 2012


def normal_form(g: Array) -> tuple[Array, float]:
    """(n, d) with n . p + d = 0 and n towards the camera (eq. 2)."""
    length = float(np.linalg.norm(g))
    return -g / length, 1 / length


def inverse_plane(n: Array, d: float) -> Array:
    """The reverse of `normal_form`."""
    return -np.asarray(n, np.float64) / d


def height_m(g: Array, rays: Array, z: Array) -> Array:
    """Distance to the plane, positive on the camera's side (eq. 3)."""
    out: Array = (1 - z * (rays @ g)) / np.linalg.norm(g)
    return out


def height_sigma_m(g: Array, rays: Array, z: Array, fx: float, noise: Noise, scale: float) -> Array:
    """Sd of `height_m`: depth noise along the ray, seen along the normal, and the jitter sideways (eq. 4)."""
    length = np.linalg.norm(g)
    along = noise.sigma_m(z) * (rays @ g) / length
    sideways = z / fx * noise.lateral_px * np.linalg.norm(g[:2]) / length
    out: Array = scale * np.sqrt(along**2 + sideways**2)
    return out


def fit(
    rays: Array, z: Array, g: Array, fx: float, tolerance_m: float, noise: Noise = KINECT, rounds: int = 6
) -> tuple[Array, float, Array]:
    """Plane through readings, from a first one: weighted least squares of inverse depth, Tukey's weights (eq. 5, 6).

    The first round believes what is within three tolerances, the others what the measured noise says. Returns g, the
    noise as a multiple of the law, and the covariance of g.
    """
    scale, information = 1.0, np.eye(3)
    for k in range(rounds):
        sigma = height_sigma_m(g, rays, z, fx, noise, 1.0)
        e = height_m(g, rays, z)
        slab = np.maximum(tolerance_m, SIGMAS * sigma)
        near = np.abs(e) < slab
        scale = MAD * float(np.median(np.abs(e[near]) / sigma[near]))
        reach = 3 * slab if k == 0 else TUKEY * np.maximum(scale * sigma, FLOOR_M)
        u = e / reach
        tukey = np.where(np.abs(u) < 1, (1 - u**2) ** 2, 0)
        # Sd of 1 / Z is that of the height, times |g| / Z.
        w = tukey / (sigma * np.linalg.norm(g) / z) ** 2
        information = rays.T @ (w[:, None] * rays)
        g = np.linalg.solve(information, rays.T @ (w / z))
    return g, scale, scale**2 * np.linalg.inv(information)


def off_plane(
    g: Array, rays: Array, z: Array, fx: float, tolerance_m: float, noise: Noise = KINECT, scale: float = 1.0
) -> tuple[Array, Array]:
    """What stands out of the slab, and what lies in it but higher than the noise explains (eq. 7)."""
    e = height_m(g, rays, z)
    sigma = SIGMAS * np.maximum(height_sigma_m(g, rays, z, fx, noise, scale), FLOOR_M)
    out = np.abs(e) > np.maximum(tolerance_m, sigma)
    return out, ~out & (e > sigma)


def feet(
    out: NDArray[np.bool_], raised: NDArray[np.bool_], z: Array, fx: float, tolerance_m: float
) -> NDArray[np.bool_]:
    """`out` and those raised readings that hang together with it, over neighbours that are raised too.

    A foot reaches as many pixels from what stands out as `FOOT` tolerances take at its depth.
    """
    kept = out.copy()
    steps = np.where(raised, np.ceil(FOOT * tolerance_m * fx / np.where(z > 0, z, 1)), 0)
    for k in range(int(steps.max(initial=0))):
        wide = np.pad(kept, 1)
        beside = wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
        more = raised & ~kept & beside & (k < steps)
        if not more.any():
            break
        kept |= more
    return kept


def bend_terms(u: Array, v: Array) -> Array:
    """(N, 7) quadratic and cubic terms of image coordinates -1..1."""
    return np.stack([u * u, u * v, v * v, u**3, u * u * v, u * v * v, v**3], axis=-1)
