# SPDX-License-Identifier: MIT
"""Depth-to-colour registration by a coloured ball on a wand (thesis section 3.7)."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import THREADS, whole
from sdftrack.calibration.color_checks import check_arguments, check_found, check_kept, check_spread
from sdftrack.calibration.color_result import ColorCalibration
from sdftrack.calibration.observe import ObservedFrame, guessed_camera, moving_first, watch
from sdftrack.calibration.pair_selection import color_camera_of, pairs_of, path_of, picked
from sdftrack.calibration.pairs import BallPairs
from sdftrack.calibration.projective import RigidMap, decompose
from sdftrack.calibration.robust_fit import Fit, fit_map
from sdftrack.calibration.robust_initialization import first_map
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame

__all__ = ["calibrate_color_to_depth", "registered", "result_of"]

Array = NDArray[np.float64]
ROUNDS = 6  # of centres under the last colour camera, and maps from them
SETTLED_PX = 0.003
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
    progress : function, optional
        Called with the completed fraction, 0 to 1.
    threads : int
        0: all cores. The result does not depend on it.
    seed : int
        Seed of the random samples in the search for consistent pairs.

    Returns
    -------
    ColorCalibration

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
    looked = watch(
        given, depth_camera, float(ball_radius), ball_color, mask_fn, color_camera, threads, seed, progress
    )
    check_found(looked, depth_camera, float(ball_radius), mask_fn is not None)
    moving_first(looked.seen, float(ball_radius))
    fit, pairs = registered(looked.seen, looked.color_size, depth_camera, color_camera, time_offset, seed)
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


def registered(
    seen: list[ObservedFrame],
    color_size: tuple[int, int],
    depth_camera: Camera,
    color_camera: Camera | None,
    time_offset: bool,
    seed: int,
) -> tuple[Fit, BallPairs]:
    """Iterate pairs, mapping, and the colour camera implied by the mapping, until the centres converge."""
    eye = color_camera or guessed_camera(*color_size)
    both = [s for s in seen if s.balls and s.outlines]
    picks = [(0, 0)] * len(both)
    pairs = pairs_of(both, picks, eye)
    smallest = 6 if color_camera is None else 4
    check_spread(pairs, smallest, depth_camera, "frames")
    if time_offset:
        check_times(seen)
    fit = first_map(pairs, depth_camera, color_camera, time_offset, smallest, seed)
    for k in range(ROUNDS):
        if color_camera is None:
            eye = color_camera_of(fit.map, color_size, eye)
        picks, changed = picked(both, picks, fit, eye, time_offset)
        before, pairs = pairs, pairs_of(both, picks, eye)
        path = path_of(seen, both, picks, fit) if time_offset else None
        fit = fit_map(fit.map, pairs, None if changed else fit.kept, path, fit.offset_s)
        check_kept(fit, len(pairs), time_offset)
        moved = np.nanmax(np.abs(pairs.color_px - before.color_px))
        if k > 0 and not changed and (moved < SETTLED_PX):
            break
    check_spread(pairs.part(fit.kept), smallest, depth_camera, "frames")
    return fit, pairs


def check_times(seen: list[ObservedFrame]) -> None:
    """ValueError unless the frames have increasing timestamps."""
    times = np.array([s.time_s for s in seen])
    if not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise ValueError(
            "time_offset: expected frames with growing timestamps in seconds, got some without or in another order; "
            "pass time_offset=False, or give the frames times with frame.replace(timestamp=...)"
        )


def result_of(fit: Fit, pairs: BallPairs, size: tuple[int, int], time_offset: bool) -> ColorCalibration:
    x = fit.map
    P, q = x.Pq()
    n = x.unknowns
    G = x.Pq_jacobian()
    covariance = G @ fit.covariance[:n, :n] @ G.T
    pairs.residual_px[:], pairs.kept[:] = fit.residual_px, fit.kept
    rms = float(np.sqrt((fit.residual_px[fit.kept] ** 2).sum(axis=1).mean()))
    if isinstance(x, RigidMap):
        T, K, T_covariance = x.T_color_depth, x.color.K, fit.covariance[:6, :6]
        camera = RGBDCamera(x.depth, x.color, T_color_depth=T)
    else:
        K, T = decompose(x.M)
        T_covariance = None
        camera = RGBDCamera(x.depth, None, projective=(P, q))
    sd = float(np.sqrt(fit.covariance[n, n])) if time_offset else 0.0
    return ColorCalibration(
        P,
        q,
        covariance,
        rms,
        pairs,
        T,
        T_covariance,
        K,
        camera,
        fit.offset_s,
        sd,
        x,
        fit.covariance,
        size,
        fit.freedom,
    )
