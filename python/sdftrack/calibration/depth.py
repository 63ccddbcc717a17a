# SPDX-License-Identifier: MIT
"""Calibration of depth errors from images of a flat wall or table, or of a known object at known poses."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import of_kind
from sdftrack.calibration.depth_errors import (
    SPAN,
    DepthErrors,
    NoiseSample,
    errors_of_object,
    errors_of_plane,
    fit_growth,
    fit_noise,
    length_of,
    neighbour_correlation,
    noise_samples,
    rough_part,
    smooth_part,
)
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.sdf import SDF
from sdftrack.sensor import SensorModel

Array = NDArray[np.float64]
MIN_FRAMES = 5
MIN_PATCHES = 6
STEEPEST_DEG = (
    40.0  # of the straightest view: from slanted ones alone the noise of a straight one is not told
)
MIN_CORRELATION = 0.1  # of neighbours; below it each measurement has its own noise


@dataclass(frozen=True)
class DepthCalibration:
    """A sensor model, and the measurements it is based on.

    Attributes
    ----------
    sensor : SensorModel
    surface : "plane" or "object"
    used : int
        Number of frames used.
    noise : list of NoiseSample
        Sd at a distance and an incidence, per frame.
    systematic : (N, 2) float64
        Distance (m) and sd (m) of the smooth error of a surface, per frame.
    bias : (N, 2) float64
        Distance and measured minus true (m), per frame; empty for planes, whose true distance is unknown.
    left_out : dict of int to str
        Reason why a frame was not used.
    """

    sensor: SensorModel
    surface: str
    used: int
    noise: list[NoiseSample]
    systematic: Array
    bias: Array
    left_out: dict[int, str]


def calibrate_depth(
    frames: Iterable[Frame],
    camera: Camera | RGBDCamera,
    *,
    model: SDF | None = None,
    poses: Any = None,
    name: str = "calibrated",
    progress: Callable[[int], None] | None = None,
) -> DepthCalibration:
    """Measure the noise, its spatial correlation, and the bias (docs/sensors.md).

    Parameters
    ----------
    frames : iterable of Frame
        Of a wall or a table at several distances and angles, or of the object.
    camera : Camera or RGBDCamera
    model : SDF, optional
        A known object; None: the largest plane of each frame.
    poses : sequence or dict of (4, 4) float64, optional
        ``T_cam_obj`` per frame (None, or no entry, if unknown); only with `model`.
    name : str
        Name of the sensor model.
    progress : callable, optional
        Called with the number of frames processed.

    Raises
    ------
    ValueError
        Fewer than five frames with a plane or the object, none of them nearly frontal, or one of `model` and `poses`
        without the other.

    >>> sensor = calibrate_depth(seq, seq.camera).sensor  # doctest: +SKIP
    """
    if (model is None) != (poses is None):
        missing = "poses" if poses is None else "model"
        raise ValueError(f"{missing}: expected both model and poses, or neither (a wall or table), got None")
    if model is not None:
        of_kind(model, SDF, "model", "make one with SDF.from_mesh")
    left_out: dict[int, str] = {}
    measured = _Measured()
    total = 0
    for i, frame in enumerate(frames):
        total += 1
        lens = depth_camera(camera if frame.camera is None else frame.camera)
        try:
            measured.add(_errors(frame, lens, model, _pose_of(poses, i)))
        except ValueError as error:
            left_out[i] = str(error)
        if progress is not None:
            progress(total)
    if measured.used < MIN_FRAMES:
        shown = "a plane" if model is None else "the object at a known pose"
        why = f"; the last one: {list(left_out.values())[-1]}" if left_out else ""
        raise ValueError(
            f"frames: expected at least {MIN_FRAMES} that show {shown}, got {measured.used} of {total}{why}"
        )
    if not measured.noise:
        raise ValueError(
            "frames: expected surfaces of some hundred pixels at one distance, got smaller ones; move closer"
        )
    steep = math.degrees(math.atan(min(s.tangent for s in measured.noise)))
    if steep > STEEPEST_DEG:
        raise ValueError(
            f"frames: expected some views at less than {STEEPEST_DEG:.0f} degrees from its normal, "
            f"got {steep:.0f} and more; hold the camera more frontal to it"
        )
    surface = "plane" if model is None else "object"
    return DepthCalibration(
        measured.sensor(name, surface),
        surface,
        measured.used,
        measured.noise,
        np.array(measured.systematic).reshape(-1, 2),
        np.array(measured.bias).reshape(-1, 2) if model is not None else np.zeros((0, 2)),
        left_out,
    )


def _pose_of(poses: Any, i: int) -> Any:
    if poses is None:
        return None
    if isinstance(poses, dict):
        return poses.get(i)
    return poses[i] if i < len(poses) else None


def _errors(frame: Frame, camera: Camera, model: SDF | None, T: Any) -> DepthErrors:
    if frame.depth is None:
        raise ValueError("no depth image")
    if model is None:
        errors = errors_of_plane(frame, camera)
    elif T is None:
        raise ValueError("no pose is known")
    else:
        errors = errors_of_object(frame, camera, model, T)
    if errors.known.sum() < 400:
        raise ValueError("fewer than 400 depth measurements of it")
    return errors


class _Measured:
    """Measurements accumulated over the frames."""

    def __init__(self) -> None:
        self.used = 0
        self.noise: list[NoiseSample] = []
        self.correlations: list[float] = []
        self.systematic: list[tuple[float, float]] = []
        self.bias: list[tuple[float, float]] = []
        self.slopes: list[float] = []

    def add(self, errors: DepthErrors) -> None:
        known = errors.known
        z = float(np.median(errors.depth[known]))
        samples = noise_samples(errors)
        self.noise += samples
        r = neighbour_correlation(rough_part(errors))
        self.correlations += [r] if math.isfinite(r) else []
        patches = smooth_part(errors)
        if len(patches) >= MIN_PATCHES:
            spread = float(np.median(np.abs(patches - np.median(patches))) / 0.6745)
            self.systematic.append((z, spread))
        self.bias.append((z, float(np.median(errors.error[known]))))
        tangent = errors.tangent[known]
        if np.percentile(tangent, 90) - np.percentile(tangent, 10) > 0.4:
            self.slopes.append(float(np.polyfit(tangent, errors.error[known], 1)[0]))
        self.used += 1

    def sensor(self, name: str, surface: str) -> SensorModel:
        noise_m, noise_per_m, noise_incidence = fit_noise(self.noise)
        r = float(np.median(self.correlations)) if self.correlations else 0.0
        bias_m = bias_per_m = slope = 0.0
        systematic = np.array(self.systematic or [(1.0, 0.0)])
        s0, s2 = fit_growth(systematic[:, 0], systematic[:, 1], signed=False)
        z = np.array(self.bias)[:, 0]
        if surface == "object":
            offsets = np.array(self.bias)
            slope = float(np.median(self.slopes)) if len(self.slopes) >= MIN_FRAMES else 0.0
            bias_m, bias_per_m = fit_growth(z, offsets[:, 1], signed=True)
            left = offsets[:, 1] - bias_m - bias_per_m * z**2
            s0 = math.hypot(s0, float(np.median(np.abs(left))) / 0.6745)
        span = "" if z.max() > SPAN * z.min() else "; single distance: growth with distance is undetermined"
        return SensorModel(
            name,
            noise_m=noise_m if noise_m + noise_per_m > 0 else 1e-6,
            noise_per_m=noise_per_m,
            noise_incidence=noise_incidence,
            correlation_px=length_of(r) if r > MIN_CORRELATION else 0.0,
            bias_m=bias_m,
            bias_per_m=bias_per_m,
            bias_incidence_m=slope,
            systematic_m=s0,
            systematic_per_m=s2,
            source=f"{self.used} frames of {'a plane' if surface == 'plane' else 'a known object'} at "
            f"{z.min():.2f} to {z.max():.2f} m{span}",
        )
