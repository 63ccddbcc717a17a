# SPDX-License-Identifier: MIT
"""The options of the tracker, which the core describes (cpp/tracking/options/option_schema.h)."""

from __future__ import annotations

import os
from dataclasses import Field
from typing import Any, ClassVar, Self

from sdftrack import _core
from sdftrack._internal.option_files import options_from_file
from sdftrack.sensor import SensorModel

ALL_PIXELS = 10**8  # more than any image has


class TrackerOptions(_core.TrackerOptions):
    """Options of :class:`sdftrack.Tracker`; any of them is also a keyword of it.

    Lengths are in metres, angles in radians; depth noise is a standard deviation along z. ``sdftrack config`` and
    docs/options.md describe every option; docs/results.md shows how the important ones affect the error.

    >>> TrackerOptions(padding_m=0.06).to_dict()["padding_m"]
    0.06
    """

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]] = _core.TrackerOptions.fields()

    @classmethod
    def printed(cls) -> Self:
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
            color_learning="printed",
            color_prior=0.5,
            smooth_colors=False,
        )

    @classmethod
    def for_sensor(cls, sensor: str, **changes: Any) -> Self:
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
    def fast(cls, **changes: Any) -> Self:
        """Use 2,000 measurements per object and frame: about half the time, 1.5 times the noise.

        The default uses up to 10,000 and stays near the Cramér-Rao bound for all of them (docs/results.md). Objects
        with fewer than 2,000 measurements are tracked identically in both cases.
        """
        return cls(**{"max_pixels": 2000, **changes})

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Make options from ``{name: value}``; TypeError with the nearest name for an unknown one."""
        return cls(**values)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read a TOML file of ``name = value`` lines, at its top level or in a table ``[tracker]``."""
        return options_from_file(cls, path, "tracker")
