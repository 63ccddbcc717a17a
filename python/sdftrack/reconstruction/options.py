# SPDX-License-Identifier: MIT
"""The options of a reconstructor, as the core (cpp/reconstruction/option_schema.h) and Python describe them."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Any

from sdftrack import _core
from sdftrack._internal.option_declarations import schema_of
from sdftrack._internal.option_file import read_tables
from sdftrack._internal.option_schema import check_fields, core_schema, described
from sdftrack._internal.unknown_option import refuse_unknown, refuses_unknown

__all__ = ["ReconstructorOptions"]

_SCHEMA = schema_of("reconstruct")


@refuses_unknown
@dataclass(frozen=True)
class ReconstructorOptions:
    """Options of :class:`sdftrack.Reconstructor`; any of them is also a keyword of it. Metres, unless said.

    >>> ReconstructorOptions(evidence="printed").sigma_d_m
    0.003
    """

    # options: written by bindings/generate_options.py
    evolution: str = described(
        "ours", "ours, or printed: the thesis' evidence, gradient flow and tracker (Eqs. 4.18, 4.29 to 4.42)"
    )
    evidence: str = described(
        "smooth", "likelihood of a voxel: smooth, or printed (thesis Eqs. 4.29 to 4.31)"
    )
    sigma_d_m: float = described(
        0.003, "how far from a reading it says something; from twice that behind it nothing is said"
    )
    sigma_d_voxels: float = described(
        8.0, "in place of sigma_d_m with evolution printed, as the thesis has it"
    )
    evolution_steps: int = described(15, "of the printed evolution after each frame; 100 after the first")
    noise_m: float | None = described(None, "sd of the depth; None: measured on the first frame's mask")
    noise_per_m: float = described(0.0, "the noise grows as noise_m + noise_per_m Z^2")
    carve_from_m: float = described(0.003, "nearer before a reading nothing is carved")
    memory: float = described(
        100.0, "frames that a voxel remembers; fewer forget mistakes sooner, more average better"
    )
    known_every: int = described(
        2, "a place that 30 frames have shown takes one of so many that follow; 1: all of them"
    )
    border_px: int = described(
        2, "the object's pixels this near to an outline or a jump of depth say nothing"
    )
    prior: float = described(0.4, "log ratio of the first guess, inside +, outside -; 0: no prior")
    least_seen: float = described(0.15, "views after which a piece of surface may guide the tracker")
    padding_m: float = described(0.02, "how far beyond the shape so far its next frame is looked at")
    planes: bool = described(
        True,
        "planes that reach beyond the first mask (a table, a wall) are not the object, nor is what lies behind them",
    )
    keep_to_mask: bool = described(
        True, "the object is nowhere where the first frame sees past it, beside its mask"
    )
    mask_margin_px: int = described(3, "how far beyond the first mask it may reach")
    refit_after: int = described(
        0,
        "frames after which the first poses and the shape are found anew on another thread, then once more; 0: never",
    )
    kept_frames: int = described(
        600, "most frames kept for refine() and save(): the first one, and others spread over all sides"
    )
    # options: end

    def __post_init__(self) -> None:
        check_fields(self, _SCHEMA)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> ReconstructorOptions:
        """Read the table ``[reconstruct]`` of a TOML file; one without it gives the defaults."""
        table = read_tables(path)["reconstruct"]
        try:
            return cls().replace(**table)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{os.fspath(path)}: [reconstruct] {error}") from None

    def replace(self, **changes: Any) -> ReconstructorOptions:
        """Return a copy with some options changed; TypeError with the nearest name for an unknown one."""
        refuse_unknown(changes, _SCHEMA)
        return dataclasses.replace(self, **changes)

    def to_core(self, noise_m: float) -> _core.ReconstructionOptions:
        """What the core takes, with the noise that was measured."""
        core = _core.ReconstructionOptions()
        for name in core_schema("reconstruct"):
            if name != "noise_m":
                setattr(core, name, getattr(self, name))
        core.noise_m = core.usual_noise_m = noise_m
        return core
