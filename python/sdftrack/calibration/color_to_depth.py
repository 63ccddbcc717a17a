# SPDX-License-Identifier: MIT
"""Depth-to-colour registration by a coloured ball on a wand (thesis section 3.7)."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.color_checks import check_arguments, check_found, check_kept, check_spread
from sdftrack.calibration.color_result import ColorCalibration
from sdftrack.calibration.cone import Cone
from sdftrack.calibration.observe import Seen, guessed_camera, moving_first, watch
from sdftrack.calibration.pairs import BallPairs, Path
from sdftrack.calibration.projective import ProjectiveMap, RigidMap, decompose, dlt, resection
from sdftrack.calibration.robust_fit import Fit, consensus, fit_map
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame

__all__ = ["calibrate_color_to_depth", "registered", "result_of"]

Array = NDArray[np.float64]
BAND_PX = 8.0  # of the first consensus: pairs are right or wrong by much more
LATE_BAND_PX = 40.0  # of the choice between candidates while colour may be late, at 1 m/s
LARGEST_OFFSET_S = 0.15
TRIES, LATE_TRIES = (
    200,
    40,
)  # of samples of pairs; with a delay for each of its starts, on a path freed of jumps
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
    """Find where depth pixels lie in the colour image, from a coloured ball that is waved before both cameras.

    Parameters
    ----------
    frames : sequence or iterable of Frame
        Depth and colour, not registered, the cameras at rest to each other. The ball should visit the whole image and
        the whole range of depth; 60 frames do.
    depth_camera : Camera
    ball_radius : float
        m. Its error goes into depth: 1 mm too large moves all centres back by 1 mm.
    ball_color : (r, g, b), 0 to 255, optional
        None: the most saturated thing that moves.
    mask_fn : function Frame -> (h, w) bool, optional
        The ball's pixels in the colour image, in place of `ball_color`.
    color_camera : Camera, optional
        With it the pose of the colour camera is estimated, 6 numbers in place of 11, and its lens is honoured.
    time_offset : bool
        Estimate by how much colour is later than depth; needs timestamps and a ball that moves.
    progress : function, optional
        Called with the share that is done, 0 to 1.
    threads : int
        0: all cores. The result does not depend on it.
    seed : int
        Of the random samples in the search for consistent pairs.

    Returns
    -------
    ColorCalibration

    Notes
    -----
    Minimises Eq. 3.26 with Huber's loss, each pair weighted by the covariances of its two centres. A pair is dropped
    where its squared whitened residual is above 13.8 times the others' (chi-square, two degrees of freedom, 0.1 %).

    Warns
    -----
    UserWarning
        Pairs that scatter by more than 1.5 px.

    Raises
    ------
    TypeError, ValueError
        Arguments of the wrong kind or unit; the ball not found in depth, or in colour, or too small there; fewer than
        6 pairs (4 with `color_camera`), all in one plane, at one depth or on a line; pairs that agree on no map.

    Examples
    --------
    >>> scene = st.synth.ball_scene(60)                                                    # doctest: +SKIP
    >>> result = st.calibrate_color_to_depth(scene.sequence, scene.camera.depth, 0.04)     # doctest: +SKIP
    >>> tracker = st.Tracker(shape, result.camera)                                         # doctest: +SKIP
    """
    check_arguments(frames, depth_camera, ball_radius, ball_color, mask_fn, color_camera)
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
        late = "" if time_offset else "is colour late (time_offset=True)? "
        warnings.warn(
            f"pairs scatter by {result.rms_px:.1f} px, 0.05 to 0.3 px are usual; {late}is ball_radius right, and the "
            "depth camera?",
            stacklevel=2,
        )
    return result


def registered(
    seen: list[Seen],
    color_size: tuple[int, int],
    depth_camera: Camera,
    color_camera: Camera | None,
    time_offset: bool,
    seed: int,
) -> tuple[Fit, BallPairs]:
    """Pairs under a colour camera, the map, the camera from the map, until the centres stay."""
    eye = color_camera or guessed_camera(*color_size)
    both = [s for s in seen if s.balls and s.outlines]
    picks = [(0, 0)] * len(both)
    pairs = _pairs(both, picks, eye)
    smallest = 6 if color_camera is None else 4
    check_spread(pairs, smallest, depth_camera, "frames")
    if time_offset:
        check_times(seen)
    fit = _first(pairs, depth_camera, color_camera, time_offset, smallest, seed)
    for k in range(ROUNDS):
        if color_camera is None:
            eye = _color_camera(fit.map, color_size, eye)
        picks, changed = _picked(both, picks, fit, eye, time_offset)
        before, pairs = pairs, _pairs(both, picks, eye)
        path = _path(seen, both, picks, fit) if time_offset else None
        fit = fit_map(fit.map, pairs, None if changed else fit.kept, path, fit.offset_s)
        check_kept(fit, len(pairs), time_offset)
        moved = np.nanmax(np.abs(pairs.color_px - before.color_px))
        if k > 0 and not changed and (moved < SETTLED_PX):
            break
    check_spread(pairs.part(fit.kept), smallest, depth_camera, "frames")
    return fit, pairs


def _first(
    pairs: BallPairs, depth: Camera, color: Camera | None, time_offset: bool, smallest: int, seed: int
) -> Fit:
    """The map (and the delay) that most pairs agree with, refined on these."""
    path = Path.through(pairs.time_s, pairs.center_cam) if time_offset else None
    delays = [0.0]
    if path is not None:
        delays = list(np.arange(-LARGEST_OFFSET_S, LARGEST_OFFSET_S + 1e-9, max(0.01, 0.25 * path.period)))
    best: tuple[float, Any, NDArray[np.bool_], NDArray[np.bool_], float] | None = None
    for dt in delays:
        shifted = pairs
        if path is not None:
            shifted = replace(pairs, center_cam=path.at(pairs.time_s + dt)[0])
        known: NDArray[np.bool_] = np.asarray(np.isfinite(shifted.center_cam).all(axis=1), dtype=np.bool_)
        if np.count_nonzero(known) < smallest:
            continue
        tries = TRIES if path is None else LATE_TRIES
        x, inside, score = _agreed(shifted.part(known), depth, color, smallest, seed, tries)
        if x is not None and (best is None or score > best[0]):
            agree = np.zeros(len(pairs), np.bool_)
            agree[np.flatnonzero(known)[inside]] = True
            right = agree | ~known  # what the delayed path does not reach is not wrong for that
            best = score, x, agree, right, float(dt)
    if best is None or np.count_nonzero(best[2]) < smallest:
        raise ValueError(
            f"frames: no map agrees with {smallest} of the {len(pairs)} pairs to {BAND_PX:g} px; is the ball that is "
            "found in depth the one that is found in colour? Look at the size (ball_radius) and the colour (ball_color)"
        )
    _, x, agree, right, dt = best
    if path is not None:
        path = Path.through(pairs.time_s[right], pairs.center_cam[right])
    return fit_map(x, pairs, agree, path, dt)


def _agreed(
    pairs: BallPairs, depth: Camera, color: Camera | None, smallest: int, seed: int, tries: int
) -> tuple[Any, NDArray[np.bool_], float]:
    """The map that most pairs agree with to BAND_PX, which, and how well they do."""

    def solve(chosen: NDArray[np.intp]) -> Any:
        chosen = chosen[np.isfinite(pairs.color_px[chosen]).all(axis=1)]  # an outline may make no cone
        if len(chosen) < smallest:
            return None
        p, px = pairs.center_cam[chosen], pairs.color_px[chosen]
        return dlt(p, px, depth) if color is None else resection(p, px, color, depth)

    return consensus(solve, pairs, smallest, BAND_PX, seed, tries)


def _pairs(both: list[Seen], picks: list[tuple[int, int]], eye: Camera) -> BallPairs:
    """Centres of the chosen round things; the image of the centre is the cone's axis under `eye`."""
    rows = []
    for s, (a, b) in zip(both, picks, strict=True):
        ball, outline = s.balls[a], s.outlines[b]
        cone = outline.cone(eye)
        rows.append((s, ball, outline, cone))
    n = len(rows)
    nan2, nan22 = np.full(2, np.nan), np.full((2, 2), np.nan)

    def stacked(values: list[Any], *shape: int) -> Array:
        return np.array(values, dtype=np.float64).reshape(n, *shape)

    def center(c: Cone | None) -> Array:
        return nan2 if c is None else c.center_px

    return BallPairs(
        np.array([s.index for s, *_ in rows], dtype=np.int64),
        stacked([ball.center_cam for _, ball, _, _ in rows], 3),
        stacked([ball.covariance for _, ball, _, _ in rows], 3, 3),
        stacked([center(c) for *_, c in rows], 2),
        stacked([nan22 if c is None else c.covariance_px for *_, c in rows], 2, 2),
        stacked([o.radius_px for _, _, o, _ in rows]),
        stacked([s.time_s for s, *_ in rows]),
        np.full((n, 2), np.nan),
        np.ones(n, bool),
    )


def _picked(
    both: list[Seen], picks: list[tuple[int, int]], fit: Fit, eye: Camera, time_offset: bool
) -> tuple[list[tuple[int, int]], bool]:
    """In each frame the two round things that the map brings nearest to each other."""
    new = []
    for k, s in enumerate(both):
        if len(s.balls) == 1 and len(s.outlines) == 1:
            new.append((0, 0))
            continue
        mapped = fit.map.predict(np.array([b.center_cam for b in s.balls]))[0]
        cones = [o.cone(eye) for o in s.outlines]
        found = np.array([np.full(2, np.inf) if c is None else c.center_px for c in cones])
        with np.errstate(invalid="ignore"):
            off = np.linalg.norm(mapped[:, None] - found[None], axis=2)
        off[~np.isfinite(off)] = np.inf
        a, b = np.unravel_index(int(np.argmin(off)), off.shape)
        band = LATE_BAND_PX if time_offset else BAND_PX
        new.append((int(a), int(b)) if off[a, b] < band else picks[k])
    return new, new != picks


def check_times(seen: list[Seen]) -> None:
    """ValueError unless the frames have times that grow."""
    times = np.array([s.time_s for s in seen])
    if not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise ValueError(
            "time_offset: expected frames with growing timestamps in seconds, got some without or in another order; "
            "pass time_offset=False, or give the frames times with frame.replace(timestamp=...)"
        )


def _path(seen: list[Seen], both: list[Seen], picks: list[tuple[int, int]], fit: Fit) -> Path:
    """Of the chosen balls; frames without colour help, dropped pairs do not."""
    # A pair that the path did not reach has no residual; it is not wrong for that.
    right = fit.kept | ~np.isfinite(fit.residual_px).all(axis=1)
    chosen = {s.index: s.balls[a] for s, (a, _), k in zip(both, picks, right, strict=True) if k}
    paired = {s.index for s in both}
    rows = [
        (s.time_s, (chosen[s.index] if s.index in chosen else s.balls[0]).center_cam)
        for s in seen
        if s.index in chosen or (s.index not in paired and len(s.balls) == 1)
    ]
    return Path.through(np.array([t for t, _ in rows]), np.array([c for _, c in rows]))


def _color_camera(x: ProjectiveMap | RigidMap, size: tuple[int, int], before: Camera) -> Camera:
    """The colour camera that the map implies; the one before where that cannot be a camera."""
    assert isinstance(x, ProjectiveMap)
    try:
        K, _ = decompose(x.M)
        camera = Camera(K[0, 0], K[1, 1], K[0, 2], K[1, 2], *size)
    except ValueError:
        return before
    side = max(size)
    usual = 0.3 * side < camera.fx < 4 * side and 0.5 < camera.fx / camera.fy < 2
    usual = (
        usual and -0.5 * size[0] < camera.cx < 1.5 * size[0] and -0.5 * size[1] < camera.cy < 1.5 * size[1]
    )
    return camera if usual else before


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
        P, q, covariance, rms, pairs, T, T_covariance, K, camera, fit.offset_s, sd, x, fit.covariance, size
    )
