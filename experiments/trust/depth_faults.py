# SPDX-License-Identifier: MIT
"""Errors of depth cameras that white noise does not describe: noise functions of `sdftrack.synth.sequence`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

import sdftrack as st

Noise = Callable[[Any, Any, np.random.Generator], Any]
WHITE_M = 0.001


def _smooth(error_m: Callable[[Any, Any], Any]) -> Noise:
    """White noise of 1 mm and an error that depends on the place in the image, x and y from -1 to 1."""

    def noise(depth: Any, cosine: Any, rng: np.random.Generator) -> Any:
        h, w = depth.shape
        y, x = np.mgrid[-1 : 1 : h * 1j, -1 : 1 : w * 1j]
        return np.where(depth > 0, depth + error_m(x, y) + rng.normal(0, WHITE_M, depth.shape), 0).astype(
            "f4"
        )

    return noise


def stripes(amplitude_m: float = 0.003, period_px: float = 60) -> Noise:
    """Vertical waves, as of a structured-light sensor."""
    return _smooth(lambda x, y: amplitude_m * np.sin(2 * np.pi * 320 * x / period_px))


def bump(height_m: float = 0.015, radius: float = 0.35) -> Noise:
    """A hump in the middle of the image."""
    return _smooth(lambda x, y: -height_m * np.exp(-(x * x + y * y) / (2 * radius * radius)))


def tilt(slope_m: float = 0.02) -> Noise:
    """Depth that grows across the image."""
    return _smooth(lambda x, y: slope_m * x)


def flying(width_px: int = 5) -> Noise:
    """Pixels at depth steps lie between the two surfaces, as of a time-of-flight camera."""

    def noise(depth: Any, cosine: Any, rng: np.random.Generator) -> Any:
        blurred = cv2.blur(depth, (width_px, width_px))
        kernel = np.ones((width_px, width_px), np.uint8)
        step = cv2.dilate(depth, kernel) - cv2.erode(depth, kernel) > 0.03
        mixed = np.where(step, blurred, depth)
        return np.where(depth > 0, mixed + rng.normal(0, WHITE_M, depth.shape), 0).astype("f4")

    return noise


def lagging(frames: Any, alpha: float = 0.4, delta_m: float = 0.02) -> Any:
    """The temporal filter of a depth camera: an exponential mean of readings that differ by less than `delta_m`."""
    kept: Any = None
    for frame in frames:
        depth = np.asarray(frame.depth)
        near = (kept > 0) & (depth > 0) & (np.abs(depth - kept) < delta_m) if kept is not None else False
        kept = (
            depth if kept is None else np.where(near, alpha * depth + (1 - alpha) * kept, depth).astype("f4")
        )
        yield st.Frame(kept, color=frame.color, timestamp=frame.timestamp)
