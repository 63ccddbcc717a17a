# SPDX-License-Identifier: MIT
"""Depth-to-colour registration by a coloured ball on a wand (thesis section 3.7)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.validation import THREADS, number, of_kind, one_of, whole
from sdftrack.calibration.color_result import BallPairs, ColorCalibration, Fit, fit_from, pairs_from
from sdftrack.calibration.observe import Watch, guessed_camera, watch
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame

Array = NDArray[np.float64]
UNUSUAL_PX = 1.5


def calibrate_color_to_depth(
    frames: Iterable[Frame],
    depth_camera: Camera,
    ball_radius: float,
    ball_color: Any = None,
    mask_fn: Callable[[Frame], Any] | None = None,
    *,
    color_camera: Camera | None = None,
    time_offset: bool = False,
    method: Literal["ours", "printed"] = "ours",
    progress: Callable[[float], None] | None = None,
    threads: int = 0,
    seed: int = 0,
) -> ColorCalibration:
    """Estimate the mapping from depth to colour pixels, from a coloured ball moved in front of both cameras.

    Parameters
    ----------
    frames : sequence or iterable of Frame
        Depth and colour, not registered; the relative pose of the cameras is fixed. The ball should cover the whole
        image and the whole depth range; 60 frames suffice.
    depth_camera : Camera
    ball_radius : float
        m. Its error shifts depth: if it is 1 mm too large, all centres move back by 1 mm.
    ball_color : (r, g, b), 0 to 255, optional
        None: the most saturated moving object.
    mask_fn : function Frame -> (h, w) bool, optional
        The ball's pixels in the colour image, instead of `ball_color`.
    color_camera : Camera, optional
        If given, only the pose of the colour camera is estimated, 6 parameters instead of 11, and its distortion is
        accounted for.
    time_offset : bool
        Estimate the delay of colour relative to depth; requires timestamps and a moving ball.
    method : {"ours", "printed"}
        "printed": that of the thesis. The centre in colour is that of a Hough circle, the centre in depth that of the
        sphere's SDF moved by translation alone, and every pair counts the same in the 2-norm of Eq. 3.26. Without
        `mask_fn`, `color_camera` and `time_offset`.
    progress : function, optional
        Called with the completed fraction, 0 to 1.
    threads : int
        0: all cores. The result does not depend on it.
    seed : int
        Seed of the random samples in the search for consistent pairs.

    Notes
    -----
    Minimises Eq. 3.26 with Huber's loss, each pair weighted by the covariances of its two centres. A pair is rejected
    if its squared whitened residual exceeds 13.8 times that of the others (chi-square, two degrees of freedom, 0.1 %).

    Warns
    -----
    UserWarning
        Pairs with an rms residual above 1.5 px.

    Raises
    ------
    TypeError, ValueError
        Arguments of the wrong type or unit; the ball not found in depth or in colour, or too small there; fewer than 6
        pairs (4 with `color_camera`), all in one plane, at one depth or on a line; no mapping consistent with the
        pairs.

    Examples
    --------
    >>> seq = st.open_sequence("ball_on_a_wand")                                           # doctest: +SKIP
    >>> result = st.calibrate_color_to_depth(seq, seq.camera.depth, 0.04)                  # doctest: +SKIP
    >>> tracker = st.Tracker(shape, result.camera)                                         # doctest: +SKIP
    """
    check_arguments(frames, depth_camera, ball_radius, ball_color, mask_fn, color_camera)
    threads = whole(threads, "threads", 0, what=THREADS)
    seed = whole(seed, "seed", 0)
    given: Any = frames if hasattr(frames, "__len__") and hasattr(frames, "__getitem__") else list(frames)
    if not len(given):
        raise ValueError("frames: expected at least one, got none")
    if one_of(method, ("ours", "printed"), "method") == "printed":
        if mask_fn is not None or color_camera is not None or time_offset:
            raise ValueError(
                "method: expected 'ours' with mask_fn, color_camera or time_offset, got 'printed', without any"
            )
        return _as_printed(given, depth_camera, float(ball_radius), ball_color, seed)
    looked = watch(
        given, depth_camera, float(ball_radius), ball_color, mask_fn, color_camera, threads, seed, progress
    )
    check_found(looked, depth_camera, float(ball_radius), mask_fn is not None)
    fit, pairs = registered(looked, depth_camera, color_camera, time_offset, seed)
    if progress is not None:
        progress(1.0)
    result = result_of(fit, pairs, looked.color_size, time_offset)
    if result.rms_px > UNUSUAL_PX:
        late = "" if time_offset else "is colour late (estimate it: time_offset)? "
        warnings.warn(
            f"pairs scatter by {result.rms_px:.1f} px, 0.05 to 0.3 px are usual; {late}is ball_radius right, and the "
            "depth camera?",
            stacklevel=2,
        )
    return result


def _as_printed(
    frames: Any, depth_camera: Camera, radius_m: float, ball_color: Any, seed: int
) -> ColorCalibration:
    from sdftrack.calibration.as_printed import fit_as_printed, pairs_as_printed

    pairs, size = pairs_as_printed(frames, depth_camera, radius_m, ball_color, seed)
    check_spread(pairs, 6, "frames")
    return result_of(fit_as_printed(pairs, depth_camera, size), pairs, size, False)


def registered(
    looked: Watch, depth_camera: Camera, color_camera: Camera | None, time_offset: bool, seed: int
) -> tuple[Fit, BallPairs]:
    """Iterate pairs, mapping, and the colour camera implied by the mapping, until the centres converge."""
    eye = color_camera or guessed_camera(*looked.color_size)
    first = pairs_from(looked.recording.pairs(eye._core))
    smallest = 6 if color_camera is None else 4
    check_spread(first, smallest, "frames")
    times = np.array([s.time_s for s in looked.recording.frames])
    if time_offset and not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise ValueError(
            "time_offset: expected frames with growing timestamps in seconds, got some without or in another order; "
            "pass time_offset=False, or give the frames times with frame.replace(timestamp=...)"
        )
    found = looked.recording.registered(eye._core, color_camera is not None, time_offset, seed)
    if found is None:
        more = f"; with so few pairs a single outlier is fatal, {2 * smallest} pairs tolerate some"
        raise ValueError(
            f"frames: no mapping agrees with {smallest} of the {len(first)} pairs to {_core.BALL_BAND_PX:g} px; is the "
            "ball found in depth the one found in colour? Check the size (ball_radius) and the colour "
            f"(ball_color){more if len(first) < smallest + 3 else ''}"
        )
    fit, pairs = fit_from(found[0], depth_camera, color_camera), pairs_from(found[1])
    check_kept(fit, len(pairs), time_offset)
    check_spread(pairs.part(fit.kept), smallest, "frames")
    return fit, pairs


def result_of(fit: Fit, pairs: BallPairs, size: tuple[int, int], time_offset: bool) -> ColorCalibration:
    x = fit.map
    P, q, G = x.Pq()
    n = x.unknowns
    covariance = G @ fit.covariance[:n, :n] @ G.T
    pairs.residual_px[:], pairs.kept[:] = fit.residual_px, fit.kept
    rms = float(np.sqrt((fit.residual_px[fit.kept] ** 2).sum(axis=1).mean()))
    T_covariance = None
    if x.color is not None:
        assert x.T_color_depth is not None
        T, K, T_covariance = x.T_color_depth, x.color.K, fit.covariance[:6, :6]
        camera = RGBDCamera(x.depth, x.color, T_color_depth=T)
    else:
        assert x.M is not None
        K, T = _core.decompose_map(x.M)
        camera = RGBDCamera(x.depth, None, projective=(P, q))
    sd = float(np.sqrt(fit.covariance[n, n])) if time_offset else 0.0
    return ColorCalibration(
        P, q, covariance, rms, pairs, T, T_covariance, K, camera, fit.offset_s, sd, x, fit.covariance, size,
        fit.freedom,
    )  # fmt: skip


# -- Checks that a recording of the ball is sufficient for a registration, with the cause if not


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
    seen = [(bool(s.balls), bool(s.outlines)) for s in looked.recording.frames]
    n = len(seen)
    if not any(in_depth for in_depth, _ in seen):
        near_px = 0.5 * (depth.fx + depth.fy) * radius_m
        raise ValueError(
            f"frames: found no ball of ball_radius={radius_m:g} m in any of {n} depth images; check the radius and "
            f"the depth camera, and keep the ball in view, clear of the background and near "
            f"(its radius is {near_px:.0f} px at 1 m)"
        )
    if not any(in_color for _, in_color in seen):
        what = "mask_fn" if masked else "ball_color"
        if looked.largest_px > 0:
            raise ValueError(
                f"frames: the ball is too small in the colour images: a radius of {looked.largest_px:.1f} px at most, "
                f"{_core.MIN_BALL_RADIUS_PX:g} px are needed; move it closer or use a larger ball"
            )
        color = "" if looked.color is None else f" of the colour {tuple(int(c) for c in looked.color)}"
        raise ValueError(
            f"{what}: found no round object{color} in any of {n} colour images; give the ball's colour as the camera "
            "shows it, light it evenly, or give masks of it (from Python: mask_fn)"
        )
    if not any(in_depth and in_color for in_depth, in_color in seen):
        raise ValueError(
            "frames: the ball is never found in depth and in colour in the same frame; keep it in the view of both"
        )


def check_spread(pairs: BallPairs, smallest: int, name: str) -> None:
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
    """ValueError if depth and colour show objects of different sizes: with a wrong radius another object is found."""
    # For one ball, outline radius times distance is constant: its radius times the colour camera's focal length.
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
