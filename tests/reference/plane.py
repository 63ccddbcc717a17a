# SPDX-License-Identifier: MIT
"""A plane in a depth image, in numpy: docs/math/planes.md, whose equation numbers stand beside the formulas.

A plane is held as ``g``, the three numbers of its inverse depth: 1 / Z = g . r on the ray r = (x, y, 1) (eq. 1).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TUKEY = 4.685  # 95 % efficiency for Gaussian noise
MAD = 1.4826  # of the median of |e| to one sd
SIGMAS = 3.0  # of the noise, that a measurement of the plane may be off
FIRST_REACH = 3.0  # slabs, that a first plane may be off; a bend grows from what lies in one slab
FOOT_SIGMAS = 2.0  # of the noise, above which a measurement may be a foot
FLOOR_M = 0.0005  # of the noise: a sensor that rounds has measurements without any scatter
MIN_SCALE = 0.1  # of the noise, against which a bend is held small
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


def height_m(g: Array, rays: Array, z: Array, bend: Array | float = 0.0) -> Array:
    """Distance to the plane, positive on the camera's side (eq. 3); `bend` is a share of the depth (eq. 8)."""
    out: Array = (1 - z * (rays @ g) - bend) / np.linalg.norm(g)
    return out


def height_sigma_m(g: Array, rays: Array, z: Array, focal_px: float, noise: Noise) -> Array:
    """Sd of `height_m`: depth noise along the ray, seen along the normal, and the jitter sideways (eq. 4)."""
    length = np.linalg.norm(g)
    along = noise.sigma_m(z) * (rays @ g) / length
    sideways = z / focal_px * noise.lateral_px * np.linalg.norm(g[:2]) / length
    out: Array = np.sqrt(along**2 + sideways**2)
    return out


def plane_depth_m(g: Array, rays: Array, z: Array) -> Array:
    """Depth of the plane on these rays; what is nowhere near it keeps its own."""
    share = z * (rays @ g)
    near = (share > 0.5) & (share < 2)
    out: Array = np.where(near, z / np.where(near, share, 1), z)
    return out


@dataclass(frozen=True)
class Fit:
    """`g`, the noise as a multiple of the law, and the bend's seven numbers."""

    g: Array
    scale: float
    bend: Array


def fit(
    rays: Array,
    z: Array,
    g: Array,
    focal_px: float,
    tolerance_m: float,
    noise: Noise = KINECT,
    rounds: int = 6,
    terms: Array | None = None,
) -> Fit:
    """Refine a plane on measurements: weighted least squares of inverse depth, Tukey's weights (eq. 5, 6).

    `rays` (N, 3), `z` (N,) m. The first round believes what is within three slabs, the others what the measured noise
    says. With `terms` (N, 7) the surface may bend (eq. 8).
    """
    rows = rays if terms is None else np.concatenate([rays, terms / z[:, None]], axis=1)
    prior = np.zeros(rows.shape[1])
    x = np.concatenate([g, np.zeros(len(prior) - 3)])
    scale = 1.0
    for k in range(rounds):
        bend = 0.0 if terms is None else terms @ x[3:]
        length = np.linalg.norm(x[:3])
        # Not at the measurement's own depth: what is noisy must not weigh itself.
        on_plane = plane_depth_m(x[:3], rays, z)
        sigma = height_sigma_m(x[:3], rays, on_plane, focal_px, noise)
        e = height_m(x[:3], rays, z, bend)
        slab = np.maximum(tolerance_m, SIGMAS * sigma)
        ratios = np.sort((e / sigma)[np.abs(e) < slab] ** 2)
        scale = MAD * float(np.sqrt(ratios[len(ratios) // 2]))
        first = FIRST_REACH if terms is None else 1.0
        reach = first * slab if k == 0 else TUKEY * np.maximum(scale * sigma, FLOOR_M)
        u2 = (e / reach) ** 2
        tukey = np.where(u2 < 1, (1 - u2) ** 2, 0)
        # Sd of 1 / Z is that of the height, times |g| / Z.
        w = tukey / (sigma * length / on_plane) ** 2
        prior[3:] = (max(scale, MIN_SCALE) / BEND_SD) ** 2
        information = rows.T @ (w[:, None] * rows) + np.diag(prior)
        x = np.linalg.solve(information, rows.T @ (w / z))
    return Fit(x[:3], scale, x[3:] if terms is not None else np.zeros(7))


def off_plane(
    g: Array,
    rays: Array,
    z: Array,
    focal_px: float,
    tolerance_m: float,
    noise: Noise = KINECT,
    scale: float = 1.0,
    bend: Array | float = 0.0,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """What stands out of the slab, and what lies in it but higher than the noise explains (eq. 7)."""
    e = height_m(g, rays, z, bend)
    sigma = np.maximum(scale * height_sigma_m(g, rays, z, focal_px, noise), FLOOR_M)
    seen = z > 0
    out = seen & (np.abs(e) > np.maximum(tolerance_m, SIGMAS * sigma))
    return out, seen & ~out & (e > FOOT_SIGMAS * sigma)


def feet(
    out: NDArray[np.bool_], raised: NDArray[np.bool_], z: Array, focal_px: float, tolerance_m: float
) -> NDArray[np.bool_]:
    """`out` and those raised measurements that hang together with it, over neighbours that are raised too.

    A foot reaches as many pixels from what stands out as `FOOT` tolerances take at its depth.
    """
    kept = out.copy()
    steps = np.where(raised, np.ceil(FOOT * tolerance_m * focal_px / np.where(z > 0, z, 1)), 0)
    for k in range(int(steps.max(initial=0))):
        wide = np.pad(kept, 1)
        beside = wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
        more = raised & ~kept & beside & (k < steps)
        if not more.any():
            break
        kept |= more
    return kept


def bend_terms(u: Array, v: Array) -> Array:
    """(N, 7) quadratic and cubic terms of pixels from the image's middle over half its longer side."""
    return np.stack([u * u, u * v, v * v, u**3, u * u * v, u * v * v, v**3], axis=-1)
