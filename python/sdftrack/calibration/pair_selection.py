# SPDX-License-Identifier: MIT
"""Selection of ball candidates consistent with a mapping, their pairs and path, and the implied camera."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.cone import Cone
from sdftrack.calibration.observe import ObservedFrame
from sdftrack.calibration.pairs import BallPairs, Path
from sdftrack.calibration.projective import ProjectiveMap, RigidMap, decompose
from sdftrack.calibration.robust_fit import BAND_PX, Fit
from sdftrack.camera import Camera

Array = NDArray[np.float64]
LATE_BAND_PX = 40.0  # of the choice between candidates while colour may be late, at 1 m/s


def pairs_of(both: list[ObservedFrame], picks: list[tuple[int, int]], eye: Camera) -> BallPairs:
    """Centres of the selected candidates; the image of the centre is the cone's axis under `eye`."""
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


def picked(
    both: list[ObservedFrame], picks: list[tuple[int, int]], fit: Fit, eye: Camera, time_offset: bool
) -> tuple[list[tuple[int, int]], bool]:
    """In each frame the two candidates that are closest under the mapping."""
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


def path_of(
    seen: list[ObservedFrame], both: list[ObservedFrame], picks: list[tuple[int, int]], fit: Fit
) -> Path:
    """Path of the selected balls; frames without colour are used, rejected pairs are not."""
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


def color_camera_of(x: ProjectiveMap | RigidMap, size: tuple[int, int], before: Camera) -> Camera:
    """The colour camera implied by the mapping; the previous one if it is not a valid camera."""
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
