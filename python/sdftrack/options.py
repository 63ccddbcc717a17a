# SPDX-License-Identifier: MIT
"""The options of the tracker. Their defaults live in the core and are read from there."""

from __future__ import annotations

import dataclasses
import difflib
import os
from dataclasses import dataclass, field
from typing import Any

from sdftrack import _core

__all__ = ["TrackerOptions"]

_DEFAULTS = _core.TrackerOptions()


def _option(name: str, meaning: str) -> Any:
    default = getattr(_DEFAULTS, name)
    return field(default=getattr(default, "name", default), metadata={"meaning": meaning})


@dataclass(frozen=True)
class TrackerOptions:
    """Options of :class:`sdftrack.Tracker`; any of them is also a keyword of it.

    Lengths are metres, angles radians, depth noise is a standard deviation along z. Each option's meaning is printed
    by ``sdftrack config``; docs/results.md shows what the important ones do to the error.

    >>> TrackerOptions(padding_m=0.06).to_dict()["padding_m"]
    0.06
    """

    residual: str = _option(
        "residual",
        "ray_hit: depth where the ray meets the model minus measured; slope; point: as printed (Eq. 3.11)",
    )
    curvature: str = _option(
        "curvature", "irls, or printed: J^T J of the log-likelihood's gradient (Eq. 3.18)"
    )
    outlier_floor: float = _option("outlier_floor", "share of outliers in the likelihood; 0: as printed")
    scale_start_m: float = _option(
        "scale_start_m", "s of the first coarse stage, halved stage by stage; 0: none"
    )
    scale_per_noise: float = _option("scale_per_noise", "s of the last stage over the sensor's noise")
    noise_m: float = _option("noise_m", "sensor noise sigma(Z) = noise_m + noise_per_m Z^2")
    noise_per_m: float = _option("noise_per_m", "see noise_m; 1/m")
    adapt_noise: bool = _option("adapt_noise", "rescale sigma(Z) by the residuals, frame by frame")
    correlation_area_px: float = _option(
        "correlation_area_px", "pixels that share one error; widens the covariance; 0: measured"
    )
    padding_m: float = _option("padding_m", "pixels count this near the object's box at its last pose")
    retry_inliers: float = _option(
        "retry_inliers",
        "at a start: share of agreeing points below which a wider attempt is made; 0: never one",
    )
    far_scale_m: float = _option("far_scale_m", "scale_start_m of that attempt")
    far_padding_m: float = _option("far_padding_m", "padding_m of that attempt")
    max_pixels: int = _option("max_pixels", "budget of the last stage")
    coarse_pixels: int = _option("coarse_pixels", "budget of the coarse stages")
    min_pixels: int = _option("min_pixels", "fewer readings near the object: lost")
    damping_start: float = _option("damping_start", "Levenberg-Marquardt damping (the source starts at 100)")
    keep_damping: bool = _option("keep_damping", "carry the damping from frame to frame")
    coarse_floor: float = _option(
        "coarse_floor", "outlier_floor of the coarse stages, for readings in front of the surface"
    )
    coarse_floor_behind: float = _option("coarse_floor_behind", "the same behind it, where nothing can hide")
    coarse_steps: int = _option("coarse_steps", "trials per coarse stage")
    fine_steps: int = _option("fine_steps", "trials of the last stage")
    free_space: bool = _option("free_space", "a model point may not stand where the sensor sees past it")
    free_space_scale_m: float = _option("free_space_scale_m", "s of the free-space term")
    free_space_weight: float = _option(
        "free_space_weight", "1: all surface points weigh as much as all pixels"
    )
    free_space_points: int = _option("free_space_points", "surface points of the free-space term")
    motion_sigma_m: float = _option("motion_sigma_m", "weak prior about the predicted pose; 0: none")
    motion_sigma_rad: float = _option("motion_sigma_rad", "the same for the turn")
    drop_plane: bool = _option("drop_plane", "leave out the pixels of the dominant plane (a table)")
    collision_tolerance_m: float = _option(
        "collision_tolerance_m", "how deep objects may stand in one another, as one standard deviation"
    )
    union_sharpness: float = _option(
        "union_sharpness", "of the soft minimum of several objects, per voxel, in the last stages"
    )
    coarse_union_sharpness: float = _option(
        "coarse_union_sharpness", "the same in the coarse stages; 2 is the source's (thesis, section 5.2)"
    )
    color_likelihood: str = _option(
        "color_likelihood",
        "odds: the colour sets each pixel's share of outliers; printed: P_f d_on + P_b H_out (Eq. 4.18)",
    )
    color_prior: float = _option("color_prior", "posterior of a colour that says nothing")
    color_object_rate: float = _option(
        "color_object_rate", "share of each new frame in the object's histogram (Eq. 4.22)"
    )
    color_background_rate: float = _option("color_background_rate", "the same for the background's")
    color_free_space: bool = _option(
        "color_free_space", "a pixel without depth but of the background's colour is free space"
    )
    color_max_overlap: float = _option(
        "color_max_overlap", "auto: depth alone where sum sqrt(p_f p_b) of the histograms is above"
    )
    photometric: bool = _option(
        "photometric", "with a coloured shape and colour images: their brightness holds the pose too"
    )
    photometric_sigma: float = _option(
        "photometric_sigma", "standard deviation of a pixel's brightness, of its full range"
    )
    photometric_weight: float = _option("photometric_weight", "of that term; 1: as its noise says")
    photometric_pixels: int = _option("photometric_pixels", "pixels that it looks at")
    recover_seeds: int = _option(
        "recover_seeds", "rotations that a search for a lost object tries per frame, of 240: bounds its time"
    )
    lost_inliers: float = _option(
        "lost_inliers", "lost below this share of agreeing points among those not hidden"
    )
    weak_inliers: float = _option("weak_inliers", "weak below it")
    lost_evidence: float = _option(
        "lost_evidence", "lost where the evidence gives the pose a smaller chance than this"
    )
    weak_evidence: float = _option("weak_evidence", "weak below it")
    search_odds: float = _option(
        "search_odds",
        "odds, before any evidence, that what a search without mask or box finds is the object; "
        "they hold until a frame is ok",
    )
    trust_points: int = _option("trust_points", "surface points asked for the status")

    def __post_init__(self) -> None:
        for f in dataclasses.fields(self):
            default, value = getattr(_DEFAULTS, f.name), getattr(self, f.name)
            if hasattr(default, "name"):
                known = list(type(default).__members__)
                if value not in known:
                    raise ValueError(f"{f.name}: expected one of {known}, got {value!r}")
            elif isinstance(default, bool):
                if not isinstance(value, bool):
                    raise TypeError(f"{f.name}: expected True or False, got {value!r}")
            else:
                _check_number(f.name, value, integer=isinstance(default, int))

    @classmethod
    def printed(cls) -> TrackerOptions:
        """The source's own energy and optimiser (thesis Eq. 3.11, 3.18, Table 3.2): for comparisons."""
        return cls(
            residual="point",
            curvature="printed",
            outlier_floor=0.0,
            scale_start_m=0.0,
            damping_start=100.0,
            fine_steps=30,
            free_space=False,
            photometric=False,
            drop_plane=False,
            motion_sigma_m=0.0,
            padding_m=0.04,
            retry_inliers=0.0,
            adapt_noise=False,
            noise_m=0.002,
            scale_per_noise=1.0,
        )

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
        names = [f.name for f in dataclasses.fields(cls)]
        for name in values:
            if name not in names:
                near = difflib.get_close_matches(name, names, 1)
                hint = f"; did you mean {near[0]!r}?" if near else f"; known: {', '.join(names)}"
                raise TypeError(f"unknown option {name!r}{hint}")
        return cls(**values)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> TrackerOptions:
        """Read a TOML file of ``name = value`` lines, at its top level or in a table ``[tracker]``."""
        from sdftrack.config import read_tables

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
            default = getattr(_DEFAULTS, name)
            setattr(core, name, type(default).__members__[value] if hasattr(default, "name") else value)
        return core


_MAY_BE_ZERO = {
    "outlier_floor", "coarse_floor", "coarse_floor_behind",
    "scale_start_m", "noise_per_m", "padding_m", "coarse_steps", "damping_start",
    "free_space_weight", "retry_inliers", "far_scale_m", "far_padding_m", "motion_sigma_m",
    "motion_sigma_rad", "lost_inliers", "weak_inliers", "lost_evidence", "weak_evidence", "correlation_area_px",
    "color_object_rate", "color_background_rate", "color_max_overlap",
}  # fmt: skip


def _check_number(name: str, value: Any, integer: bool) -> None:
    kind = "a whole number" if integer else "a number"
    if isinstance(value, bool) or not isinstance(value, int if integer else (int, float)):
        raise TypeError(f"{name}: expected {kind}, got {value!r}")
    if not 0 <= value < 1e9 or (value == 0 and name not in _MAY_BE_ZERO):
        raise ValueError(
            f"{name}: expected {kind} {'>= 0' if name in _MAY_BE_ZERO else '> 0'}, got {value!r}"
        )
    if name in ("outlier_floor", "coarse_floor", "coarse_floor_behind", "color_prior") and value >= 1:
        raise ValueError(f"{name}: expected a share below 1, got {value!r}")
    if name in ("color_object_rate", "color_background_rate") and value > 1:
        raise ValueError(f"{name}: expected a share of at most 1, got {value!r}")
