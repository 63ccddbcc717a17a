# SPDX-License-Identifier: MIT
"""All options by name, with bounds, unit and meaning, and validation of values.

The options of the core are described in C++, one line each (``cpp/*/option_schema.h``); those only in Python, at the
end of this file. `bindings/generate_options.py` writes classes and tables from both.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any

import numpy as np

from sdftrack import _core
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack._internal.validation import numbers, shown


@dataclass(frozen=True)
class Option:
    """One option, described in C++ or declared in Python."""

    name: str
    kind: str  # "bool", "int", "number", "choice" or "numbers"
    default: Any
    unit: str = ""
    meaning: str = ""
    min: float = -np.inf
    max: float = np.inf
    min_open: bool = False
    max_open: bool = False
    ends_only: bool = False
    may_be_none: bool = False
    choices: tuple[str, ...] = ()

    @property
    def expected(self) -> str:
        """The expected values, as stated in error messages."""
        return _core.option_expected(
            self.kind, self.min, self.max, self.min_open, self.max_open, self.ends_only, self.may_be_none,
            list(self.choices),
        )  # fmt: skip

    def check(self, value: Any) -> Any:
        """Validate a value and convert it to a plain type; TypeError for a wrong type, ValueError out of range."""
        if value is None and self.may_be_none:
            return None
        plain = self._plain(value)
        outside = self.choices and plain not in self.choices
        if self.kind in ("int", "number"):
            outside = not self._is_in_range(plain)
        if outside:
            raise ValueError(f"{self.name}: expected {self.expected}, got {shown(value)}")
        return plain

    def _plain(self, value: Any) -> Any:
        if self.kind == "numbers":
            numbers(value, self.name)
            return value
        if self.kind == "bool" and isinstance(value, bool | np.bool_):
            return bool(value)
        if self.kind == "choice" and isinstance(value, str):
            return str(value)
        if self.kind == "int" and not isinstance(value, bool) and isinstance(value, Integral):
            return int(value)
        if self.kind == "number" and not isinstance(value, bool | np.bool_ | str | bytes):
            try:
                return _as_float(value)
            except (TypeError, ValueError):
                pass  # refused below
        wanted = {"int": "a whole number", "number": "a number"}.get(self.kind, self.expected)
        raise TypeError(f"{self.name}: expected {wanted}, got {shown(value)}")

    def _is_in_range(self, value: float) -> bool:
        return _core.option_in_range(
            _as_float(value), self.min, self.max, self.min_open, self.max_open, self.ends_only
        )


def _as_float(value: Any) -> float:
    try:
        return float(value)
    except OverflowError:  # an int of hundreds of digits
        return np.inf if value > 0 else -np.inf


@functools.cache
def core_schema(table: str) -> dict[str, Option]:
    """The options of the core in table "tracker", "reconstruct", "contour" or "lwpr"; by name, in order."""
    return {o["name"]: Option(**{**o, "choices": tuple(o["choices"])}) for o in _core.option_schema()[table]}


def check_options(given: Mapping[str, Any], schema: Mapping[str, Option], others: Iterable[str] = ()) -> Any:
    """Validate options by name; `others` are further names suggested for unknown ones."""
    refuse_unknown(given, [*schema, *others])
    return {name: schema[name].check(value) for name, value in given.items()}


def check_fields(options: Any, schema: Mapping[str, Option]) -> None:
    """Validate the fields of a frozen dataclass, and convert them to plain types."""
    for f in dataclasses.fields(options):
        if f.name in schema:
            object.__setattr__(options, f.name, schema[f.name].check(getattr(options, f.name)))


def described(default: Any, meaning: str) -> Any:
    """A field of a dataclass of options."""
    return field(default=default, metadata={"meaning": meaning})


# The options not used by the core, one line each, described like those of the core.
# fmt: off
# ruff: noqa: E501 (an option is a line)
MEMORY = (
    Option("n_harmonics", "int", 10, min=2, max=32, meaning="number of harmonics that describe a silhouette"),
    Option("n_inputs", "int", 3, min=1, max=31, meaning="number of the highest harmonics that predict the others (printed); must be below n_harmonics"),
    Option("rule", "choice", "remembered", choices=("remembered", "printed"), meaning="how occluded parts are recovered: from stored silhouettes, or as printed (Table 6.3)"),
    Option("order", "choice", "max", choices=("max", "sum"), meaning="how coefficients form a harmonic: all C(u, v) with equal max(u, v), or with equal u + v"),
    Option("size", "int", 64, "px", min=16, max=256, meaning="side of the grid to which silhouettes are normalised"),
    Option("capacity", "int", 256, min=2, max=4096, meaning="maximum number of stored silhouettes (remembered)"),
    Option("spacing", "number", 0.02, min=0, max=1, meaning="minimum dissimilarity of two stored silhouettes: symmetric difference over area (remembered)"),
    Option("max_occluders", "int", 2, min=1, max=1000, meaning="a silhouette with more occluders than this is novel (remembered)"),
    Option("calibrate_on", "int", 100, min=1, max=10**9, meaning="number of known silhouettes whose error sets the threshold (remembered)"),
    Option("w_gen", "number", 0.1, min=0, max=1, meaning="a silhouette is unknown if its activation is below this (printed)"),
    Option("reach", "number", 0.1, min=1e-6, max=1e6, meaning="distance metric of the receptive fields, D = reach / n_inputs; smaller values generalise farther (printed)"),
    Option("settle", "int", 20, min=2, max=10**6, meaning="number of silhouettes that determine the scale of the inputs (printed)"),
)
BURN_IN = Option("burn_in", "int", 60, min=0, meaning="number of frames from which a memory learns before it judges")
# fmt: on

TABLES = ("tracker", "reconstruct", "contour", "lwpr", "memory")


def schema_of(table: str) -> dict[str, Option]:
    """The options of one of `TABLES`, by name, in order."""
    own = MEMORY if table == "memory" else ()
    core = {} if table == "memory" else core_schema(table)
    return {**core, **{option.name: option for option in own}}
