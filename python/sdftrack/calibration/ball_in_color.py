# SPDX-License-Identifier: MIT
"""Sub-pixel detection of a coloured ball's outline in a colour image, and the image of its centre.

The tangent rays of a sphere form a circular cone, so its centre follows from a cone fitted to the outline's rays, not
from the outline's centroid (docs/math/color_to_depth.md, eq. 6 to 9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.cone import Cone, fit_cone
from sdftrack.camera import Camera

Array = NDArray[np.float64]
MIN_RADIUS_PX = 5.0
MIN_EDGES = 16
MIN_ARC = 0.35  # of the circumference; half a circle still fixes its centre
MAX_RMS_PX = 1.0
MAX_REACH_PX, SPARE_PX = 8.0, 1.5  # of a profile to each side; beyond half the width of the edge
GATES_PX = (3.0, 1.5, 1.0)  # of edges around the fitted outline, round by round


@dataclass(frozen=True, eq=False)
class Outline:
    """Edges (N, 2) px of a ball's outline consistent with a cone, their rms and mean radius (px), visible fraction."""

    edges_px: Array
    rms_px: float
    radius_px: float
    arc: float

    def cone(self, camera: Camera) -> Cone | None:
        """Axis and opening of the cone of tangent rays under `camera`."""
        return fit_cone(self.edges_px, camera)


def find_outlines(
    color: NDArray[np.uint8], likeness: NDArray[np.float32], camera: Camera, seed: int = 0, most: int = 3
) -> list[Outline]:
    """Find round regions of the ball's colour, the best first.

    Parameters
    ----------
    color : (h, w, 3) uint8 RGB
    likeness : (h, w) float32
        0 to 1: likelihood that the pixel shows the ball (:mod:`sdftrack.calibration.ball_color`), or a mask.
    camera : Camera
        The colour camera, or an estimate: only used to predict the outline around which edges are searched.
    seed : int
        Seed of the random samples for the initial circle.
    most : int
        Maximum number of blobs examined.

    Returns
    -------
    list of Outline
    """
    import cv2

    mask = (likeness > 0.5).astype(np.uint8)
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(opened)
    areas = stats[1:, cv2.CC_STAT_AREA]
    smooth = color.astype(np.float32)
    found = []
    for k in 1 + np.argsort(-areas, kind="stable")[:most]:
        if stats[k, cv2.CC_STAT_AREA] < 0.4 * np.pi * MIN_RADIUS_PX**2:
            break
        x, y, w, h = stats[k, :4]
        part = (labels[y : y + h, x : x + w] == k).astype(np.uint8)
        contours, _ = cv2.findContours(part, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        border = max(contours, key=len)[:, 0].astype(np.float64) + np.array([x, y])
        start = _circle(border, np.random.default_rng([seed, int(k)]))
        outline = None if start is None else _refined(smooth, *start, camera)
        if outline is not None:
            found.append(outline)
    return sorted(found, key=lambda o: -o.arc * o.radius_px)


def _circle(border: Array, rng: np.random.Generator, tries: int = 60) -> tuple[Array, float] | None:
    """The circle that fits most of a blob's border, robust to occlusion by a hand."""
    n = len(border)
    if n < 12:
        return None
    best, support = None, 0.0
    for _ in range(tries):
        a, b, c = border[rng.choice(n, 3, replace=False)]
        M = 2 * np.array([b - a, c - a])
        if abs(np.linalg.det(M)) < 1.0:
            continue
        centre = np.linalg.solve(M, [b @ b - a @ a, c @ c - a @ a])
        radius = float(np.linalg.norm(a - centre))
        if not MIN_RADIUS_PX - 1 <= radius <= 0.6 * n:
            continue
        # Near sides of a blurred outline are flatter than a circle: a generous band.
        agree = np.mean(np.abs(np.linalg.norm(border - centre, axis=1) - radius) < max(1.2, 0.06 * radius))
        if agree > support:
            best, support = (centre, radius), float(agree)
    return best if support > 0.4 else None


def _refined(image: NDArray[np.float32], centre: Array, radius: float, camera: Camera) -> Outline | None:
    angle = np.linspace(0, 2 * np.pi, int(np.clip(6 * radius, 48, 400)), endpoint=False)
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    at = centre + (radius + 0.5) * normal
    kept = at[:0]
    rms = np.inf
    reach = np.full(len(angle), float(np.clip(0.35 * radius, 2.5, MAX_REACH_PX)))
    for gate in GATES_PX:
        found = edges_along(image, at, normal, reach)
        edges = found.at[found.sure]
        if len(edges) < MIN_EDGES:
            return None
        # No farther from the edge than its blur asks for: the surroundings vary.
        reach = np.clip(
            0.5 * _along(found.width_px, found.sure) + SPARE_PX,
            SPARE_PX,
            min(MAX_REACH_PX, 0.4 * radius + 0.5),
        )
        cone = fit_cone(edges, camera)
        for _ in range(3):  # edges of the wand and the hand lie off the outline
            if cone is None:
                return None
            off = np.abs(cone.residuals_px(edges, camera))
            limit = max(gate * 0.5, min(gate, 3 * 1.4826 * float(np.median(off))))
            kept = edges[off < limit]
            if len(kept) < MIN_EDGES:
                return None
            cone = fit_cone(kept, camera)
        if cone is None:
            return None
        at, normal, radius = cone.outline(camera, len(angle))
        if not np.isfinite(at).all() or radius < MIN_RADIUS_PX:
            return None
        rms = float(np.sqrt(np.mean(cone.residuals_px(kept, camera) ** 2)))
    centre_px = at.mean(axis=0)
    sector = np.floor((np.arctan2(*(kept - centre_px).T[::-1]) + np.pi) / (2 * np.pi) * 36).astype(int)
    arc = len(np.unique(np.clip(sector, 0, 35))) / 36
    if arc < MIN_ARC or rms > MAX_RMS_PX:
        return None
    return Outline(kept, rms, radius, arc)


def _along(width: Array, sure: NDArray[np.bool_]) -> Array:
    """Median width of the reliable edges in a sector around each edge, because blur depends on the direction."""
    n = len(width)
    half = max(2, n // 24)
    around = (np.arange(n)[:, None] + np.arange(-half, half + 1)) % n
    values = np.where(sure, width, np.nan)[around]
    known = np.isfinite(values).any(axis=1)
    out = np.full(n, float(np.median(width[sure])))
    out[known] = np.nanmedian(values[known], axis=1)
    return out


# -- Sub-pixel edges between an object of uniform colour and its surroundings


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
