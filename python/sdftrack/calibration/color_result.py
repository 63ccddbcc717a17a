# SPDX-License-Identifier: MIT
"""Positions of the ball in both cameras, the mapping from depth to colour, and the result of a registration."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import Compared
from sdftrack.calibration.statistics import student_t975
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.io.report_file import plain

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


@dataclass(frozen=True, eq=False)
class ColorCalibration(Compared):
    """A depth-to-colour registration and its uncertainty.

    Attributes
    ----------
    P, q : (3, 3) and (3,) float64
        ``lambda x' = P (Z x) + q`` (thesis Eq. 3.25), Z in metres; lambda is the depth (m) in the colour camera. With
        `color_camera`: for its ideal pixels, with distortion removed.
    covariance : (12, 12) float64
        Covariance of (P row by row, q). The scale is fixed by ``|row 3 of P K| = 1``, so the rank is 11 (6 with
        `color_camera`).
    rms_px : float
        Root mean square of the inlier pairs' residuals, as 2-vectors (Eq. 3.26).
    pairs : BallPairs
        All pairs of centres, their residuals, and whether they are inliers.
    T_color_depth : (4, 4) float64
        Maps depth camera to colour camera, m. Without `color_camera`: from the decomposition of P and q, with
        `K_color`.
    T_covariance : (6, 6) float64 or None
        Covariance of (v, w): T <- exp(v, w) T, m and rad; with `color_camera`.
    K_color : (3, 3) float64
        The colour camera's matrix: as given, or from the decomposition of P and q (which may have skew).
    camera : RGBDCamera
        Ready for :class:`sdftrack.Tracker`.
    time_offset_s, time_offset_sd_s : float
        Delay of colour relative to its timestamp (that of depth); 0 and 0 if not estimated.
    map : ColorMapping
        The fitted mapping, with derivatives.
    map_covariance : (n, n) float64
        Covariance of the mapping's unknowns, and of the time offset if estimated.
    color_size : (width, height)
        Size of the colour images.
    freedom : int
        Degrees of freedom of the covariance, for intervals by Student's t.
    """

    P: Array
    q: Array
    covariance: Array
    rms_px: float
    pairs: BallPairs
    T_color_depth: Array
    T_covariance: Array | None
    K_color: Array
    camera: RGBDCamera
    time_offset_s: float
    time_offset_sd_s: float
    map: ColorMapping
    map_covariance: Array
    color_size: tuple[int, int]
    freedom: int

    def project(self, points: ArrayLike) -> Array:
        """Colour pixels (N, 2) of points (N, 3) in the depth camera's frame, m."""
        return self.camera.project_to_color(points)

    def sd_px(self, points: ArrayLike) -> Array:
        """(N, 2) standard deviation (px) of :meth:`project` at points (N, 3), from the covariance.

        >>> result.sd_px([[0.0, 0.0, 1.0]])  # doctest: +SKIP
        """
        p = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        J = self.map.predict(p)[1]
        n = self.map.unknowns
        variance = np.einsum("nka,ab,nkb->nk", J, self.map_covariance[:n, :n], J)
        return np.sqrt(np.maximum(variance, 0))

    def half_width95_px(self, points: ArrayLike) -> Array:
        """(N, 2) half of the 95 % intervals (px) of :meth:`project` at points (N, 3): Student's t times :meth:`sd_px`.

        >>> result.half_width95_px([[0.0, 0.0, 1.0]])  # doctest: +SKIP
        """
        return student_t975(self.freedom) * self.sd_px(points)

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain numbers for JSON, None where unknown."""
        p = self.pairs
        names = (
            "P", "q", "covariance", "rms_px", "T_color_depth", "T_covariance", "K_color", "time_offset_s",
        )  # fmt: skip
        each = zip(p.index, p.center_cam, p.color_px, p.residual_px, p.kept, strict=True)
        content = {
            **{name: getattr(self, name) for name in (*names, "time_offset_sd_s")},
            "covariance_of": "P row by row, then q; scale held by |row 3 of P K| = 1",
            "degrees_of_freedom": self.freedom,
            "pairs_found": len(p),
            "pairs_kept": np.count_nonzero(p.kept),
            "pairs": [
                {
                    "frame": i,
                    "center_cam_m": center,
                    "color_px": px,
                    "residual_px": residual if np.isfinite(residual).all() else None,
                    "kept": kept,
                }
                for i, center, px, residual, kept in each
            ],
        }
        return dict(plain(content))

    def camera_dict(self, depth_scale_m: float = 0.001) -> dict[str, Any]:
        """Contents of a camera.json of the k1 layout (docs/data.md), including the mapping."""

        def pinhole(c: Camera) -> dict[str, Any]:
            lens = {"distortion": list(c.distortion)} if c.distortion else {}
            return {"fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy, **lens}

        d = self.camera.depth
        out: dict[str, Any] = {
            "image_size": [d.width, d.height],
            "depth_scale_m": depth_scale_m,
            "K_depth": pinhole(d),
            "color_size": list(self.color_size),
        }
        if self.camera.color is not None:
            out["K_color"] = pinhole(self.camera.color)
            out["T_color_depth"] = self.T_color_depth.tolist()
        else:
            out["depth_to_color_Pq"] = {"P": self.P.tolist(), "q": self.q.tolist()}
        return out

    def __repr__(self) -> str:
        how = "T_color_depth" if self.camera.color is not None else "P, q"
        late = f", colour {1e3 * self.time_offset_s:+.1f} ms" if self.time_offset_sd_s else ""
        kept = int(np.count_nonzero(self.pairs.kept))
        return f"ColorCalibration({how}, {kept} of {len(self.pairs)} pairs, rms {self.rms_px:.2f} px{late})"
