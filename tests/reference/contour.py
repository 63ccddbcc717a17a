# SPDX-License-Identifier: MIT
"""The contour tracker in plain numpy: posteriors, registration and shape steps (docs/math/contour.md).

Slow and obvious; the tests compare the core with it. A warp is (A, t): ``p_image = A X + t`` with X in cells from the
middle of the grid. phi is in cells, negative inside.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
UNIFORM = 1e-2  # share of a uniform distribution in the shared histograms
MIN_MIXTURE = 1e-6
BRIDGED = 8
PSEUDO_COUNT = 0.05


def sample(phi: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Bilinear value at columns x and rows y with its exact derivatives; beyond the grid the border goes on."""
    ny, nx = phi.shape
    cx, cy = np.clip(x, 0, nx - 1), np.clip(y, 0, ny - 1)
    ix, iy = np.minimum(cx.astype(int), nx - 2), np.minimum(cy.astype(int), ny - 2)
    fx, fy = cx - ix, cy - iy
    a, b, c, d = phi[iy, ix], phi[iy, ix + 1], phi[iy + 1, ix], phi[iy + 1, ix + 1]
    top, bottom = a + fx * (b - a), c + fx * (d - c)
    gx = np.where((x >= 0) & (x <= nx - 1), (1 - fy) * (b - a) + fy * (d - c), 0)
    gy = np.where((y >= 0) & (y <= ny - 1), bottom - top, 0)
    return top + fy * (bottom - top), gx, gy


def inside_at(phi: Array, softness: float) -> Array:
    """H_in = 1 / (1 + e^(phi / s))."""
    return np.asarray(1 / (1 + np.exp(np.clip(phi / softness, -80, 80))))


def posterior_cost(phi: Array, foreground: Array, softness: float) -> tuple[Array, Array, Array]:
    """-log f, its slope in phi, and the Gauss-Newton weight."""
    H = inside_at(phi, softness)
    f = np.maximum(H * foreground + (1 - H) * (1 - foreground), MIN_MIXTURE)
    gamma = H * foreground / f
    return -np.log(f), (gamma - H) / softness, H * (1 - H) / softness**2


def shape_step(
    phi: Array,
    foreground: Array,
    softness: float = 1.5,
    dt: float = 4.0,
    mu: float = 0.05,
    tension: float = 1.0,
    band: float = 8.0,
    steps: int = 1,
) -> Array:
    """phi after steps of the level set on the cells within `band` of the outline, but for the border."""
    near = _band(phi, band)
    out = np.array(phi, np.float64)
    for _ in range(steps):
        p = np.pad(out, 1, mode="edge")
        west, east, north, south = p[1:-1, :-2], p[1:-1, 2:], p[:-2, 1:-1], p[2:, 1:-1]
        gx, gy = (east - west) / 2, (south - north) / 2
        xx, yy = east - 2 * out + west, south - 2 * out + north
        xy = (p[2:, 2:] - p[2:, :-2] - p[:-2, 2:] + p[:-2, :-2]) / 4
        square = np.maximum(gx * gx + gy * gy, 1e-4)
        curvature = (xx * gy * gy - 2 * xy * gx * gy + yy * gx * gx) / square**1.5
        slope = posterior_cost(out, foreground, softness)[1]
        out = np.where(near, out + dt * (mu * (xx + yy - (1 - tension) * curvature) - slope), out)
    return out


def _band(phi: Array, band: float) -> NDArray[np.bool_]:
    """Cells within the band but for the border, and gaps of fewer than BRIDGED cells between two of a row."""
    near = np.abs(phi) <= band
    near[[0, -1]] = near[:, [0, -1]] = False
    for row in near:
        at = np.flatnonzero(row)
        for a, b in itertools.pairwise(at):
            if b - a - 1 < BRIDGED:
                row[a:b] = True
    return near


def opinions(before: Array, new: Array, rate: float, pool: str = "linear") -> Array:
    """Counts after a frame: the linear opinion pool, or the logarithmic one with PSEUDO_COUNT added to both."""
    if pool == "linear":
        return np.asarray((1 - rate) * before + rate * new)
    mixed = (before + PSEUDO_COUNT) ** (1 - rate) * (new + PSEUDO_COUNT) ** rate - PSEUDO_COUNT
    return np.asarray(np.where((before > 0) | (new > 0), np.maximum(mixed, 0), before))


def posterior(
    learned: NDArray[np.uint8],
    image: NDArray[np.uint8],
    phi: Array,
    A: Array,
    t: Array,
    bins: int = 16,
    windows: int = 6,
    shrink: float = 50.0,
    least: float = 0.018,
    pooled: Sequence[NDArray[np.uint8]] = (),
    pool: str = "linear",
    object_rate: float = 0.02,
    background_rate: float = 0.2,
) -> Array:
    """(H, W) posteriors of `image` by the windows' histograms of `learned`; one half off the grid.

    The images of `pooled`, of the size of `learned`, are pooled in one after the other at these rates.
    """
    height, width = learned.shape[:2]
    v, u = np.mgrid[:height, :width]
    X = np.linalg.inv(A) @ (np.stack([u.ravel(), v.ravel()]) - np.asarray(t)[:, None])
    gx, gy = X[0] + (phi.shape[1] - 1) / 2, X[1] + (phi.shape[0] - 1) / 2
    on = (gx >= 0) & (gy >= 0) & (gx <= phi.shape[1] - 1.001) & (gy <= phi.shape[0] - 1.001)
    gx, gy = gx[on], gy[on]
    object_ = phi[(gy + 0.5).astype(int), (gx + 0.5).astype(int)] < 0
    K = max(2, windows)
    wx, wy = gx * (K - 1) / (phi.shape[1] - 1), gy * (K - 1) / (phi.shape[0] - 1)
    ix, iy = np.minimum(wx.astype(int), K - 2), np.minimum(wy.astype(int), K - 2)
    corners = [
        ((iy + dy) * K + ix + dx, (wx - ix if dx else 1 - wx + ix) * (wy - iy if dy else 1 - wy + iy))
        for dy in (0, 1)
        for dx in (0, 1)
    ]

    def bin_of(picture: NDArray[np.uint8]) -> NDArray[np.int64]:
        q = picture.reshape(-1, 3)[on].astype(np.int64) * bins // 256
        return np.asarray((q[:, 0] * bins + q[:, 1]) * bins + q[:, 2])

    def counts_of(colors: NDArray[np.int64], kind: NDArray[np.bool_]) -> Array:
        counts = np.zeros((K * K, bins**3))
        for window, weight in corners:
            np.add.at(counts, (window[kind], colors[kind]), weight[kind])
        return counts

    seen, asked = [bin_of(picture) for picture in (learned, *pooled)], bin_of(image)
    mixture = []
    for kind, rate in ((object_, object_rate), (~object_, background_rate)):
        counts = counts_of(seen[0], kind)
        for colors in seen[1:]:
            counts = opinions(counts, counts_of(colors, kind), rate, pool)
        whole = (1 - UNIFORM) * counts.sum(0) / counts.sum() + UNIFORM / bins**3
        shares = (counts + shrink * whole) / (counts.sum(1, keepdims=True) + shrink)
        if windows < 2:
            shares = np.broadcast_to(whole, counts.shape)
        mixture.append(sum(weight * shares[window, asked] for window, weight in corners))
    known = np.isin(asked, np.concatenate(seen))  # a colour that was never seen says nothing
    out = np.full(height * width, 0.5)
    out[on] = np.where(known, np.clip(mixture[0] / (mixture[0] + mixture[1]), least, 1 - least), 0.5)
    return out.reshape(height, width)
