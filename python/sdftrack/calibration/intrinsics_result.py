# SPDX-License-Identifier: MIT
"""Result of an intrinsic calibration."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.array_equality import Compared
from sdftrack.calibration.observability import Observability
from sdftrack.calibration.statistics import fuse
from sdftrack.camera import Camera
from sdftrack.io.report_file import plain
from sdftrack.results import Step

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PerFrame(Compared):
    """Estimates from single frames, and their information-weighted mean (thesis Eq. 3.23).

    Frames in which a parameter is unobservable are excluded.

    Attributes
    ----------
    frames : list of int
        Indices of the frames.
    values : (M, n) float64
        In the order of ``free``.
    covariances : (M, n, n) float64
        Marginal: the pose is unknown too (docs/math/intrinsics.md, section 2).
    fused : (n,) float64
    fused_covariance : (n, n) float64
    """

    frames: list[int]
    values: Array
    covariances: Array
    fused: Array
    fused_covariance: Array

    def running(self) -> Array:
        """(M, n): the mean of the first 1, 2, ... M frames, as in thesis Fig. 3.12."""
        information = np.linalg.inv(self.covariances)
        weighted = np.cumsum(np.einsum("mij,mj->mi", information, self.values), axis=0)
        return np.linalg.solve(np.cumsum(information, axis=0), weighted[:, :, None])[:, :, 0]


@dataclass(frozen=True, eq=False)
class IntrinsicsResult(Compared):
    """Intrinsics of a depth camera from a known object, with their uncertainty.

    Attributes
    ----------
    camera : Camera
    free : tuple of str
        The estimated parameters, in the order of the arrays.
    values : (n,) float64
        Pixels, plain numbers, or metres (depth_offset).
    covariance : (n, n) float64
    interval95 : (n, 2) float64
        Lower and upper end of the 95 % intervals.
    extra : dict
        skew (px), depth_scale and depth_offset (m) where they were free: ``depth = scale * reading + offset``.
    bias : (n,) float64
        Bias of the estimate due to noise, measured in a simulation (depth rendered from the solution, with the noise of
        each frame); not subtracted.
    per_frame : PerFrame
        Estimates from the frames that were used.
    poses : (M, 4, 4) float64
        ``T_cam_obj`` of the frames that were used, m.
    frames : list of int
        Indices of those frames.
    left_out : dict of int to str
        Reasons why the other frames were not used.
    noise_m : (M,) float64
        Noise sd of the depth in each frame.
    observability : Observability
    status : "ok" or "weak"
        "weak": the object's motion was insufficient, or the estimates of single frames contradict each other; see
        ``reason``.
    reason : str
    joint : bool
        True: joint solution over all frames; False: mean of the single-frame estimates.
    steps : list of Step
    seconds : float
    """

    camera: Camera
    free: tuple[str, ...]
    values: Array
    covariance: Array
    interval95: Array
    extra: dict[str, float]
    bias: Array
    per_frame: PerFrame
    poses: Array
    frames: list[int]
    left_out: dict[int, str]
    noise_m: Array
    observability: Observability
    status: str
    reason: str
    joint: bool
    steps: list[Step]
    seconds: float

    @property
    def sd(self) -> Array:
        """(n,) standard deviations of ``values``."""
        return np.sqrt(np.diag(self.covariance))

    def __repr__(self) -> str:
        parts = [
            f"{name} = {value:.6g} +- {(high - low) / 2:.2g}"
            for name, value, (low, high) in zip(self.free, self.values, self.interval95, strict=True)
        ]
        return f"IntrinsicsResult({', '.join(parts)}; {len(self.frames)} frames, {self.status})"

    def to_dict(self) -> dict[str, Any]:
        """Convert to numbers, lists and strings for JSON, None where unknown."""
        names = (
            "free",
            "values",
            "covariance",
            "interval95",
            "extra",
            "bias",
            "status",
            "reason",
            "joint",
            "frames",
        )
        return dict(
            plain(
                {
                    "camera": dataclasses.asdict(self.camera),
                    **{
                        name: getattr(self, name)
                        for name in (*names, "left_out", "noise_m", "poses", "seconds")
                    },
                    "fused": {"values": self.per_frame.fused, "covariance": self.per_frame.fused_covariance},
                    "observability": dataclasses.asdict(self.observability),
                }
            )
        )


def per_frame_of(estimates: dict[str, Any], order: list[int], frames: list[int]) -> PerFrame:
    """Single-frame estimates of the core for `frames`, with the parameters in the caller's `order`."""
    information = estimates["information"]
    sane = np.linalg.eigvalsh(information)[:, 0] > 0
    if not sane.any():
        n = len(order)
        return PerFrame(
            [], np.empty((0, n)), np.empty((0, n, n)), np.full(n, np.nan), np.full((n, n), np.nan)
        )
    information = information[sane][:, order][:, :, order]
    values = estimates["value"][sane][:, order]
    fused, covariance = fuse(values, information)
    own = [i for i, good in zip(frames, sane, strict=True) if good]
    return PerFrame(own, values, np.linalg.inv(information), fused, covariance)
