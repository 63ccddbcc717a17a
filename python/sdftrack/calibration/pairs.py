# SPDX-License-Identifier: MIT
"""Positions of the ball in both cameras, and the mapping from depth to colour that is fitted to them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import Compared
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
class ColorMapping(Compared):
    """From points of the depth camera to colour pixels, with derivatives; docs/math/color_to_depth.md, eq. 1, 11, 12.

    Projective: ``lambda x' = P (Z x) + q`` (thesis Eq. 3.25) as ``y = M (p, 1)``, pixel ``y_01 / y_2``, p in metres;
    `M` is (3, 4), 12 parameters up to scale. Rigid, with a `color` camera: at `T_color_depth`, 6 unknowns (v, w) of
    T <- exp(v, w) T, m and rad.
    """

    depth: Camera
    M: Array | None = None
    color: Camera | None = None
    T_color_depth: Array | None = None

    @property
    def unknowns(self) -> int:
        return 12 if self.color is None else 6

    @property
    def _core_map(self) -> _core.DepthToColor:
        if self.color is None:
            assert self.M is not None
            return _core.DepthToColor.projective(self.M)
        assert self.T_color_depth is not None
        return _core.DepthToColor.rigid(self.T_color_depth, self.color._core)

    def predict(self, p_cam: Array) -> tuple[Array, Array]:
        """Pixels (N, 2) of points (N, 3) and their derivatives by the unknowns (N, 2, n)."""
        px, J = self._core_map.predict(np.ascontiguousarray(p_cam, dtype=np.float64))
        return px, J

    def Pq(self) -> tuple[Array, Array, Array]:
        """(P, q) of Eq. 3.25, lambda the depth (m) in the colour camera, for ideal pixels; and their derivatives.

        These are (12, n), of (P row by row, q) by the unknowns, at fixed scale.
        """
        P, q, J = self._core_map.Pq(self.depth._core)
        return P, q, J


@dataclass(frozen=True, eq=False)
class Fit:
    """A mapping, the time offset (s), covariance of (mapping, offset), residuals (N, 2) px, inlier pairs (N,)."""

    map: ColorMapping
    offset_s: float
    covariance: Array
    residual_px: Array
    kept: NDArray[np.bool_]
    freedom: int  # of the variance: coordinates of kept pairs less the unknowns, and what the stated noise counts for


def fit_from(found: dict[str, Any], depth: Camera, color: Camera | None) -> Fit:
    """A fit of the core, for these cameras."""
    mapped = found.pop("map")
    if color is None:
        return Fit(map=ColorMapping(depth, M=mapped.M), **found)
    return Fit(map=ColorMapping(depth, color=color, T_color_depth=mapped.T_color_depth), **found)
