# SPDX-License-Identifier: MIT
"""The first segmentation of a box, from colours, the place in the box and the edges of the image (docs/math/contour.md,
section 5)."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.contour.masks import overlap

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Array = NDArray[np.float32]

PRIOR_SLOPE = 2.0  # log odds of the object per half a box away from the box's middle
PRIOR_RADIUS = 0.9  # half boxes from the middle, where the place says nothing
ROUNDS = 6
MOST_PX = 160  # a longer side of the box is examined at a lower resolution
RING = 0.3  # of the longer side of the box, around it
MIN_RING_PX = 12
EDGE_RADIUS_PX = 3
EDGE_RADIUS = 1 / 18  # at most, of the longer side of the box
EDGE_VARIANCE = 0.01  # of the brightness (0 to 1): across a lesser edge the mean is a plain one
LEAST_PART = 0.02  # of the largest piece
MIN_PIXELS = 30
SHIFTS = (-0.05, 0.05)  # of the box, by which a first mask is tested
LEAST_POSTERIOR = 0.018


def segment_box(
    image: Image, box: tuple[int, int, int, int], guess: Mask, options: dict[str, Any]
) -> Mask | None:
    """The object in a box (x0, y0, x1, y1), from a guess by its colours; None where next to nothing remains.

    The colours are learned anew in each round, from what the last one called the object and what it did not.
    """
    rows, columns, inner = _surroundings(box, image.shape[:2])
    part, mask = np.ascontiguousarray(image[rows, columns]), guess[rows, columns]
    scale = min(1.0, MOST_PX / max(box[2] - box[0], box[3] - box[1]))
    small = _resized(part, scale), _resized(mask.view(np.uint8), scale) > 0
    found = _rounds(*small, np.multiply(inner, scale), options)
    if found is None:
        return None
    out = np.zeros(image.shape[:2], bool)
    there = cv2.resize(found.astype(np.float32), part.shape[1::-1]) > 0.5
    x0, y0, x1, y1 = inner
    out[box[1] : box[3], box[0] : box[2]] = there[y0:y1, x0:x1]
    return out if np.count_nonzero(out) >= MIN_PIXELS else None


def first_instability(
    image: Image, box: tuple[int, int, int, int], first: Mask, options: dict[str, Any]
) -> float:
    """1 less the mean IoU of the first mask and those of the box shifted a little: how little it is determined."""
    core = _core.ContourCore(options)
    height, width = image.shape[:2]
    found = []
    for shift in SHIFTS:
        dx, dy = round(shift * (box[2] - box[0])), round(shift * (box[3] - box[1]))
        x0, x1 = np.clip([box[0] + dx, box[2] + dx], 0, width).tolist()
        y0, y1 = np.clip([box[1] + dy, box[3] + dy], 0, height).tolist()
        try:
            found.append(overlap(first, start_in_box(core, image, (x0, y0, x1, y1), options).mask))
        except ValueError:  # there is no object by its colours
            found.append(0.0)
    return 1 - float(np.mean(found))


def start_in_box(
    core: _core.ContourCore, image: Image, box: tuple[int, int, int, int], options: dict[str, Any]
) -> _core.ContourFrame:
    """Start with a box; ValueError, and nothing changed, where its colours are those around it."""
    frame = core.start_box(image, *box)
    mask = segment_box(image, box, frame.mask, options) if options["box_start"] == "place" else None
    if mask is None:
        return frame
    try:
        return core.start_mask(image, mask)
    except ValueError:  # scattered pixels: the start by colours stays
        return frame


def _rounds(image: Image, mask: Mask, box: NDArray[np.float64], options: dict[str, Any]) -> Mask | None:
    prior, within = place_log_odds(image.shape[:2], box)
    gray = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.float32) / np.float32(255)
    height, width = gray.shape
    warp = [1.0, 0.0, 0.0, 1.0, (width - 1) / 2, (height - 1) / 2]
    radius = max(1, min(EDGE_RADIUS_PX, round(EDGE_RADIUS * float(max(box[2] - box[0], box[3] - box[1])))))
    for _ in range(ROUNDS):
        phi = np.where(mask, np.float32(-0.5), np.float32(0.5))
        if not MIN_PIXELS <= np.count_nonzero(mask) <= mask.size - MIN_PIXELS:
            return None
        p = np.clip(
            _core.contour_posterior(image, image, phi, warp, options), LEAST_POSTERIOR, 1 - LEAST_POSTERIOR
        )
        chance = p / (p + (1 - p) * np.exp(-prior))
        mean = edge_aware_mean(gray, np.asarray(chance, np.float32), radius)
        mask = without_specks(within & (mean > 0.5))
    return mask


def place_log_odds(shape: tuple[int, ...], box: NDArray[np.float64]) -> tuple[Array, Mask]:
    """Log odds that a pixel is the object's by its place in the box, and the pixels of the box.

    What touches the sides of a tight box seldom fills its corners.
    """
    x0, y0, x1, y1 = box
    y, x = np.indices(shape, np.float32)
    away_x, away_y = (2 * x + 1 - x0 - x1) / (x1 - x0), (2 * y + 1 - y0 - y1) / (y1 - y0)
    within = np.maximum(np.abs(away_x), np.abs(away_y)) < 1
    return np.asarray(PRIOR_SLOPE * (PRIOR_RADIUS - np.hypot(away_x, away_y)), np.float32), within


def edge_aware_mean(gray: Array, values: Array, radius_px: int) -> Array:
    """The guided filter (He, Sun and Tang, ECCV 2010): a local mean that does not cross the edges of `gray`."""

    def mean(a: Array) -> Array:
        return np.asarray(cv2.blur(a, (2 * radius_px + 1,) * 2), np.float32)

    m_gray, m_values = mean(gray), mean(values)
    slope = (mean(gray * values) - m_gray * m_values) / (mean(gray * gray) - m_gray**2 + EDGE_VARIANCE)
    return np.asarray(mean(slope) * gray + mean(m_values - slope * m_gray), np.float32)


def without_specks(mask: Mask) -> Mask:
    """The pieces that are not tiny beside the largest."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    areas = stats[:, cv2.CC_STAT_AREA].copy()
    areas[0] = 0
    return np.asarray(((areas > 0) & (areas >= LEAST_PART * areas.max()))[labels])


def _surroundings(
    box: tuple[int, int, int, int], shape: tuple[int, ...]
) -> tuple[slice, slice, tuple[int, int, int, int]]:
    """Rows and columns of the box and what is around it, and the box in that part."""
    x0, y0, x1, y1 = box
    ring = max(MIN_RING_PX, round(RING * max(x1 - x0, y1 - y0)))
    top, left = max(0, y0 - ring), max(0, x0 - ring)
    rows, columns = slice(top, min(shape[0], y1 + ring)), slice(left, min(shape[1], x1 + ring))
    return rows, columns, (x0 - left, y0 - top, x1 - left, y1 - top)


def _resized(image: Image, scale: float) -> Image:
    if scale == 1:
        return image
    size = (max(8, round(scale * image.shape[1])), max(8, round(scale * image.shape[0])))
    return np.ascontiguousarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
