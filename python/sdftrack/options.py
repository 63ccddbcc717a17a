# SPDX-License-Identifier: MIT
"""The options of the tracker, as the core describes them (cpp/tracking/options/option_schema.h)."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Any

from sdftrack import _core
from sdftrack._internal.option_file import read_tables
from sdftrack._internal.option_schema import check_fields, core_schema, described
from sdftrack._internal.unknown_option import refuse_unknown, refuses_unknown
from sdftrack.sensor import SensorModel

__all__ = ["TrackerOptions"]

_SCHEMA = core_schema("tracker")
ALL_PIXELS = 10**8  # more than any image has


@refuses_unknown
@dataclass(frozen=True)
class TrackerOptions:
    """Options of :class:`sdftrack.Tracker`; any of them is also a keyword of it.

    Lengths are metres, angles radians, depth noise is a standard deviation along z. Each option's meaning is printed
    by ``sdftrack config`` and stands in docs/options.md; docs/results.md shows what the important ones do to the error.

    >>> TrackerOptions(padding_m=0.06).to_dict()["padding_m"]
    0.06
    """

    # options: written by bindings/generate_options.py
    residual: str = described(
        "ray_hit",
        "ray_hit: depth where the ray meets the model minus measured; slope; point: as printed (Eq. 3.11)",
    )
    curvature: str = described("irls", "irls, or printed: J^T J of the log-likelihood's gradient (Eq. 3.18)")
    outlier_floor: float = described(0.1, "share of outliers in the likelihood; 0: as printed")
    scale_start_m: float = described(0.005, "s of the first coarse stage, halved stage by stage; 0: none")
    scale_per_noise: float = described(1.0, "s of the last stage over the sensor's noise")
    noise_m: float = described(0.001, "sensor noise sigma(Z) = noise_m + noise_per_m Z^2")
    noise_per_m: float = described(0.0, "see noise_m")
    adapt_noise: bool = described(True, "rescale sigma(Z) by the residuals, frame by frame")
    systematic_m: float = described(
        0.0,
        "sd of the depth error that neighbouring readings share (stereo, time of flight); 0: learnt at a given pose",
    )
    max_systematic_m: float = described(0.008, "most that is learnt for systematic_m")
    systematic_per_m: float = described(0.0, "grows with distance: systematic_m + systematic_per_m Z^2")
    lateral_px: float = described(
        0.0, "sd of where the depth image lies against its intrinsics; widens the covariance"
    )
    correlation_area_px: float = described(
        0.0, "pixels that share one error; widens the covariance; 0: measured"
    )
    min_correlation_area_px: float = described(0.0, "least that is measured for correlation_area_px")
    padding_m: float = described(0.04, "pixels count this near the object's box at its last pose")
    retry_inliers: float = described(
        0.5, "at a start: share of agreeing points below which a wider attempt is made; 0: never one"
    )
    far_scale_m: float = described(0.012, "scale_start_m of that attempt")
    far_padding_m: float = described(0.045, "padding_m of that attempt")
    max_pixels: int = described(10000, "budget of the last stage")
    coarse_pixels: int = described(320, "budget of the coarse stages")
    min_pixels: int = described(40, "fewer readings near the object: lost")
    fine_first: bool = described(
        True, "begin each frame without coarse stages, which a hand on the object would draw along"
    )
    damping_start: float = described(0.001, "Levenberg-Marquardt damping (the source starts at 100)")
    keep_damping: bool = described(False, "carry the damping from frame to frame")
    stop_rule: str = described(
        "gain",
        "gain: a stage ends where its next step promises little; printed: where the damping passes 10e6 (Table 3.2)",
    )
    coarse_floor: float = described(
        0.3, "outlier_floor of the coarse stages, for readings in front of the surface"
    )
    coarse_floor_behind: float = described(0.02, "the same behind it, where nothing can hide")
    coarse_steps: int = described(3, "trials per coarse stage")
    fine_steps: int = described(8, "trials of the last stage")
    free_space: bool = described(True, "a model point may not stand where the sensor sees past it")
    free_space_scale_m: float = described(0.003, "s of the free-space term")
    free_space_weight: float = described(1.0, "1: all surface points weigh as much as all pixels")
    free_space_points: int = described(120, "surface points of the free-space term")
    motion_sigma_m: float = described(0.03, "weak prior about the predicted pose; 0: none")
    motion_sigma_rad: float = described(0.3, "the same for the rotation")
    drop_plane: bool = described(False, "leave out the pixels of the dominant plane (a table)")
    collision_tolerance_m: float = described(
        3e-05, "how deep objects may stand in one another, as one standard deviation"
    )
    union_sharpness: float = described(
        40.0, "of the soft minimum of several objects, per voxel, in the last stages"
    )
    coarse_union_sharpness: float = described(
        2.0, "the same in the coarse stages; 2 is the source's (thesis, section 5.2)"
    )
    color_likelihood: str = described(
        "odds",
        "odds: the colour sets each pixel's share of outliers; printed: P_f d_on + P_b H_out (Eq. 4.18)",
    )
    color_prior: float = described(0.7, "posterior of a colour that says nothing")
    color_object_rate: float = described(0.05, "share of each new frame in the object's histogram (Eq. 4.22)")
    color_background_rate: float = described(0.3, "the same for the background's")
    smooth_colors: bool = described(
        True, "whether a reading is the object's is asked of the readings around it, too"
    )
    color_free_space: bool = described(
        False, "a pixel without depth but of the background's colour is free space"
    )
    color_max_overlap: float = described(
        0.9, "auto: depth alone where sum sqrt(p_f p_b) of the histograms is above"
    )
    photometric: bool = described(
        True, "with a coloured shape and colour images: their brightness holds the pose too"
    )
    photometric_sigma: float = described(
        0.03, "standard deviation of a pixel's brightness, of its full range"
    )
    photometric_weight: float = described(0.3, "of that term; 1: as its noise says")
    photometric_pixels: int = described(600, "pixels that it looks at")
    outline: bool = described(
        True,
        "with colour images: the object's outline in them holds the pose too, and alone where a frame has no depth",
    )
    outline_weight: float = described(1.0, "of that term; 1: as its noise and that of the depth say")
    outline_points: int = described(120, "places on the outline that it looks at")
    outline_reach_px: int = described(8, "how far to both sides of the outline it looks, near the pose")
    outline_far_px: int = described(24, "the same where the pose may be farther off")
    outline_from_m: float = described(
        0.0005, "beside depth only where its readings are seen to share an error as large as this; 0: always"
    )
    outline_local: bool = described(
        True,
        "the colours on its two sides are learnt place by place; False: those of the whole object and of all around it",
    )
    recover_seeds: int = described(
        120, "rotations that a search for a lost object tries per frame, of 240: bounds its time"
    )
    lost_inliers: float = described(0.3, "lost below this share of agreeing points among those not hidden")
    weak_inliers: float = described(0.55, "weak below it")
    lost_evidence: float = described(
        0.02, "lost where the evidence gives the pose a smaller chance than this"
    )
    weak_evidence: float = described(0.5, "weak below it")
    given_odds: float = described(20.0, "odds of an object at a pose that is given, before any evidence")
    search_odds: float = described(
        0.05,
        "odds, before any evidence, that what a search without mask or box finds is the object; until a frame is ok",
    )
    trust_points: int = described(320, "surface points asked for the status")
    # options: end

    def __post_init__(self) -> None:
        check_fields(self, _SCHEMA)

    @classmethod
    def printed(cls) -> TrackerOptions:
        """The source's energies and optimiser (thesis Eqs. 3.11, 3.18, 4.18, 5.14, Table 3.2): for comparisons.

        ``Tracker(..., collision="printed", motion="static", recover=False)`` goes with it, which are not options of
        this class. docs/math/depth_tracker.md, section 9, lists what is left between it and the source.
        """
        return cls(
            residual="point",
            curvature="printed",
            outlier_floor=0.0,
            scale_start_m=0.0,
            fine_first=False,
            max_pixels=ALL_PIXELS,
            damping_start=100.0,
            stop_rule="printed",
            coarse_pixels=ALL_PIXELS,
            fine_steps=100,
            free_space=False,
            photometric=False,
            outline=False,
            drop_plane=False,
            motion_sigma_m=0.0,
            padding_m=0.04,
            retry_inliers=0.0,
            adapt_noise=False,
            max_systematic_m=0.0,
            noise_m=0.002,
            scale_per_noise=1.0,
            union_sharpness=2.0,
            coarse_union_sharpness=2.0,
            color_likelihood="printed",
            color_prior=0.5,
            smooth_colors=False,
        )

    @classmethod
    def for_sensor(cls, sensor: str, **changes: Any) -> TrackerOptions:
        """The depth errors of a kind of sensor, from published measurements.

        Parameters
        ----------
        sensor : "kinect_v1", "realsense_d400" or "azure_kinect"
            Structured light, active stereo and time of flight: :meth:`SensorModel.preset` has the numbers and their
            sources.
        changes
            Further options, by their names.

        Raises
        ------
        ValueError
            Another name.
        """
        return cls(**{**SensorModel.preset(sensor).options(), **changes})

    @classmethod
    def fast(cls, **changes: Any) -> TrackerOptions:
        """Two thousand readings per object and frame: about half the time, one and a half times the noise.

        The default uses up to 10,000 and stays near the Cramér-Rao bound of all of them (docs/results.md). An object
        that shows fewer than 2,000 is tracked alike by both.
        """
        return cls(**{"max_pixels": 2000, **changes})

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> TrackerOptions:
        """Make options from ``{name: value}``; TypeError with the nearest name for an unknown one."""
        refuse_unknown(values, _SCHEMA)
        return cls(**values)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> TrackerOptions:
        """Read a TOML file of ``name = value`` lines, at its top level or in a table ``[tracker]``."""
        table = read_tables(path)["tracker"]
        try:
            return cls.from_dict(table)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{os.fspath(path)}: {error}") from None

    def to_dict(self) -> dict[str, Any]:
        """Return ``{name: value}``."""
        return dataclasses.asdict(self)

    def replace(self, **changes: Any) -> TrackerOptions:
        """Return a copy with some options changed."""
        return TrackerOptions.from_dict({**self.to_dict(), **changes})

    def _to_core(self) -> _core.TrackerOptions:
        core = _core.TrackerOptions()
        for name, value in self.to_dict().items():
            setattr(core, name, value)
        return core
