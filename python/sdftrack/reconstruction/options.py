# SPDX-License-Identifier: MIT
"""What a reconstructor may be told."""

from __future__ import annotations

import dataclasses
import difflib
import numbers
import os
from dataclasses import dataclass, field
from typing import Any

from sdftrack import _core

__all__ = ["ReconstructorOptions"]

_DEFAULTS = _core.ReconstructionOptions()
FORMS = ("smooth", "printed")


def _option(default: Any, meaning: str) -> Any:
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class ReconstructorOptions:
    """Options of :class:`sdftrack.Reconstructor`; any of them is also a keyword of it. Metres, unless said.

    >>> ReconstructorOptions(evidence="printed").sigma_d_m
    0.003
    """

    evidence: str = _option("smooth", "likelihood of a voxel: smooth, or printed (thesis Eqs. 4.30, 4.31)")
    sigma_d_m: float = _option(
        round(float(_DEFAULTS.sigma_d_m), 6), "how far from a reading it says something; x 2"
    )
    noise_m: float | None = _option(None, "sd of the depth; None: measured on the first frame's mask")
    noise_per_m: float = _option(0.0, "grows as noise_m + noise_per_m Z^2; 1/m")
    carve_from_m: float = _option(
        round(float(_DEFAULTS.carve_from_m), 6), "nearer before a reading nothing is carved"
    )
    memory: float = _option(float(_DEFAULTS.most_weight), "frames that a voxel remembers")
    border_px: int = _option(
        int(_DEFAULTS.border_px), "the object's pixels this near to an outline or a jump say nothing"
    )
    prior: float = _option(0.4, "log ratio of the first guess, inside +, outside -; 0: no prior")
    least_seen: float = _option(0.15, "views after which a piece of surface may guide the tracker")
    padding_m: float = _option(0.02, "how far beyond the shape so far its next frame is looked at")
    kept_frames: int = _option(
        600, "most frames kept for refine() and save(), spread over all sides; at least 1"
    )

    def __post_init__(self) -> None:
        if self.evidence not in FORMS:
            raise ValueError(f"evidence: expected 'smooth' or 'printed', got {self.evidence!r}")
        self._check_numbers()
        for name in ("sigma_d_m", "carve_from_m", "memory", "padding_m"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}: expected a number above 0, got {getattr(self, name)!r}")
        for name in ("noise_per_m", "border_px", "prior", "least_seen", "kept_frames"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}: expected a number of at least 0, got {getattr(self, name)!r}")
        if self.kept_frames < 1:
            raise ValueError(f"kept_frames: expected at least 1, got {self.kept_frames!r}")
        if self.noise_m is not None and not self.noise_m > 0:
            raise ValueError(f"noise_m: expected metres above 0, or None to measure it, got {self.noise_m!r}")

    def _check_numbers(self) -> None:
        for f in dataclasses.fields(self):
            value = getattr(self, f.name)
            if f.name == "evidence" or (value is None and f.name == "noise_m"):
                continue
            whole = isinstance(f.default, int)
            kind = numbers.Integral if whole else numbers.Real
            if isinstance(value, bool) or not isinstance(value, kind):
                raise TypeError(f"{f.name}: expected a {'whole ' * whole}number, got {value!r}")

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> ReconstructorOptions:
        """Read the table ``[reconstruct]`` of a TOML file; one without it gives the defaults."""
        from sdftrack.config import read_tables

        table = read_tables(path)["reconstruct"]
        try:
            return cls().replace(**table)
        except (TypeError, ValueError) as error:
            raise type(error)(f"{os.fspath(path)}: [reconstruct] {error}") from None

    def replace(self, **changes: Any) -> ReconstructorOptions:
        """Return a copy with some options changed; TypeError with the nearest name for an unknown one."""
        known = [f.name for f in dataclasses.fields(self)]
        for name in changes:
            if name not in known:
                near = difflib.get_close_matches(name, known, 1)
                hint = f"did you mean {near[0]!r}?" if near else "see ReconstructorOptions"
                raise TypeError(f"{name}: no such option of Reconstructor; {hint}")
        return dataclasses.replace(self, **changes)

    def to_core(self, noise_m: float) -> _core.ReconstructionOptions:
        """What the core takes, with the noise that was measured."""
        core = _core.ReconstructionOptions()
        core.printed = self.evidence == "printed"
        core.sigma_d_m, core.carve_from_m = self.sigma_d_m, self.carve_from_m
        core.noise_m, core.noise_per_m, core.usual_noise_m = noise_m, self.noise_per_m, noise_m
        core.most_weight, core.border_px = self.memory, self.border_px
        return core
