# SPDX-License-Identifier: MIT
"""Colour model of the ball: a chromaticity histogram, learned from a given colour or from moving pixels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import numbers

Array = NDArray[np.float64]
BINS = 48  # of r / (r + g + b) and of g / (r + g + b): shading moves no pixel to another bin
DARKEST = 45  # r + g + b below this says nothing about chromaticity
MIN_SATURATION = 0.25
CHROMA_SD = 0.05  # of a surface in real light, with JPEG and white balance
MOVED = 25  # grey values from the median of the frames


class BallColor:
    """Similarity of pixels to the ball's colour.

    Parameters
    ----------
    ball_color : (3,) RGB, 0..255
        Its brightness is ignored.
    """

    def __init__(self, ball_color: Array) -> None:
        chroma = ball_color / ball_color.sum()
        edge = (np.arange(BINS) + 0.5) / BINS
        r, g = np.meshgrid(edge, edge, indexing="ij")
        off = (r - chroma[0]) ** 2 + (g - chroma[1]) ** 2
        self._posterior = np.exp(-off / (2 * CHROMA_SD**2)).astype(np.float32)
        self._ball = self._posterior.copy()
        self.color = ball_color

    def likeness(self, color: NDArray[np.uint8]) -> NDArray[np.float32]:
        """(h, w) float32, 0 to 1: back-projection of the histogram."""
        at, bright = _bins(color)
        return np.where(bright, self._posterior[at[0], at[1]], np.float32(0))

    def learn(self, images: Sequence[NDArray[np.uint8]], masks: Sequence[NDArray[np.bool_]]) -> None:
        """Replace the histogram by the posterior of pixels inside `masks` against all others (equal priors)."""
        inside, outside = np.full((BINS, BINS), 1e-6), np.full((BINS, BINS), 1e-6)
        for image, mask in zip(images, masks, strict=True):
            at, bright = _bins(image)
            np.add.at(inside, (at[0][mask & bright], at[1][mask & bright]), 1)
            np.add.at(outside, (at[0][~mask & bright], at[1][~mask & bright]), 1)
        f, b = (_smooth(h / h.sum()) for h in (inside, outside))
        # Colours that neither showed keep what the given colour said.
        seen = f + b
        learnt = f / np.maximum(seen, 1e-30)
        trust = seen / (seen + 1e-4)
        self._posterior = (trust * learnt + (1 - trust) * self._ball).astype(np.float32)


def checked_color(ball_color: Any) -> Array:
    """Check that a colour is valid and saturated; returns (3,) float64."""
    c = numbers(ball_color, "ball_color")
    if c.shape != (3,) or not (np.isfinite(c).all() and (c >= 0).all() and (c <= 255).all()):
        raise ValueError(
            f"ball_color: expected (r, g, b) from 0 to 255, got {np.asarray(ball_color).tolist()}"
        )
    saturation = 1 - c.min() / c.max() if c.max() > 0 else 0.0
    if saturation < MIN_SATURATION:
        raise ValueError(
            f"ball_color: expected a saturated colour, got {tuple(int(v) for v in c)}, which is grey (saturation "
            f"{saturation:.2f}); paint the ball, or give masks of it (from Python: mask_fn)"
        )
    return c


def moving_color(images: Sequence[NDArray[np.uint8]]) -> Array:
    """The most saturated colour among the pixels that change, (3,) RGB.

    Raises
    ------
    ValueError
        No saturated pixels change.
    """
    picked = np.stack(images)[:, ::2, ::2].astype(np.int16)
    middle = np.median(picked, axis=0)
    moved = np.abs(picked - middle).max(axis=-1) > MOVED
    pixels = picked[moved].astype(np.float64)
    top = pixels.max(axis=1) if len(pixels) else np.zeros(0)
    saturation = np.where(top > 60, 1 - pixels.min(axis=1) / np.maximum(top, 1), 0) if len(pixels) else top
    vivid = saturation > 0.5
    if np.count_nonzero(vivid) < 50:
        raise ValueError(
            "ball_color: expected a moving object of saturated colour, found none in the images; pass "
            "its colour (ball_color)"
        )
    p, weight = pixels[vivid], saturation[vivid] ** 4
    chroma = p / p.sum(axis=1, keepdims=True)
    at = np.minimum((chroma[:, :2] * BINS).astype(int), BINS - 1)
    votes = np.zeros((BINS, BINS))
    np.add.at(votes, (at[:, 0], at[:, 1]), weight)
    votes = _smooth(votes)
    r, g = np.unravel_index(int(np.argmax(votes)), votes.shape)
    near = (np.abs(at[:, 0] - r) <= 2) & (np.abs(at[:, 1] - g) <= 2)
    color: Array = np.median(p[near], axis=0)
    return color


def _bins(color: NDArray[np.uint8]) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], NDArray[np.bool_]]:
    total = color.astype(np.int32).sum(axis=-1)
    scale = BINS / np.maximum(total, 1)
    r, g = (np.minimum((color[..., k] * scale).astype(np.intp), BINS - 1) for k in (0, 1))
    return (r, g), total >= DARKEST


def _smooth(h: Array) -> Array:
    for axis in (0, 1):
        p = np.pad(h, [(1, 1) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        a, b, c = (np.take(p, range(k, k + BINS), axis=axis) for k in (0, 1, 2))
        h = 0.25 * a + 0.5 * b + 0.25 * c
    return h
