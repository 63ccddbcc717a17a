# SPDX-License-Identifier: MIT
"""The experiments by name: a function becomes one by `@experiment`, wherever in this package it is defined."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from experiments import record
from experiments.table import Table

Function = TypeVar("Function", bound=Callable[..., "Table | list[Table]"])
PREFIX = "thesis."  # of the experiments that remake a figure or a table of the thesis


@dataclass(frozen=True)
class Experiment:
    """A registered function with what is known about its data.

    Attributes
    ----------
    name : str
    function : callable
        Returns a `Table` or a list of them; its keyword parameters are the options of ``run``.
    needs : tuple of str
        Folders of the data folder; ``"package:NAME"`` is a Python package.
    uses : tuple of str
        The same, where it also runs without them and then measures less.
    chosen_on, reported_on : str
        The data that the defaults under test were chosen on, and those that the result is reported on.
    short : mapping
        Options of ``run --short``: seconds, not minutes. Of a figure, "frames" are the fewest that can show its claim.
    """

    name: str
    function: Callable[..., Table | list[Table]]
    needs: tuple[str, ...]
    uses: tuple[str, ...]
    chosen_on: str
    reported_on: str
    short: Mapping[str, Any] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """First line of the docstring."""
        return (self.function.__doc__ or "").strip().split("\n")[0]

    def check_frames(self, frames: int | None) -> None:
        """ValueError if the claim of a figure of the thesis cannot be judged by so few; None: the default of it."""
        fewest = self.short.get("frames") if self.name.startswith(PREFIX) else None
        if fewest is not None and frames is not None and frames < fewest:
            raise ValueError(
                f"{self.name}: expected at least {fewest} frames, by fewer its claim cannot be judged, got {frames}"
            )


class UnknownExperimentError(ValueError):
    """No experiment has this name."""


_EXPERIMENTS: dict[str, Experiment] = {}


def experiment(
    name: str,
    *,
    chosen_on: str,
    reported_on: str,
    needs: Sequence[str] = (),
    uses: Sequence[str] = (),
    short: Mapping[str, Any] | None = None,
) -> Callable[[Function], Function]:
    """Register the decorated function; see `Experiment` for the arguments.

    Examples
    --------
    >>> @experiment("fall", chosen_on="nothing", reported_on="seed 0")  # doctest: +SKIP
    ... def fall(*, seeds: int = 3) -> Table:
    ...     '''How far a stone falls.'''
    """

    def register(function: Function) -> Function:
        if name in _EXPERIMENTS:
            raise ValueError(
                f"experiment: the name {name!r} is taken by {_EXPERIMENTS[name].function.__module__}"
            )
        _EXPERIMENTS[name] = Experiment(
            name, function, tuple(needs), tuple(uses), chosen_on, reported_on, dict(short or {})
        )
        return function

    return register


def all_experiments() -> dict[str, Experiment]:
    """Every experiment, sorted by name; imports all modules of this package's topic folders."""
    import experiments

    for module in pkgutil.walk_packages(experiments.__path__, "experiments."):
        if module.name.count(".") > 1:
            importlib.import_module(module.name)
    return dict(sorted(_EXPERIMENTS.items()))


def find(name: str) -> Experiment:
    """The experiment of that name; UnknownExperimentError names the nearest one."""
    known = all_experiments()
    if name in known:
        return known[name]
    if name in record.names() and record.load(name).get("retired"):
        raise UnknownExperimentError(f"{name}: retired, its record is {record.path_of(name)}")
    near = difflib.get_close_matches(name, known, 1, 0.4)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise UnknownExperimentError(
        f"experiment: no experiment is named {name!r}{hint} (python -m experiments list names all)"
    )
