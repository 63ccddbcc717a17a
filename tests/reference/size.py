# SPDX-License-Identifier: MIT
"""What a frame says of an object's size and form, in plain numpy: the twin of cpp/tracking/size.

Unknowns x: the increment (v, w) of T_obj_cam (6), the log scale about the frame's origin, the six smooth modes of the
sensor's error (systematic.py), five strains about the middle of the surface. A row is the derivative of a pixel's depth
by them, d z / d x = -(d phi / d x) / (d phi / d z), e the measured depth less that of the hit: x is where
sum_i w_i (e_i - row_i x)^2 + x^T P x is least, w_i = share_i / (size^2 + (e_i - row_i x)^2) of the x before.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference.energies import ScaledObject
from reference.outline import outline_residuals
from reference.systematic import GRAZING, SHARES, modes

Array = NDArray[Any]

PIXELS, LEAST_PIXELS, LEAST_LINES = 300, 60, 30
FAR_M = 0.03
BLOCKS, BLOCKS_REACH = 6, 2.0
FIRST_SIZE, SIZE = 6.0, 2.5  # over the noise
GRAIN = 0.04  # voxels
ROUNDS, STRAIN_ROUNDS, NEWTON_STEPS = 3, 2, 2
LEAST_SYSTEMATIC_M = 1.5e-4
DIFFERS_SD, EXPLAINED = 3, 0.5
SAYS, STRAIN_SAYS, MOST_STRETCH = 0.015, 0.06, 0.7
LOG_SCALE, NO_STRAIN, ALL = 6, 13, 18
# Symmetric matrices of trace 0 and norm 1.
STRAINS = np.zeros((5, 3, 3))
STRAINS[:2] = np.diag([1, -1, 0]) / np.sqrt(2), np.diag([1, 1, -2]) / np.sqrt(6)
for k, (i, j) in enumerate([(0, 1), (0, 2), (1, 2)]):
    STRAINS[2 + k, [i, j], [j, i]] = np.sqrt(0.5)


class View(NamedTuple):
    """A volume about the centre of its box, the diagonal of that, the mean of points on its surface; pixels of it."""

    values: Array
    voxel_size: float
    origin: Array
    diameter: float
    middle: Array
    pixels: Array  # u, v, depth, chance of the object by colour, hit, gain
    K: Array
    prior: float  # of the colours; 0: they say nothing


class Readings(NamedTuple):
    rows: Array
    errors: Array
    shares: Array
    blocks: Array


class Fit(NamedTuple):
    x: Array
    left: Array  # e - row x
    weights: Array
    C: Array
    P: Array


def increment(x: Array) -> Array:
    """(v, w) as a motion: the turn has the modified Rodrigues parameters w / 4, a Cayley transform twice."""
    W, T = np.cross(np.eye(3), x[3:6] / 4), np.eye(4)
    T[:3, :3] = np.linalg.matrix_power((np.eye(3) + W) @ np.linalg.inv(np.eye(3) - W), 2)
    T[:3, 3] = x[:3]
    return T


def read(view: View, T_obj_cam: Array, log_scale: float = 0.0, newton_steps: int = 0) -> Readings:
    """Of every so many-th pixel, from its hit on by so many steps."""
    field, (fx, fy, cx, cy) = ScaledObject(*view[:3], T_obj_cam, log_scale), view.K
    shown = view.pixels[:: max(1, len(view.pixels) // PIXELS)].astype(float)
    shown = shown[shown[:, 5] == 0]
    smooth = modes(shown[:, 0], shown[:, 1])
    cells = np.floor((smooth[:, 1:3] + BLOCKS_REACH) * BLOCKS / (2 * BLOCKS_REACH)).clip(0, BLOCKS - 1)
    found = []
    for (u, v, depth, chance, hit, _), mode, cell in zip(shown, smooth, cells, strict=True):
        ray = np.array([(u - cx) / fx, (v - cy) / fy, 1])
        phi, grad, J = field.row(hit * ray)
        for _ in range(newton_steps):
            if abs(grad @ ray) <= GRAZING:
                break
            hit -= phi / (grad @ ray)
            phi, grad, J = field.row(hit * ray)
        slope = grad @ ray
        if abs(slope) <= GRAZING or abs(depth - hit) >= FAR_M:
            continue
        q = T_obj_cam[:3, :3] @ (hit * ray) + T_obj_cam[:3, 3] - view.middle
        J[LOG_SCALE] -= phi  # at the hit
        row = np.concatenate([-J / slope, mode, STRAINS @ q @ J[:3] / slope])
        found.append((row, depth - hit, min(1.0, chance / view.prior) if view.prior > 0 else 1.0, cell))
    return Readings(*map(np.array, zip(*found, strict=True)))


def spread(left: Array) -> float:
    return float(np.sort(np.abs(left))[len(left) // 2]) / 0.6745


def solve(r: Readings, view: View, noise: float, systematic: float, n: int, left: Array | None = None) -> Fit:
    """The first n unknowns. By the residuals `left` so far: a sensor that leaves more than noise bends more."""
    size = FIRST_SIZE * noise
    if left is not None:
        size = SIZE * max(noise, spread(left))
        systematic = max(systematic, 3 * np.sqrt(max(0.0, spread(left) ** 2 - (1.3 * noise) ** 2)))
    bent = SHARES * max(systematic, LEAST_SYSTEMATIC_M)
    P = np.diag(np.array([view.diameter] * 3 + [np.pi] * 3 + [1.0, *bent] + [1.0] * 5)[:n] ** -2)
    weights = r.shares / (size**2 + (r.errors if left is None else left) ** 2)
    rows = r.rows[:, :n]
    C = np.linalg.inv(rows.T @ np.diag(weights) @ rows + P)
    x = C @ rows.T @ (weights * r.errors)
    return Fit(x, r.errors - rows @ x, weights, C, P)


def variances(r: Readings, fit: Fit, some: list[int], unknowns: int) -> tuple[Array, Array]:
    """The sandwich of some unknowns, residuals within a block of the image taken as one error; that of P."""
    along, n = fit.C[:, some], len(np.unique(r.blocks, axis=0))
    pulls = (fit.weights * fit.left)[:, None] * r.rows[:, : len(along)] @ along
    sums = np.array([pulls[(r.blocks == b).all(axis=1)].sum(axis=0) for b in np.unique(r.blocks, axis=0)])
    return (n / (n - unknowns) if n > 2 * unknowns else 2) * sums.T @ sums, along.T @ fit.P @ along


def size_by_depth(view: View, T_obj_cam: Array, noise: float, systematic: float) -> tuple[Any, ...] | None:
    """Log scale, variance by errors of this frame and by lasting ones, increment that follows it, what it leaves."""
    r, log_scale, bends = read(view, T_obj_cam), 0.0, False
    at_first = max(noise, spread(r.errors))
    left = solve(r, view, noise, systematic, NO_STRAIN).left
    for k in range(ROUNDS):
        if len(r.errors) < LEAST_PIXELS:
            return None
        fit = solve(r, view, noise, systematic, NO_STRAIN, left)
        left, found = fit.left, log_scale + float(fit.x[LOG_SCALE])
        own, shared = (c[0, 0] for c in variances(r, fit, [LOG_SCALE], 7))
        alone = np.linalg.inv(np.linalg.inv(fit.C)[:7, :7])[LOG_SCALE, LOG_SCALE]  # beside the pose
        shared += (GRAIN * view.voxel_size) ** 2 * fit.weights.sum() * alone
        sd = np.sqrt(own + shared)
        differs = abs(found) > DIFFERS_SD * sd
        bends = bends or sd > SAYS
        if not differs and (sd > SAYS or k > 0):
            break
        if differs and k + 1 < ROUNDS:  # again at that pose and size
            T_obj_cam, log_scale = increment(fit.x) @ T_obj_cam, found
            r = read(view, T_obj_cam, log_scale, NEWTON_STEPS)
            left = r.errors
    unexplained = spread(left) / at_first
    if sd > SAYS or (bends and unexplained > EXPLAINED):
        return None
    return found, own, shared, fit.C[:6, LOG_SCALE] / fit.C[LOG_SCALE, LOG_SCALE], unexplained


def strain_by_depth(view: View, T_obj_cam: Array, noise: float, systematic: float) -> tuple[Any, ...] | None:
    """Strain, its covariances as above; the axis along which it is largest, the log stretch there, its sd."""
    r = read(view, T_obj_cam)
    fit = solve(r, view, noise, systematic, ALL)
    for _ in range(STRAIN_ROUNDS):
        fit = solve(r, view, noise, systematic, ALL, fit.left)
    some = list(range(NO_STRAIN, ALL))
    own, shared = variances(r, fit, some, 12)
    shared += (GRAIN * view.voxel_size) ** 2 * fit.weights.sum() * fit.C[np.ix_(some, some)]
    values, axes = np.linalg.eigh(np.tensordot(fit.x[some], STRAINS, 1))
    axis = axes[:, np.argmax(np.abs(values))]
    # A log stretch s along the axis is the strain s (axis axis^T - 1 / 3).
    to_stretch = 1.5 * STRAINS @ axis @ axis
    stretch, sd = to_stretch @ fit.x[some], np.sqrt(to_stretch @ (own + shared) @ to_stretch)
    if len(r.errors) < LEAST_PIXELS or sd >= STRAIN_SAYS or abs(stretch) > MOST_STRETCH:
        return None
    return fit.x[some], own, shared, axis, stretch, sd


def look_by_outline(
    lines: Array,
    K: Array,
    T_obj_cam: Array,
    noise: float,
    to_depth: Array,
    shared_lines: float,
    middle: Array,
) -> tuple[Any, ...] | None:
    """By rows of (X, Y, Z, centre, normal, offset, sd) at a pinhole: pose, log scale, an offset (px) of all lines.

    The distance along the camera's axis is that of depth, `to_depth` from here, to 1 %; the offset is 0 to 0.5 px.
    Then the normal equations of strains about `middle`, with the others eliminated.
    """

    def off(x: Array) -> Array:
        strained = (lines[:, :3] - middle) @ np.tensordot(x[8:], STRAINS, 1)
        larger = np.column_stack([np.exp(x[6]) * lines[:, :3] + strained, lines[:, 3:]])
        off_px = outline_residuals(larger, K, np.linalg.inv(increment(x) @ T_obj_cam))
        return (off_px + x[7]) / (noise * lines[:, 8])

    at, rows = off(np.zeros(13)), np.stack([(off(h) - off(-h)) / 2e-5 for h in 1e-5 * np.eye(13)], axis=1)
    weights = 1 / (1 + at**2 / 2) / shared_lines
    along, hold = np.append(T_obj_cam[:3, 2], np.zeros(10)), (0.01 * np.linalg.inv(T_obj_cam)[2, 3]) ** -2
    P = hold * np.outer(along, along) + np.diag([1e-3] * 6 + [1, 0.5**-2] + [0] * 5)
    H, g = (
        rows.T @ np.diag(weights) @ rows + P,
        hold * along * (along[:6] @ to_depth) - rows.T @ (weights * at),
    )
    C, beside = np.linalg.inv(H[:8, :8]), H[8:, :8]
    if len(lines) < LEAST_LINES:
        return None
    size = ((C @ g[:8])[6], 0, C[6, 6], C[:6, 6] / C[6, 6])
    return *size, H[8:, 8:] - beside @ C @ beside.T, g[8:] - beside @ C @ g[:8]
