# SPDX-License-Identifier: MIT
"""Checks that a recording of the ball is sufficient for a registration, with the cause if not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sdftrack._internal.validation import number, of_kind
from sdftrack.calibration.ball_in_color import MIN_RADIUS_PX
from sdftrack.calibration.observe import Watch
from sdftrack.calibration.pairs import BallPairs
from sdftrack.calibration.robust_fit import Fit
from sdftrack.camera import Camera

__all__ = ["check_arguments", "check_found", "check_kept", "check_spread"]

RADII_M = (0.005, 0.5)
MIN_THICKNESS = 0.02  # of the pairs' smallest extent over the largest: below, rounding decides
MIN_KEPT = 0.5
MAX_SIZE_SCATTER = 0.15  # relative; a right ball's is below 0.05, the angle of view included


def check_arguments(
    frames: Any, depth_camera: Any, ball_radius: Any, ball_color: Any, mask_fn: Any, color_camera: Any
) -> None:
    """TypeError or ValueError for invalid arguments."""
    of_kind(depth_camera, Camera, "depth_camera", "an RGBDCamera has one as .depth")
    if color_camera is not None:
        of_kind(color_camera, Camera, "color_camera")
    radius = number(ball_radius, "ball_radius")
    low, high = RADII_M
    if not (math.isfinite(radius) and low <= radius <= high):
        hint = f"; {radius:g} mm is {radius / 1000:g}" if low <= radius / 1000 <= high else ""
        raise ValueError(f"ball_radius: expected metres, {low:g} to {high:g}, got {radius:g}{hint}")
    if mask_fn is not None and ball_color is not None:
        raise ValueError("ball_color, mask_fn: expected one of them, got both")
    if mask_fn is not None and not callable(mask_fn):
        raise TypeError(f"mask_fn: expected a function of a Frame, got {type(mask_fn).__name__}")
    if not hasattr(frames, "__iter__") and not hasattr(frames, "__getitem__"):
        raise TypeError(f"frames: expected frames or a sequence, got {type(frames).__name__}")


def check_found(looked: Watch, depth: Camera, radius_m: float, masked: bool) -> None:
    """ValueError if the ball was found in no depth image, in no colour image, or never in both."""
    n = len(looked.seen)
    if not any(s.balls for s in looked.seen):
        near_px = 0.5 * (depth.fx + depth.fy) * radius_m
        raise ValueError(
            f"frames: found no ball of ball_radius={radius_m:g} m in any of {n} depth images; check the radius and "
            f"the depth camera, and keep the ball in view, clear of the background and near "
            f"(its radius is {near_px:.0f} px at 1 m)"
        )
    if not any(s.outlines for s in looked.seen):
        what = "mask_fn" if masked else "ball_color"
        if looked.largest_px > 0:
            raise ValueError(
                f"frames: the ball is too small in the colour images: a radius of {looked.largest_px:.1f} px at most, "
                f"{MIN_RADIUS_PX:g} px are needed; move it closer or use a larger ball"
            )
        color = "" if looked.color is None else f" of the colour {tuple(int(c) for c in looked.color)}"
        raise ValueError(
            f"{what}: found no round object{color} in any of {n} colour images; give the ball's colour as the camera "
            "shows it, light it evenly, or give masks of it (from Python: mask_fn)"
        )
    if not any(s.balls and s.outlines for s in looked.seen):
        raise ValueError(
            "frames: the ball is never found in depth and in colour in the same frame; keep it in the view of both"
        )


def check_spread(pairs: BallPairs, smallest: int, depth: Camera, name: str) -> None:
    """ValueError for too few pairs, or pairs in a plane, at one depth or on a line."""
    n = len(pairs)
    if n < smallest:
        raise ValueError(
            f"{name}: expected the ball in at least {smallest} frames of both cameras, found it in {n}"
        )
    _expect_its_size(pairs, name)
    p = pairs.center_cam
    off = p - np.median(p, axis=0)
    axes = np.linalg.svd(off, full_matrices=False)
    size = axes[1] / np.sqrt(n)
    noise = float(np.sqrt(np.median(np.trace(pairs.center_covariance, axis1=1, axis2=2))))
    least = max(MIN_THICKNESS * size[0], 3 * noise)
    extent = f"{1e3 * size[0]:.0f} x {1e3 * size[1]:.0f} x {1e3 * size[2]:.0f} mm (standard deviations)"
    if size[0] < 3 * noise or size[0] < 0.01:
        raise ValueError(
            f"{name}: the ball hardly moves, its centres spread over {extent}; move it through the volume"
        )
    if size[1] < least:
        raise ValueError(
            f"{name}: all {n} centres lie on a line, {extent}; move the ball sideways and along the view"
        )
    if smallest >= 6 and size[2] < least:
        flat = abs(axes[2][2, 2]) > 0.9
        where = "at one depth" if flat else "in one plane"
        fix = "move the ball closer and farther" if flat else "move the ball out of that plane"
        raise ValueError(
            f"{name}: all {n} centres lie {where}, {extent}; {fix}, or give the colour camera (color_camera)"
        )


def _expect_its_size(pairs: BallPairs, name: str) -> None:
    """ValueError if depth and colour show objects of different sizes: with a wrong radius another object is found.

    For one ball, outline radius times distance is constant: its radius times the colour camera's focal length.
    """
    size = pairs.radius_px * pairs.center_cam[:, 2]
    middle = float(np.median(size))
    scatter = 1.4826 * float(np.median(np.abs(size - middle))) / middle
    if scatter > MAX_SIZE_SCATTER:
        raise ValueError(
            f"{name}: the object found in depth is not the ball found in colour, whose outline shrinks with the "
            f"distance: their product varies by {100 * scatter:.0f} %; check ball_radius, that nothing else of that "
            "shape is in view, and that both images are simultaneous"
        )


def check_kept(fit: Fit, found: int, time_offset: bool) -> None:
    """ValueError if most pairs were rejected."""
    kept = int(np.count_nonzero(fit.kept))
    if kept < max(4, MIN_KEPT * found):
        late = "" if time_offset else ", or colour is delayed (estimate it: time_offset)"
        raise ValueError(
            f"frames: only {kept} of {found} pairs agree with one mapping; something else like the ball is "
            f"in view, or the cameras move relative to each other{late}"
        )
