# SPDX-License-Identifier: MIT
"""What a shape memory is made with, checked."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["MemoryOptions"]

# name: lowest, highest; whole numbers where both are
RANGES: dict[str, tuple[float, float]] = {
    "n_harmonics": (2, 32),
    "size": (16, 256),
    "capacity": (2, 4096),
    "max_occluders": (1, 1000),
    "calibrate_on": (1, 10**9),
    "settle": (2, 10**6),
    "spacing": (0.0, 1.0),
    "w_gen": (0.0, 1.0),
    "reach": (1e-6, 1e6),
}

SET_BY_MEMORY = {
    "w_gen": "give ShapeMemory(w_gen=...) instead",
    "n_in": "it follows from n_inputs",
    "n_out": "it follows from n_harmonics",
}


@dataclass(frozen=True)
class MemoryOptions:
    """The arguments of `ShapeMemory`; ValueError or TypeError names the one that is out of range."""

    n_harmonics: int
    n_inputs: int
    rule: str
    order: Any
    size: int
    capacity: int
    spacing: float
    max_occluders: int
    calibrate_on: int
    w_gen: float
    reach: float
    settle: int
    lwpr: dict[str, Any]

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            _in_range(name, getattr(self, name), low, high, isinstance(low, int))
        _in_range("n_inputs", self.n_inputs, 1, self.n_harmonics - 1, True, " (n_harmonics - 1)")
        if self.n_harmonics > self.size:
            raise ValueError(
                f"n_harmonics: a grid of {self.size} pixels has no more than {self.size}, got {self.n_harmonics}"
            )
        if self.rule not in ("remembered", "printed"):
            raise ValueError(f'rule: expected "remembered" or "printed", got {self.rule!r}')
        if self.order not in ("max", "sum"):
            raise ValueError(f'order: expected "max" or "sum", got {self.order!r}')
        for name, (low, _) in RANGES.items():  # numpy's numbers as Python's own, which files can hold
            object.__setattr__(self, name, (int if isinstance(low, int) else float)(getattr(self, name)))
        object.__setattr__(self, "n_inputs", int(self.n_inputs))
        object.__setattr__(self, "lwpr", _checked_lwpr(self.lwpr))
        if self.lwpr and self.rule != "printed":
            raise ValueError('lwpr: expected with rule="printed" alone; the other rule has no regression')

    def to_dict(self) -> dict[str, Any]:
        """As keyword arguments."""
        return dataclasses.asdict(self)


def _checked_lwpr(given: Any) -> dict[str, Any]:
    """Options for LWPR in plain values; TypeError names one that it does not have, or that the memory sets itself."""
    import difflib

    from sdftrack.contour.lwpr import LWPR
    from sdftrack.contour.lwpr_file import plain

    if not isinstance(given, dict):
        raise TypeError(f"lwpr: expected a dictionary of options of st.contour.LWPR, got {given!r}")
    known = [name for name in LWPR._parameter_names() if name not in SET_BY_MEMORY]
    for name in given:
        if name in SET_BY_MEMORY:
            raise TypeError(f"lwpr: {name!r} is set by the memory; {SET_BY_MEMORY[name]}")
        if name not in known:
            near = difflib.get_close_matches(str(name), known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise TypeError(f"lwpr: LWPR has no option {name!r}; {hint}")
    return {name: plain(value) for name, value in given.items()}


def _in_range(name: str, value: Any, low: float, high: float, whole: bool, why: str = "") -> None:
    kind = int | np.integer if whole else int | float | np.integer | np.floating
    if isinstance(value, bool) or not isinstance(value, kind):
        raise TypeError(f"{name}: expected a {'whole ' if whole else ''}number, got {value!r}")
    if not low <= value <= high:
        raise ValueError(f"{name}: expected {low:g} to {high:g}{why}, got {value!r}")
