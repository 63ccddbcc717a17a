# SPDX-License-Identifier: MIT
"""Measure again what is recorded: every run of a record, with the settings that stand there."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, get_args, get_type_hints

from experiments import record
from experiments.registry import Experiment


def again(
    chosen: Experiment,
    measure: Callable[[Experiment, Mapping[str, Any], Mapping[str, Any]], object],
    say: Callable[[str], None],
) -> None:
    """`measure(chosen, settings, instead_of)` for each run; a run that today's options cannot give again is named."""
    for number, run in enumerate(record.load(chosen.name)["runs"]):
        if run.get("retired"):
            continue
        try:
            settings = settings_of(chosen, run["settings"])
        except ValueError as error:
            say(f"{chosen.name}, run {number}: {error}; it stays as it is")
        else:
            measure(chosen, settings, run["settings"])


def settings_of(chosen: Experiment, recorded: Mapping[str, Any]) -> dict[str, Any]:
    """Recorded settings as values of today's options; ValueError where an option is gone."""
    parameters = inspect.signature(chosen.function).parameters
    if gone := set(recorded) - set(parameters):
        raise ValueError(f"expected today's options, got {', '.join(sorted(gone))}")
    hints = get_type_hints(chosen.function)
    defaults = {n: p.default for n, p in parameters.items() if p.default is not inspect.Parameter.empty}
    return {**defaults, **{name: _value(value, hints[name]) for name, value in recorded.items()}}


def _value(value: Any, hint: Any) -> Any:
    if isinstance(value, list):
        return tuple(value)
    return Path(value) if isinstance(value, str) and (hint is Path or Path in get_args(hint)) else value
