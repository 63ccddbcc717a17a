# SPDX-License-Identifier: MIT
"""Positions of the ball in both cameras, and the mapping fitted to them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import Compared
from sdftrack.calibration.color_maps import ProjectiveMap, RigidMap
from sdftrack.camera import Camera

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BallPairs(Compared):
    """N frames in which the ball was found in both images.

    Attributes
    ----------
    index : (N,) int
        Index of the frame in the input.
    center_cam : (N, 3) float64
        Centre at the time of the depth image, depth camera, m.
    center_covariance : (N, 3, 3) float64, m^2
    color_px : (N, 2) float64
        Projection of the centre in the colour image (not the centroid of the outline).
    color_covariance : (N, 2, 2) float64, px^2
    radius_px : (N,) float64
        Radius of the outline in the colour image.
    time_s : (N,) float64
        Timestamps; NaN if missing.
    residual_px : (N, 2) float64
        Measured minus mapped; NaN before a mapping is fitted, and if the path is undefined at the time of the colour
        image.
    kept : (N,) bool
        False: rejected as an outlier (see :func:`sdftrack.calibrate_color_to_depth`).
    """

    index: NDArray[np.int64]
    center_cam: Array
    center_covariance: Array
    color_px: Array
    color_covariance: Array
    radius_px: Array
    time_s: Array
    residual_px: Array
    kept: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.index)

    def part(self, which: NDArray[np.bool_]) -> BallPairs:
        """A subset of the pairs."""
        return BallPairs(*(getattr(self, f.name)[which] for f in fields(self)))


def pairs_from(found: dict[str, Any]) -> BallPairs:
    """Pairs of the core, before a mapping is fitted."""
    n = len(found["index"])
    return BallPairs(**found, residual_px=np.full((n, 2), np.nan), kept=np.ones(n, bool))


@dataclass(frozen=True, eq=False)
class Fit:
    """A mapping, the time offset (s), covariance of (mapping, offset), residuals (N, 2) px, inlier pairs (N,)."""

    map: ProjectiveMap | RigidMap
    offset_s: float
    covariance: Array
    residual_px: Array
    kept: NDArray[np.bool_]
    freedom: int  # of the variance: coordinates of kept pairs less the unknowns, and what the stated noise counts for


def fit_from(found: dict[str, Any], depth: Camera, color: Camera | None) -> Fit:
    """A fit of the core, for these cameras."""
    mapped = found.pop("map")
    fitted = ProjectiveMap(mapped.M, depth) if color is None else RigidMap(mapped.T_color_depth, color, depth)
    return Fit(map=fitted, **found)


def fit_pairs(
    pairs: BallPairs, depth: Camera, color: Camera | None = None, time_offset: bool = False, seed: int = 0
) -> Fit | None:
    """The mapping that most pairs agree with, refined on them; None if there is none.

    Parameters
    ----------
    color : Camera, optional
        Known: only its pose is estimated.
    time_offset : bool
        Estimate the delay of colour, too; the times of the pairs grow.
    """
    found = _core.fit_color_map(
        np.ascontiguousarray(pairs.center_cam, dtype=np.float64),
        np.ascontiguousarray(pairs.center_covariance, dtype=np.float64),
        np.ascontiguousarray(pairs.color_px, dtype=np.float64),
        np.ascontiguousarray(pairs.color_covariance, dtype=np.float64),
        np.ascontiguousarray(pairs.time_s, dtype=np.float64),
        None if color is None else color._core,
        time_offset,
        seed,
    )
    return None if found is None else fit_from(found, depth, color)
