# SPDX-License-Identifier: MIT
"""The options of a shape memory, validated."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from sdftrack._internal.option_schema import check_fields, described, schema_of
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack.contour.dct import Order

_SCHEMA = schema_of("memory")

SET_BY_MEMORY = {
    "w_gen": "give ShapeMemory(w_gen=...) instead",
    "n_in": "it follows from n_inputs",
    "n_out": "it follows from n_harmonics",
}


@dataclass(frozen=True)
class MemoryOptions:
    """The arguments of `ShapeMemory`; ValueError or TypeError names an invalid one."""

    # options: written by bindings/generate_options.py
    n_harmonics: int = described(10, "number of harmonics that describe a silhouette")
    n_inputs: int = described(
        3, "number of the highest harmonics that predict the others (printed); must be below n_harmonics"
    )
    rule: str = described(
        "remembered", "how occluded parts are recovered: from stored silhouettes, or as printed (Table 6.3)"
    )
    order: Order = described(
        "max", "how coefficients form a harmonic: all C(u, v) with equal max(u, v), or with equal u + v"
    )
    size: int = described(64, "side of the grid to which silhouettes are normalised")
    capacity: int = described(256, "maximum number of stored silhouettes (remembered)")
    spacing: float = described(
        0.02, "minimum dissimilarity of two stored silhouettes: symmetric difference over area (remembered)"
    )
    max_occluders: int = described(2, "a silhouette with more occluders than this is novel (remembered)")
    calibrate_on: int = described(
        100, "number of known silhouettes whose error sets the threshold (remembered)"
    )
    w_gen: float = described(0.1, "a silhouette is unknown if its activation is below this (printed)")
    reach: float = described(
        0.1,
        "distance metric of the receptive fields, D = reach / n_inputs; smaller values generalise farther (printed)",
    )
    settle: int = described(20, "number of silhouettes that determine the scale of the inputs (printed)")
    # options: end
    lwpr: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self, _SCHEMA)
        if self.n_inputs >= self.n_harmonics:
            raise ValueError(
                f"n_inputs: expected 1 to {self.n_harmonics - 1} (n_harmonics - 1), got {self.n_inputs!r}"
            )
        if self.n_harmonics > self.size:
            raise ValueError(
                f"n_harmonics: a grid of {self.size} pixels has no more than {self.size}, got {self.n_harmonics}"
            )
        object.__setattr__(self, "lwpr", _checked_lwpr(self.lwpr))
        if self.lwpr and self.rule != "printed":
            raise ValueError('lwpr: expected only with rule="printed"; the other rule has no regression')

    def to_dict(self) -> dict[str, Any]:
        """Return the options as keyword arguments."""
        return dataclasses.asdict(self)


def _checked_lwpr(given: Any) -> dict[str, Any]:
    """Options of LWPR as plain values; TypeError names one that is unknown, or set by the memory itself."""
    from sdftrack.contour.lwpr import LWPR
    from sdftrack.contour.lwpr_data import plain

    if not isinstance(given, dict):
        raise TypeError(f"lwpr: expected a dictionary of options of st.contour.LWPR, got {given!r}")
    known = [name for name in LWPR._parameter_names() if name not in SET_BY_MEMORY]
    for name in given:
        if name in SET_BY_MEMORY:
            raise TypeError(f"lwpr: {name!r} is set by the memory; {SET_BY_MEMORY[name]}")
    try:
        refuse_unknown(given, known)
    except TypeError as error:
        raise TypeError(f"lwpr: {error}") from None
    return {name: plain(value) for name, value in given.items()}
