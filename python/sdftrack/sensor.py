# SPDX-License-Identifier: MIT
"""The error model of a depth camera: noise, its correlation between pixels, and bias."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.files import write_text
from sdftrack._internal.text_files import read_json, read_toml, reason
from sdftrack._internal.unknown_option import refuse_unknown, refuses_unknown
from sdftrack._internal.validation import number, one_of

Array = NDArray[np.float64]
STEEPEST = math.radians(85)  # incidences beyond it count as this one
HEAD = "# Depth sensor: lengths in metres, see docs/sensors.md. Use: st.Tracker(..., sensor=FILE) or --sensor FILE\n"
USUAL_INCIDENCE = math.radians(30)  # of a measurement on an object


@refuses_unknown
@dataclass(frozen=True)
class SensorModel:
    """depth = true + bias(Z, incidence) + noise(Z, incidence), lengths in metres along z.

    The noise has the standard deviation (sd) ``hypot(noise_m + noise_per_m Z^2, noise_incidence Z tan(incidence))`` and
    is spatially correlated: two measurements d pixels apart have the correlation ``exp(-d^2 / (2 correlation_px^2))``.
    The bias is ``bias_m + bias_per_m Z^2 + bias_incidence_m tan(incidence)``. The residual bias after correction varies
    smoothly over an object, with the sd ``systematic_m + systematic_per_m Z^2``.

    Attributes
    ----------
    name : str
        Name of the model in results.
    noise_m, noise_per_m, noise_incidence : float
    correlation_px : float
        Correlation length of the noise, pixels; 0: the noise of all pixels is independent.
    bias_m, bias_per_m, bias_incidence_m : float
        Measured minus true. A tracker subtracts the first two from each measurement. The third counts as uncertainty,
        because the incidence is unknown until the pose is known.
    systematic_m, systematic_per_m : float
        Sd of the systematic error over a part of a surface. 0: estimated by the tracker in a frame whose pose is given.
    lateral_px : float
        Sd of the lateral offset of the depth image from its intrinsics, pixels.
    source : str
        Source of the values.

    >>> sensor = SensorModel.preset("kinect_v1")
    >>> round(1e3 * float(sensor.noise(2.0)), 1)
    5.9
    """

    name: str = "unnamed"
    noise_m: float = 0.001
    noise_per_m: float = 0.0
    noise_incidence: float = 0.0
    correlation_px: float = 0.0
    bias_m: float = 0.0
    bias_per_m: float = 0.0
    bias_incidence_m: float = 0.0
    systematic_m: float = 0.0
    systematic_per_m: float = 0.0
    lateral_px: float = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.type == "str":
                if not isinstance(value, str):
                    raise TypeError(f"{field.name}: expected a string, got {value!r}")
                continue
            value = number(value, field.name)
            signed = field.name.startswith("bias")
            if not math.isfinite(value) or (value < 0 and not signed):
                raise ValueError(
                    f"{field.name}: expected a finite number{'' if signed else ' >= 0'}, got {value!r}"
                )
            object.__setattr__(self, field.name, value)
        if not self.noise_m + self.noise_per_m > 0:
            raise ValueError("noise_m, noise_per_m: expected at least one of them above 0, got 0 and 0")

    def noise(self, depth_m: ArrayLike, incidence_rad: ArrayLike = 0.0) -> Array:
        """Sd of the noise at a distance and an angle between ray and surface normal."""
        z = np.asarray(depth_m, np.float64)
        straight = self.noise_m + self.noise_per_m * z**2
        return np.hypot(straight, self.noise_incidence * z * _tan(incidence_rad))

    def bias(self, depth_m: ArrayLike, incidence_rad: ArrayLike = 0.0) -> Array:
        """Mean of measured minus true."""
        z = np.asarray(depth_m, np.float64)
        return self.bias_m + self.bias_per_m * z**2 + self.bias_incidence_m * _tan(incidence_rad)

    def systematic(self, depth_m: ArrayLike) -> Array:
        """Sd of the residual bias over a part of a surface."""
        z = np.asarray(depth_m, np.float64)
        slanted = self.bias_incidence_m * math.tan(USUAL_INCIDENCE)
        return np.hypot(self.systematic_m + self.systematic_per_m * z**2, slanted)

    @property
    def correlation_area_px(self) -> float:
        """Number of pixels that share one error: the sum of the correlations of one pixel with all others."""
        return 2 * math.pi * self.correlation_px**2

    @property
    def corrects(self) -> bool:
        """Whether :meth:`corrected` changes a depth image."""
        return self.bias_m != 0 or self.bias_per_m != 0

    def corrected(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a depth image (m, 0 = none) with the distance-dependent bias removed."""
        if not self.corrects:
            return depth
        z = np.multiply(depth, depth, dtype=np.float32)  # few passes: this is done to every frame
        z *= np.float32(-self.bias_per_m)
        z += depth
        z -= np.float32(self.bias_m)
        np.maximum(z, np.float32(0), out=z)
        z *= depth > 0
        return z

    def options(self) -> dict[str, float]:
        """The equivalent tracker options, by name."""
        return {
            "noise_m": max(self.noise_m, 1e-6),
            "noise_per_m": self.noise_per_m,
            "systematic_m": math.hypot(self.systematic_m, self.bias_incidence_m * math.tan(USUAL_INCIDENCE)),
            "systematic_per_m": self.systematic_per_m,
            "lateral_px": self.lateral_px,
            "min_correlation_area_px": self.correlation_area_px,
        }

    def quantized(self, sd_m: float, sd_per_m: float) -> SensorModel:
        """Return the model of depth that was also stored in few bits, with the sd ``sd_m + sd_per_m Z^2``."""
        noise = math.hypot(self.noise_m, sd_m), math.hypot(self.noise_per_m, sd_per_m)
        return self.replace(noise_m=noise[0], noise_per_m=noise[1])

    def replace(self, **changes: Any) -> SensorModel:
        """Return a copy with some values changed."""
        return SensorModel.from_dict({**dataclasses.asdict(self), **changes})

    def to_dict(self) -> dict[str, Any]:
        """Return ``{name: value}``."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: dict[str, Any]) -> SensorModel:
        """Make a model from ``{name: value}``; TypeError with the nearest name for an unknown one."""
        refuse_unknown(values, [f.name for f in dataclasses.fields(SensorModel)])
        return SensorModel(**values)

    @staticmethod
    def preset(name: str) -> SensorModel:
        """Return a sensor model from published measurements: "kinect_v1", "realsense_d400" or "azure_kinect"."""
        return PRESETS[one_of(name, PRESETS, "sensor")]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to a TOML file (JSON if the name ends in .json), completely or not at all."""
        if Path(path).suffix.lower() == ".json":
            text = json.dumps(self.to_dict(), indent=2) + "\n"
        else:
            text = HEAD + "".join(f"{name} = {json.dumps(value)}\n" for name, value in self.to_dict().items())
        write_text(path, text)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> SensorModel:
        """Read what :meth:`save` wrote."""
        if not os.path.isfile(path):
            raise FileNotFoundError(f"sensor: no such file: {os.fspath(path)}")
        try:
            values = read_json(path) if Path(path).suffix.lower() == ".json" else read_toml(path)
            if not isinstance(values, dict):
                kind = type(values).__name__
                raise ValueError(f"sensor: expected one object of names and values, got a {kind}")
            return SensorModel.from_dict(values)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{os.fspath(path)}: {reason(error)}") from None

    @overload
    @staticmethod
    def of(given: None) -> None: ...
    @overload
    @staticmethod
    def of(given: SensorModel | str | os.PathLike[str]) -> SensorModel: ...
    @staticmethod
    def of(given: SensorModel | str | os.PathLike[str] | None) -> SensorModel | None:
        """Resolve a model that is given as itself, as a preset's name, or as a file."""
        if given is None or isinstance(given, SensorModel):
            return given
        if not isinstance(given, (str, os.PathLike)):
            raise TypeError(
                f"sensor: expected a SensorModel, a preset ({', '.join(PRESETS)}) or a file, got {given!r}"
            )
        if isinstance(given, str) and given in PRESETS:
            return PRESETS[given]
        if not os.path.exists(given):
            raise ValueError(
                f"sensor: expected one of {', '.join(map(repr, PRESETS))} or a file that `sdftrack calibrate depth` "
                f"wrote, got {os.fspath(given)!r}"
            )
        return SensorModel.load(given)


def _tan(incidence_rad: ArrayLike) -> Array:
    angle = np.minimum(np.abs(np.asarray(incidence_rad, np.float64)), STEEPEST)
    return np.tan(angle)


PRESETS = {sensor["name"]: SensorModel(**sensor) for sensor in _core.sensor_presets()}
