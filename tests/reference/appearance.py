# SPDX-License-Identifier: MIT
"""Colour histograms and posteriors in plain numpy: the twin of cpp/appearance and cpp/tracking/color_evidence.

Derivation: docs/math/color.md.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.energies import Field

Array = NDArray[Any]

BINS = 16  # per channel
UNIFORM_SHARE = 1e-3
MIN_POSTERIOR = 0.02
BEHIND = 1.025  # a measurement this much farther than another at the same colour pixel is hidden from it
EDGE_PX, STEP_M = 2, 0.02
BAND_VOXELS, OFF_BANDS = 3, 3
FRONT_BANDS, FRONT_REACH_M, BESIDE_M, LOOKS_BEHIND = 1.5, 0.06, 0.006, 8  # of what stands in front
MAX_FRONT_SHARE, FRONT_MARGIN = 0.3, 1.5


def color_bin(color: Array) -> Array:
    """Number of the bin, (...,), of colours (..., 3) uint8."""
    r, g, b = np.moveaxis(np.asarray(color).astype(int) // (256 // BINS), -1, 0)
    return (r * BINS + g) * BINS + b


def smoothed(share: Array) -> Array:
    """1e-3 of a uniform distribution, then [1 2 1] / 4 along each axis of the cube, with mirrored ends."""
    cube = ((1 - UNIFORM_SHARE) * share + UNIFORM_SHARE / BINS**3).reshape(BINS, BINS, BINS)
    for axis in range(3):
        p = np.pad(np.moveaxis(cube, axis, 0), ((1, 1), (0, 0), (0, 0)), mode="edge")
        cube = np.moveaxis((p[:-2] + 2 * p[1:-1] + p[2:]) / 4, 0, axis)
    return cube.ravel()


def without_front(object_smooth: Array, front_share: Array) -> Array:
    """The object's smoothed histogram without the part that what stands in front of it has in it.

    Where the front's colours are a large part of it, the object has them itself, and nothing is taken out.
    """
    front = smoothed(front_share)
    there = np.flatnonzero(front_share > 0)
    ratio = object_smooth[there] / front[there]
    order = np.argsort(ratio, kind="stable")
    share = ratio[order][np.searchsorted(np.cumsum(front_share[there][order]), 0.5, side="right")]
    if share > MAX_FRONT_SHARE:
        return object_smooth
    left = np.maximum(object_smooth - FRONT_MARGIN * share * front, UNIFORM_SHARE / BINS**3)
    return left / left.sum()


def posterior(
    object_share: Array, background_share: Array, prior: float = 0.7, front_share: Array | None = None
) -> Array:
    """P_f of every bin: prior p_f / (prior p_f + (1 - prior) p_b) of the smoothed histograms, bounded."""
    f, b = smoothed(object_share), smoothed(background_share)
    if front_share is not None:
        f = without_front(f, front_share)
    return np.clip(prior * f / (prior * f + (1 - prior) * b), MIN_POSTERIOR, 1 - MIN_POSTERIOR)


def seen_by_color(color_px: Array, color_depth: Array, reach_px: float = 1.0) -> Array:
    """Which of N points the colour camera sees, from their pixels (N, 2) and depths there: every pair is tried."""
    out = np.ones(len(color_depth), bool)
    for i in range(len(out)):
        near = (np.abs(color_px - color_px[i]) <= reach_px).all(axis=1)
        out[i] = color_depth[i] < BEHIND * color_depth[near].min()
    return out


def near_a_step(depth: Array, u: int, v: int) -> bool:
    """Whether a measurement two pixels to one of the four sides is missing or 20 mm off."""
    for x, y in ((u - EDGE_PX, v), (u + EDGE_PX, v), (u, v - EDGE_PX), (u, v + EDGE_PX)):
        if not (0 <= x < depth.shape[1] and 0 <= y < depth.shape[0]):
            return True
        if not abs(depth[y, x] - depth[v, u]) < STEP_M:
            return True
    return False


def hides(field: Field, p_cam: Array, phi: float, voxel_size: float) -> bool:
    """Whether the surface lies behind a point, on the camera's ray through it or a little beside."""
    direction, way = p_cam / np.linalg.norm(p_cam), phi
    for _ in range(LOOKS_BEHIND):
        if way >= FRONT_REACH_M:
            return False
        phi = field.row(p_cam + way * direction).phi
        if phi < voxel_size + BESIDE_M:
            return True
        way += phi
    return False


def count_colors(
    depth: Array,
    color: Array,
    K: Array,
    field: Field,
    voxel_size: float,
    region: tuple[int, int, int, int],
    plain: bool = False,
) -> tuple[Array, Array, Array]:
    """Counts per bin on the surface, clearly off it and in front, of an aligned pair, over pixels (x0, y0, x1, y1).

    On the surface: |phi| within three voxels, no depth step beside; off it: phi above nine; in front: phi above 4.5,
    and the surface behind it on its ray, within 60 mm. `plain`: on the surface or farther (thesis, section 4.4.3).
    """
    fx, fy, cx, cy = K
    on, off, front = np.zeros(BINS**3), np.zeros(BINS**3), np.zeros(BINS**3)
    band = BAND_VOXELS * voxel_size
    for v in range(region[1], region[3]):
        for u in range(region[0], region[2]):
            z = float(depth[v, u])
            if not z > 0:
                continue
            p_cam = z * np.array([(u - cx) / fx, (v - cy) / fy, 1])
            phi = field.row(p_cam).phi
            if plain:
                if phi >= -band:
                    (on if phi <= band else off)[color_bin(color[v, u])] += 1
                continue
            if abs(phi) <= band and not near_a_step(depth, u, v):
                on[color_bin(color[v, u])] += 1
            elif phi > OFF_BANDS * band:
                off[color_bin(color[v, u])] += 1
            if phi > FRONT_BANDS * band and hides(field, p_cam, phi, voxel_size):
                front[color_bin(color[v, u])] += 1
    return on, off, front
