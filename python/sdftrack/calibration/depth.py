# SPDX-License-Identifier: MIT
"""Calibration of depth errors from images of a flat wall or table, or of a known object at known poses."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.validation import of_kind
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.imaging.plane import remove_plane
from sdftrack.sdf import SDF
from sdftrack.sensor import SensorModel

Array = NDArray[np.float64]
MIN_FRAMES = 5
MIN_READINGS = 400  # of the surface in a frame
STEEPEST_DEG = 40.0  # of the straightest view: slanted ones do not tell the noise of a straight one
MIN_CORRELATION = 0.1  # of neighbours; below it each measurement has its own noise


class NoiseSample(NamedTuple):
    """Noise sd (m) of measurements at one distance (m) and tan(incidence)."""

    depth: float
    tangent: float
    sd: float
    readings: int


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
    known = poses if isinstance(poses, dict) else dict(enumerate(() if poses is None else poses))
    left_out: dict[int, str] = {}
    found: list[_core.ImageNoise] = []
    total = 0
    for i, frame in enumerate(frames):
        total += 1
        lens = depth_camera(camera if frame.camera is None else frame.camera)
        try:
            found.append(_noise(frame, lens, model, known.get(i)))
        except ValueError as error:
            left_out[i] = str(error)
        if progress is not None:
            progress(total)
    if len(found) < MIN_FRAMES:
        shown = "a plane" if model is None else "the object at a known pose"
        why = f"; the last one: {list(left_out.values())[-1]}" if left_out else ""
        raise ValueError(
            f"frames: expected at least {MIN_FRAMES} that show {shown}, got {len(found)} of {total}{why}"
        )
    noise = [NoiseSample(*sample) for image in found for sample in image.samples]
    if not noise:
        raise ValueError(
            "frames: expected surfaces of some hundred pixels at one distance, got smaller ones; move closer"
        )
    steep = math.degrees(math.atan(min(s.tangent for s in noise)))
    if steep > STEEPEST_DEG:
        raise ValueError(
            f"frames: expected some views at less than {STEEPEST_DEG:.0f} degrees from its normal, "
            f"got {steep:.0f} and more; hold the camera more frontal to it"
        )
    systematic = [(f.depth_m, f.systematic_m) for f in found if math.isfinite(f.systematic_m)]
    bias = [(f.depth_m, f.bias_m) for f in found]
    return DepthCalibration(
        _sensor(name, found, noise, systematic, model is not None),
        "plane" if model is None else "object",
        len(found),
        noise,
        np.array(systematic).reshape(-1, 2),
        np.array(bias if model is not None else []).reshape(-1, 2),
        left_out,
    )


def _noise(frame: Frame, camera: Camera, model: SDF | None, T: Any) -> _core.ImageNoise:
    """What a frame says, from its errors relative to the largest plane, or to the object at its pose."""
    if frame.depth is None:
        raise ValueError("no depth image")
    depth = np.ascontiguousarray(frame.depth)
    if model is None:
        beside, (normal, offset) = remove_plane(frame, camera, feet=False)
        found = _core.plane_noise(
            depth, frame._given, camera._core, beside.view(np.uint8), normal.tolist(), offset
        )
    elif T is None:
        raise ValueError("no pose is known")
    else:
        found = _core.surface_noise(
            depth, frame._given, camera._core, *model.render(camera, np.asarray(T, np.float64))
        )
    if found.known < MIN_READINGS:
        raise ValueError(f"fewer than {MIN_READINGS} depth measurements of it")
    return found


def _sensor(
    name: str,
    found: list[_core.ImageNoise],
    noise: list[NoiseSample],
    systematic: list[tuple[float, float]],
    of_object: bool,
) -> SensorModel:
    noise_m, noise_per_m, noise_incidence = _core.fit_noise(noise)
    correlations = [f.correlation for f in found if math.isfinite(f.correlation)]
    r = float(np.median(correlations)) if correlations else 0.0
    bias_m = bias_per_m = slope = 0.0
    smooth = systematic or [(1.0, 0.0)]
    s0, s2 = _core.fit_growth([z for z, _ in smooth], [sd for _, sd in smooth], is_signed=False)
    z = np.array([f.depth_m for f in found])
    if of_object:
        bias = np.array([f.bias_m for f in found])
        slopes = [f.bias_by_tangent for f in found if math.isfinite(f.bias_by_tangent)]
        slope = float(np.median(slopes)) if len(slopes) >= MIN_FRAMES else 0.0
        bias_m, bias_per_m = _core.fit_growth(z.tolist(), bias.tolist(), is_signed=True)
        s0 = math.hypot(s0, float(np.median(np.abs(bias - bias_m - bias_per_m * z**2))) / 0.6745)
    span = "" if _core.span_is_wide(z.tolist()) else "; single distance: growth with distance is undetermined"
    return SensorModel(
        name,
        noise_m=noise_m if noise_m + noise_per_m > 0 else 1e-6,
        noise_per_m=noise_per_m,
        noise_incidence=noise_incidence,
        correlation_px=_core.correlation_length(r) if r > MIN_CORRELATION else 0.0,
        bias_m=bias_m,
        bias_per_m=bias_per_m,
        bias_incidence_m=slope,
        systematic_m=s0,
        systematic_per_m=s2,
        source=f"{len(found)} frames of {'a known object' if of_object else 'a plane'} at "
        f"{z.min():.2f} to {z.max():.2f} m{span}",
    )
