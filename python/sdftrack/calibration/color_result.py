# SPDX-License-Identifier: MIT
"""Result of :func:`sdftrack.calibrate_color_to_depth`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.array_equality import Compared
from sdftrack.calibration.pairs import BallPairs, ColorMapping
from sdftrack.calibration.statistics import student_t975
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.io.report_file import plain

Array = NDArray[np.float64]


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
            "P",
            "q",
            "covariance",
            "rms_px",
            "T_color_depth",
            "T_covariance",
            "K_color",
            "time_offset_s",
        )
        each = zip(p.index, p.center_cam, p.color_px, p.residual_px, p.kept, strict=True)
        return dict(
            plain(
                {
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
            )
        )

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
