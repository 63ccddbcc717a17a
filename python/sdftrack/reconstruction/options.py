# SPDX-License-Identifier: MIT
"""The options of a reconstructor, as the core (cpp/reconstruction/option_schema.h) and Python describe them."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Any

from sdftrack import _core
from sdftrack._internal.option_files import read_tables
from sdftrack._internal.option_schema import check_fields, core_schema, described, schema_of
from sdftrack._internal.unknown_option import refuse_unknown, refuses_unknown

_SCHEMA = schema_of("reconstruct")


@refuses_unknown
@dataclass(frozen=True)
class ReconstructorOptions:
    """Options of :class:`sdftrack.Reconstructor`; any of them is also a keyword of it. Lengths in metres.

    >>> ReconstructorOptions(evidence="printed").sigma_d_m
    0.003
    """

    # options: written by bindings/generate_options.py
    evolution: str = described(
        "ours",
        "ours, or printed: evidence, gradient flow and tracker of the thesis (Eqs. 4.18, 4.29 to 4.42)",
    )
    evidence: str = described(
        "smooth", "likelihood of a voxel: smooth, or printed (thesis Eqs. 4.29 to 4.31)"
    )
    sigma_d_m: float = described(
        0.003,
        "support of the likelihood around a depth measurement; nothing is inferred from twice that distance behind it",
    )
    sigma_d_voxels: float = described(8.0, "replaces sigma_d_m when evolution is printed, as in the thesis")
    evolution_steps: int = described(
        15, "steps of the printed evolution per frame; 100 after the first frame"
    )
    noise_m: float | None = described(
        None, "standard deviation of the depth noise; None: estimated within the mask of the first frame"
    )
    noise_per_m: float = described(0.0, "depth noise grows with distance: noise_m + noise_per_m Z^2")
    carve_from_m: float = described(
        0.003, "no free space is carved within this distance in front of a depth measurement"
    )
    memory: float = described(
        100.0,
        "maximum number of frames averaged in a voxel; fewer forget errors sooner, more reduce noise further",
    )
    known_every: int = described(
        2,
        "once a block has been observed in 30 frames, only every n-th further frame is fused into it; 1: every frame",
    )
    border_px: int = described(
        2, "object pixels within this distance of the silhouette or of a depth discontinuity are ignored"
    )
    prior: float = described(
        0.4, "log ratio of the initial guess, positive inside, negative outside; 0: no prior"
    )
    min_seen: float = described(
        0.15, "a surface patch is used for tracking once it has been observed in this many (frontal) views"
    )
    padding_m: float = described(
        0.02, "pixels within this distance of the current shape are considered in the next frame"
    )
    planes: bool = described(
        True,
        "planes that extend beyond the first mask (table, wall), and what lies behind them, are not part of the object",
    )
    keep_to_mask: bool = described(
        True, "the object is excluded where the first frame observes free space outside its mask"
    )
    mask_margin_px: int = described(3, "how far the object may extend beyond the first mask")
    kept_frames: int = described(
        600,
        "maximum number of frames kept for refine() and save(): the first, and others spread over all viewpoints",
    )
    # options: end

    def __post_init__(self) -> None:
        check_fields(self, _SCHEMA)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> ReconstructorOptions:
        """Read the table ``[reconstruct]`` of a TOML file; the defaults if it is missing."""
        table = read_tables(path)["reconstruct"]
        try:
            return cls().replace(**table)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{os.fspath(path)}: [reconstruct] {error}") from None

    def replace(self, **changes: Any) -> ReconstructorOptions:
        """Return a copy with some options changed; TypeError with the nearest name for an unknown one."""
        refuse_unknown(changes, _SCHEMA)
        return dataclasses.replace(self, **changes)

    def to_core(self) -> _core.ReconstructionOptions:
        """Convert to the core's options; the noise is that of the first frame (`_core.Beginning`)."""
        core = _core.ReconstructionOptions()
        for name in core_schema("reconstruct"):
            if name != "noise_m":
                setattr(core, name, getattr(self, name))
        return core
