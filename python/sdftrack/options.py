# SPDX-License-Identifier: MIT
"""The options of the tracker, as the core describes them (cpp/tracking/options/option_schema.h)."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Any

from sdftrack import _core
from sdftrack._internal.option_files import read_tables
from sdftrack._internal.option_schema import check_fields, core_schema, described
from sdftrack._internal.unknown_option import refuse_unknown, refuses_unknown
from sdftrack.sensor import SensorModel

_SCHEMA = core_schema("tracker")
ALL_PIXELS = 10**8  # more than any image has


@refuses_unknown
@dataclass(frozen=True)
class TrackerOptions:
    """Options of :class:`sdftrack.Tracker`; any of them is also a keyword of it.

    Lengths are in metres, angles in radians; depth noise is a standard deviation along z. ``sdftrack config`` and
    docs/options.md describe every option; docs/results.md shows how the important ones affect the error.

    >>> TrackerOptions(padding_m=0.06).to_dict()["padding_m"]
    0.06
    """

    # options: written by bindings/generate_options.py
    residual: str = described(
        "ray_hit",
        "ray_hit: depth where the ray intersects the model minus measured depth; slope; point: as printed (Eq. 3.11)",
    )
    curvature: str = described("irls", "irls, or printed: J^T J of the log-likelihood's gradient (Eq. 3.18)")
    outlier_floor: float = described(0.1, "outlier fraction of the likelihood; 0: as printed")
    scale_start_m: float = described(
        0.005, "scale s of the first coarse stage, halved from stage to stage; 0: no coarse stages"
    )
    scale_per_noise: float = described(1.0, "scale s of the last stage, relative to the sensor noise")
    noise_m: float = described(0.001, "sensor noise: sigma(Z) = noise_m + noise_per_m Z^2")
    noise_per_m: float = described(0.0, "see noise_m")
    adapt_noise: bool = described(True, "rescale sigma(Z) in every frame by the residuals")
    systematic_m: float = described(
        0.0,
        "sd of the depth error shared by neighbouring pixels (stereo, time of flight); 0: estimated at a given pose",
    )
    max_systematic_m: float = described(
        0.008, "upper bound of the estimated systematic_m; 0: the sensor has no such error"
    )
    systematic_per_m: float = described(
        0.0, "the systematic error grows with distance: systematic_m + systematic_per_m Z^2"
    )
    lateral_px: float = described(
        0.0,
        "standard deviation of the lateral offset of the depth image from its intrinsics; widens the covariance",
    )
    correlation_area_px: float = described(
        0.0, "number of pixels that share one error; widens the covariance; 0: estimated"
    )
    min_correlation_area_px: float = described(0.0, "lower bound of the estimated correlation_area_px")
    padding_m: float = described(
        0.04, "pixels within this distance of the object's bounding box at its last pose are used"
    )
    retry_inliers: float = described(
        0.5, "at a start: a wider second attempt is made if the inlier fraction is below this; 0: never"
    )
    far_scale_m: float = described(0.012, "scale_start_m of the second attempt")
    far_padding_m: float = described(0.045, "padding_m of the second attempt")
    max_pixels: int = described(10000, "maximum number of pixels in the last stage")
    coarse_pixels: int = described(320, "maximum number of pixels in the coarse stages")
    fine_first: bool = described(
        True,
        "start each frame without coarse stages, in which a hand holding the object would pull the pose along",
    )
    damping_start: float = described(0.001, "initial Levenberg-Marquardt damping (100 in the thesis)")
    stop_rule: str = described(
        "gain",
        "gain: a stage ends once the predicted decrease is small; printed: once the damping exceeds 10e6 (Table 3.2)",
    )
    coarse_floor: float = described(
        0.3, "outlier_floor of the coarse stages for measurements in front of the surface"
    )
    coarse_floor_behind: float = described(
        0.02,
        "outlier_floor of the coarse stages for measurements behind the surface, where no occluder can be",
    )
    free_space: bool = described(True, "penalise model points in space that the sensor observes to be free")
    free_space_scale_m: float = described(0.003, "scale s of the free-space term")
    free_space_weight: float = described(
        1.0, "weight of the free-space term; 1: all its surface points together weigh as much as all pixels"
    )
    motion_sigma_m: float = described(
        0.03,
        "standard deviation of the weak prior on the translation, centred at the predicted pose; 0: no prior",
    )
    motion_sigma_rad: float = described(0.3, "standard deviation of the same prior on the rotation")
    drop_plane: bool = described(False, "ignore the pixels of the dominant plane (a table)")
    collision_tolerance_m: float = described(
        3e-05, "standard deviation of the penetration depth between objects"
    )
    union_sharpness: float = described(
        40.0, "sharpness of the soft minimum over several objects, per voxel, in the last stages"
    )
    coarse_union_sharpness: float = described(
        2.0, "sharpness of the soft minimum in the coarse stages; 2 in the thesis (section 5.2)"
    )
    color_likelihood: str = described(
        "odds",
        "odds: the colour sets each pixel's outlier fraction; printed: P_f d_on + P_b H_out (Eq. 4.18)",
    )
    color_prior: float = described(0.7, "foreground posterior of an uninformative colour")
    smooth_colors: bool = described(
        True, "combine the colour evidence of a pixel with that of its neighbours on the same surface"
    )
    color_free_space: bool = described(
        False, "treat a pixel without depth but with background colour as free space"
    )
    color_max_overlap: float = described(
        0.9, "mode auto: depth alone if the overlap of the histograms, sum sqrt(p_f p_b), exceeds this"
    )
    photometric: bool = described(
        True, "with a coloured shape and colour images: add a photometric term to the pose estimation"
    )
    photometric_weight: float = described(
        0.3, "weight of the photometric term; 1: according to its noise alone"
    )
    photometric_pixels: int = described(600, "number of pixels in the photometric term")
    outline: bool = described(
        True,
        "with colour images: use the object's outline (occluding contour) too; the only term in frames without depth",
    )
    outline_weight: float = described(
        1.0, "weight of the outline term; 1: according to its noise and that of the depth alone"
    )
    outline_points: int = described(120, "number of points on the outline in the outline term")
    outline_reach_px: int = described(8, "search distance on either side of the outline, near the pose")
    outline_far_px: int = described(
        24, "search distance on either side of the outline when the pose may be farther off"
    )
    outline_from_m: float = described(
        0.0005,
        "with depth, use the outline only if the depth measurements share an error of at least this; 0: always",
    )
    outline_local: bool = described(
        True,
        "learn the colours along the outline locally; False: those of the whole object and its whole surroundings",
    )
    recover_seeds: int = described(
        120, "rotations, of 240, that a search for a lost object tries per frame; bounds its time"
    )
    lost_inliers: float = described(
        0.3, "lost if the inlier fraction among unoccluded surface points is below this"
    )
    weak_inliers: float = described(0.55, "weak if that inlier fraction is below this")
    lost_evidence: float = described(0.02, "lost if the posterior probability of the pose is below this")
    weak_evidence: float = described(0.5, "weak if the posterior probability of the pose is below this")
    given_odds: float = described(20.0, "prior odds that the object is present at a given pose")
    search_odds: float = described(
        0.05,
        "prior odds that the result of a search without mask or box is the object; applies until a frame is ok",
    )
    # options: end

    def __post_init__(self) -> None:
        check_fields(self, _SCHEMA)

    @classmethod
    def printed(cls) -> TrackerOptions:
        """The energies and optimiser of the thesis (Eqs. 3.11, 3.18, 4.18, 5.14, Table 3.2), for comparisons.

        ``Tracker(..., collision="printed", motion="static", recover=False)`` should be combined with it; these are not
        options of this class. docs/math/depth_tracker.md, section 9, lists the remaining differences from the thesis.
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
        """Options for the depth errors of a sensor type, from published measurements.

        Parameters
        ----------
        sensor : "kinect_v1", "realsense_d400" or "azure_kinect"
            Structured light, active stereo and time of flight: :meth:`SensorModel.preset` lists the values and their
            sources.
        changes
            Further options, by name.

        Raises
        ------
        ValueError
            Unknown sensor name.
        """
        return cls(**{**SensorModel.preset(sensor).options(), **changes})

    @classmethod
    def fast(cls, **changes: Any) -> TrackerOptions:
        """Use 2,000 measurements per object and frame: about half the time, 1.5 times the noise.

        The default uses up to 10,000 and stays near the Cramér-Rao bound for all of them (docs/results.md). Objects
        with fewer than 2,000 measurements are tracked identically in both cases.
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
