# SPDX-License-Identifier: MIT
"""Evidence of depth images about voxels, distances from it, and the evolution of a level set, in plain numpy.

Notation and sections: docs/math/reconstruction.md. Volumes are [z, y, x], negative inside; log ratios positive inside.
"""

from dataclasses import dataclass
from math import erf
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

UNKNOWN_WEIGHT = 0.02  # of a voxel that nothing but faint carving has spoken of
FAINT_MEAN = -0.02  # log ratio
CARVES_FAINTLY, FAINT = -2.0, 0.01  # beside an outline, and its share of the usual weight
CARVES = -1.0  # slant of a pixel that says no more than that the space before it is empty
CARVED_RATIO = -1.0
MAX_SMOOTH, MAX_PRINTED = 0.9, np.tanh(5.0)  # of |q|; log ratios of 2.94 and 10
PRINTED_REACH = 16.0  # of sigma_d: the printed form has no end, and leaves 1e-7 there
REACH = 2.0  # of sigma_d: nothing is said farther behind a measurement


@dataclass
class Options:
    """The core's options, under the same names (m)."""

    printed: bool = False
    sigma_d_m: float = 0.003
    noise_m: float = 0.001
    noise_per_m: float = 0.0
    min_noise_m: float = 0.001  # at least a voxel
    usual_noise_m: float = 0.001
    carve_from_m: float = 0.003
    min_slant: float = 0.2
    border_px: int = 2
    jump_m: float = 0.01
    max_weight: float = 100.0


# ---- 1. evidence ----


def log_ratio(d_m: Array, noise_m: Array | float, sigma_d_m: float, printed: bool) -> Array:
    """log(L_in / L_out) of a voxel d behind a measurement, (1) and (2)."""
    d = np.asarray(d_m, np.float64)
    sure = np.sign(d) if printed else np.vectorize(erf)(d / (np.sqrt(2) * np.asarray(noise_m)))
    most = MAX_PRINTED if printed else MAX_SMOOTH
    return 2 * np.arctanh(np.clip(np.exp(-np.abs(d) / sigma_d_m) * sure, -most, most))


def pixels(depth_m: Array, mask: Array, K: Array, o: Options) -> tuple[Array, Array, Array]:
    """(slant, du, dv) of each pixel: slant 0 where it says nothing; du, dv the depth's slope (m per pixel)."""
    z = np.where(np.isfinite(depth_m) & (depth_m > 0), depth_m, 0).astype(np.float64)
    role = np.where(z == 0, 0, np.where(mask != 0, 1, 2))
    h, w = z.shape
    border = np.zeros((h, w), bool)
    for y, x in np.ndindex(h, w):
        for v, u in ((y, x + 1), (y + 1, x)):
            if v < h and u < w and (role[v, u] != role[y, x] or abs(z[v, u] - z[y, x]) >= o.jump_m):
                border[y, x] = border[v, u] = True
    slant, du, dv = np.zeros((3, h, w))
    for y, x in np.ndindex(h, w):
        r = max(o.border_px - 1, 0)
        silent = border[max(0, y - r) : y + r + 1, max(0, x - r) : x + r + 1].any()
        if role[y, x] == 2 and silent and not border[y, x]:
            slant[y, x] = CARVES_FAINTLY
        if role[y, x] == 0 or silent:
            continue
        slant[y, x] = CARVES
        if role[y, x] != 1 or not (2 <= x < w - 2 and 2 <= y < h - 2):
            continue
        # The plane that fits 5 x 3 and 3 x 5 pixels best.
        a = np.polyfit(np.arange(-2, 3), z[y - 1 : y + 2, x - 2 : x + 3].T, 1)[0].mean()
        b = np.polyfit(np.arange(-2, 3), z[y - 2 : y + 3, x - 1 : x + 2], 1)[0].mean()
        fx, fy, cx, cy = K
        c = z[y, x] / np.linalg.norm([fx * a, fy * b, z[y, x] + (x - cx) * a + (y - cy) * b])
        if c >= o.min_slant:
            slant[y, x], du[y, x], dv[y, x] = c, a, b
    return slant, du, dv


def range_discrepancy(p_cam: Array, depth_m: Array, K: Array) -> Array:
    """How far (..., 3) points lie behind the measurement of their nearest pixel, along that pixel's ray; NaN: none.

    (4.28) and (4.29) times the measurement's range: m. Printed it is a share of that range, but sigma_d is a length.
    """
    h, w = depth_m.shape
    fx, fy, cx, cy = K
    z = np.where(p_cam[..., 2] > 0.01, p_cam[..., 2], np.inf)
    j = np.floor(fx * p_cam[..., 0] / z + cx + 0.5).astype(int)
    i = np.floor(fy * p_cam[..., 1] / z + cy + 0.5).astype(int)
    seen = np.isfinite(z) & (i >= 0) & (j >= 0) & (i < h) & (j < w)
    i, j = np.where(seen, i, 0), np.where(seen, j, 0)
    reading = np.where(seen & (depth_m[i, j] > 0), depth_m[i, j], np.nan)
    measured = reading[..., None] * np.stack([(j - cx) / fx, (i - cy) / fy, np.ones(j.shape)], axis=-1)
    squared = (measured**2).sum(axis=-1)
    share = (p_cam * measured).sum(axis=-1) / squared - 1  # (4.29)
    return np.asarray(share * np.sqrt(squared))


def printed_likelihood(d: Array, sigma_d: float) -> Array:
    """L_in of (4.30); d and sigma_d in one unit. L_out is 1 - L_in."""
    return np.asarray(0.5 * (np.sign(d) * np.exp(-np.abs(d) / sigma_d) + 1))


def first_guess(phi: Array, influence: float = 0.5, sigma_g: float = 4.0) -> Array:
    """G of (4.34), the likelihood of inside by the first shape; phi in voxels."""
    return np.asarray(influence / (1 + np.exp(phi / sigma_g)) + (1 - influence) * 0.5)


def printed_evidence(p_cam: Array, depth_m: Array, mask: Array, K: Array, o: Options) -> tuple[Array, Array]:
    """What a frame says about (..., 3) points by (4.29) to (4.31): log ratio, and 1 where it says anything."""
    depth = np.where(np.isfinite(depth_m) & (depth_m > 0) & (mask != 0), depth_m, 0).astype(np.float64)
    d = range_discrepancy(p_cam, depth, K)
    says = np.abs(d) < PRINTED_REACH * o.sigma_d_m
    # Infinite at d = 0: the one place where the printed formula cannot be taken as it is.
    inside = np.clip(printed_likelihood(d, o.sigma_d_m), 0.5 * (1 - MAX_PRINTED), 0.5 * (1 + MAX_PRINTED))
    return np.where(says, np.log(inside / (1 - inside)), 0), np.where(says, 1.0, 0.0)


def evidence(p_cam: Array, depth_m: Array, mask: Array, K: Array, o: Options) -> tuple[Array, Array]:
    """What a frame says about (..., 3) points: log ratio times weight, and the weight."""
    if o.printed:
        return printed_evidence(p_cam, depth_m, mask, K, o)
    slant_of, du, dv = pixels(depth_m, mask, K, o)
    h, w = slant_of.shape
    fx, fy, cx, cy = K
    z = np.maximum(p_cam[..., 2], 0.01)
    u, v = fx * p_cam[..., 0] / z + cx, fy * p_cam[..., 1] / z + cy
    seen = (p_cam[..., 2] > 0.01) & (u > -0.49) & (v > -0.49) & (u < w - 0.51) & (v < h - 0.51)
    i, j = (np.where(seen, np.floor(a + 0.5), 0).astype(int) for a in (v, u))
    slant = np.where(seen, slant_of[i, j], 0)
    depth = np.where(slant != 0, depth_m[i, j] + du[i, j] * (u - j) + dv[i, j] * (v - i), 1e6)
    surface = slant > 0
    d = (z - depth) * np.where(surface, slant, 1)
    blur = np.maximum(o.noise_m + o.noise_per_m * depth**2, o.min_noise_m)
    near = surface & (np.abs(d) < REACH * o.sigma_d_m)
    before = surface & (d < REACH * o.sigma_d_m)
    weight = np.where(before, slant * (max(o.usual_noise_m, o.min_noise_m) / blur) ** 2, 0)
    said = np.where(near, weight * log_ratio(d, blur, o.sigma_d_m, False), 0)
    carved = (slant != 0) & (d < -np.maximum(3 * blur, o.carve_from_m))
    part = np.where(slant == CARVES_FAINTLY, FAINT, 1)
    past = -part * CARVED_RATIO / (2 * np.arctanh(MAX_SMOOTH))
    less = carved & ~(said < CARVED_RATIO)
    return (
        np.where(less, np.where(part < 1, FAINT_MEAN * past, CARVED_RATIO), said),
        np.where(less, past, weight),
    )


# ---- 2. fusing ----


def fuse(
    ratio: Array, weight: Array, said: tuple[Array, Array], max_weight: float, printed: bool = False
) -> tuple[Array, Array]:
    """Sums over the frames so far and one more; what was guessed counts until something is seen, printed for good."""
    # Faint carving speaks only where nothing else has spoken.
    idle = (said[1] < 2 * FAINT * -CARVED_RATIO / (2 * np.arctanh(MAX_SMOOTH))) & (weight > UNKNOWN_WEIGHT)
    said = np.where(idle, 0, said[0]), np.where(idle, 0, said[1])
    known = np.where((weight == 0) & (said[1] > 0) & (not printed), 0, ratio)
    total = weight + said[1]
    kept = np.minimum(1, max_weight / np.maximum(total, 1e-30))
    return kept * (known + said[0]), kept * total


# ---- 3. distance ----


def crossings(mean: Array, voxel_m: float) -> Array:
    """Signed distance (m) of voxels beside a change of sign of the mean ratio; NaN elsewhere and at the border."""
    out = np.full(mean.shape, np.nan)
    for at in np.ndindex(*(n - 2 for n in mean.shape)):
        i = tuple(a + 1 for a in at)
        total = 0.0
        for axis in range(3):
            steps = []
            for side in (-1, 1):
                j = tuple(a + side * (k == axis) for k, a in enumerate(i))
                if (mean[j] > 0) != (mean[i] > 0):
                    steps.append(abs(mean[i]) / max(abs(mean[i]) + abs(mean[j]), 1e-20))
            if steps:
                total += 1 / max(min(steps) ** 2, 1e-8)
        if total:
            out[i] = voxel_m / np.sqrt(max(total, 1)) * (-1 if mean[i] > 0 else 1)
    return out


# ---- 4. evolution; phi in voxels ----


def heaviside(x: Array) -> Array:
    return 0.5 * (1 + np.tanh(0.5 * x))


def volumes(shape: tuple[int, ...]) -> Array:
    """What each voxel stands for: a half at a face of the volume, a quarter at an edge, an eighth at a corner."""
    out = np.ones(shape)
    for axis in range(3):
        for end in (0, -1):
            np.moveaxis(out, axis, 0)[end] *= 0.5
    return out


def potential(s: Array, printed: bool) -> Array:
    """Cost of a gradient of length s, (9) and (10)."""
    well = (1 - np.cos(2 * np.pi * s)) / (2 * np.pi) ** 2
    far = 0.5 * (s - 1) ** 2
    return far if printed else np.where(s < 1, well, far)


def diffusivity(s: Array, printed: bool) -> Array:
    """Slope of the potential over s."""
    far = 1 - 1 / np.maximum(s, 0.01)  # the direction of less is noise
    return far if printed else np.where(s < 1, np.sinc(2 * s), far)


def energy(phi: Array, a: Array, sigma_h: float, sigma_phi: float, printed: bool) -> float:
    """(8): minus the log posterior. Gradients by central differences, what they do not see by neighbours."""
    data = -(np.logaddexp(a, phi / sigma_h) - np.logaddexp(0, phi / sigma_h))
    s = np.linalg.norm(np.gradient(phi), axis=0)
    v = volumes(phi.shape)
    cost = float((v * (data + (potential(s, printed) - 0.5 * s**2) / sigma_phi**2)).sum())
    for axis in range(3):
        edges = np.diff(phi, axis=axis) ** 2
        across = volumes(phi.shape)
        np.moveaxis(across, axis, 0)[[0, -1]] *= 2  # an edge is as wide as the other two axes say
        lower = np.moveaxis(np.moveaxis(across, axis, 0)[:-1], 0, axis)
        cost += 0.5 * float((lower * edges).sum()) / sigma_phi**2
    return cost


def slope(phi: Array, a: Array, sigma_h: float, sigma_phi: float, printed: bool) -> Array:
    """d phi / d t of (11): minus the energy's derivative, per volume."""
    out = (heaviside(phi / sigma_h - a) - heaviside(phi / sigma_h)) / sigma_h
    g = np.gradient(phi)
    flux = (diffusivity(np.linalg.norm(g, axis=0), printed) - 1) * g
    for axis in range(3):
        p = np.moveaxis(np.pad(phi, 1, mode="reflect"), axis, 0)
        second = np.moveaxis(p[2:] - 2 * p[1:-1] + p[:-2], 0, axis)
        others = [slice(1, -1)] * 3
        others[axis] = slice(None)
        f = np.moveaxis(flux[axis], axis, 0)
        inner = np.concatenate([f[:1] + f[1:2], (f[2:] - f[:-2]) / 2, -f[-2:-1] - f[-1:]])
        out = out + (second[tuple(others)] + np.moveaxis(inner, 0, axis)) / sigma_phi**2
    return np.asarray(out)


def evolve(
    phi: Array,
    a: Array,
    steps: int,
    *,
    sigma_h: float = 4,
    sigma_phi: float = 3,
    dt: float = 1,
    printed: bool = False,
) -> Array:
    """`steps` explicit steps of (11)."""
    for _ in range(steps):
        phi = phi + dt * slope(phi, a, sigma_h, sigma_phi, printed)
    return phi
