# SPDX-License-Identifier: MIT
"""Sub-pixel edges between an object of uniform colour and its surroundings.

docs/math/color_to_depth.md, eq. 9.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Edges", "edges_along"]

Array = NDArray[np.float64]
STEP_PX = 0.5  # between the samples of a profile
SIDE = 4  # samples beyond the reach on each side, whose mean is the side's colour
MIN_CONTRAST = 18.0  # grey values between the two sides of an edge


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges (N, 2) px, whether each profile is an edge's (N,), its width (N,) px, the colour inside (N, 3)."""

    at: Array
    sure: NDArray[np.bool_]
    width_px: Array
    inner: Array


def edges_along(image: NDArray[np.float32], at: Array, normal: Array, reach_px: Array) -> Edges:
    """Find edges along outward normals.

    Coverage is measured along the colour direction in which the two sides differ but which is insensitive to the
    brightness of the inner colour, so that shading does not move edges (eq. 9). The edge position is the sum of
    coverage.

    Parameters
    ----------
    image : (h, w, 3) float32
    at : (N, 2) px
        Approximate locations of the edges.
    normal : (N, 2) unit vectors, pointing out of the object
    reach_px : (N,)
        Maximum distance of the edge and its blur from `at` on each side.
    """
    import cv2

    n = np.rint(reach_px / STEP_PX)[:, None]
    k = np.arange(-int(n.max()) - SIDE, int(n.max()) + SIDE + 1)[None, :]
    points = (at[:, None] + STEP_PX * k[..., None] * normal[:, None]).astype(np.float32)
    profile = cv2.remap(
        image,
        points[..., 0],
        points[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(-1e4,) * 3,
    ).astype(np.float64)
    inner = _mean(profile, (k <= -n) & (k >= -n - SIDE))
    outer = _mean(profile, (k >= n) & (k <= n + SIDE))
    unit = inner / np.maximum(np.linalg.norm(inner, axis=1), 1e-9)[:, None]
    w = (inner - outer) - np.einsum("nk,nk->n", inner - outer, unit)[:, None] * unit
    plain = np.linalg.norm(w, axis=1) < MIN_CONTRAST  # a dark or alike background: brightness itself
    w[plain] = (inner - outer)[plain]
    strength = np.linalg.norm(w, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cover = np.einsum("nsk,nk->ns", profile - outer[:, None], w)
        cover /= np.einsum("nk,nk->n", inner - outer, w)[:, None]
    # The whole samples between the sides, and half a step of the last covered one.
    covered = STEP_PX * (np.where(np.abs(k) < n, cover, 0).sum(axis=1) + 0.5)
    edges = at + (covered - STEP_PX * n[:, 0])[:, None] * normal
    width = STEP_PX * ((np.abs(k) < n) & (np.abs(cover - 0.5) < 0.4)).sum(axis=1)
    # In the image, two sides that differ, full inside and empty outside, falling in between.
    level = 0.3 + 12.0 / np.maximum(strength, 1.0)
    sure = (profile.min(axis=(1, 2)) > -1) & (strength > MIN_CONTRAST)
    sure &= np.where((k <= 1 - n) & (k >= -n - SIDE), np.abs(cover - 1), 0).max(axis=1) < level
    sure &= np.where((k >= n - 1) & (k <= n + SIDE), np.abs(cover), 0).max(axis=1) < level
    sure &= (covered > 0) & (covered < 2 * STEP_PX * n[:, 0])
    return Edges(edges, sure, width, inner)


def _mean(profile: Array, chosen: NDArray[np.bool_]) -> Array:
    m: Array = (profile * chosen[..., None]).sum(axis=1) / chosen.sum(axis=1)[:, None]
    return m
