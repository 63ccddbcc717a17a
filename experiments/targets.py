# SPDX-License-Identifier: MIT
"""Targets of the experiments (targets.toml) and whether tables meet them."""

from __future__ import annotations

import fnmatch
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.table import Table

FILE = Path(__file__).with_name("targets.toml")
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Target:
    """A limit for the cells of a column, in all rows whose first cell matches; or a picture that there is to be.

    Attributes
    ----------
    figure : str
        What is meant, for the reader.
    column : str
        Empty with `picture`.
    row, table : str
        Patterns (``*``) of the first cell and of the table's title.
    min, max : float or None
        For the first number in each cell.
    equals : str or None
        For cells that are no number.
    picture : bool
        The source prints nothing but a picture, and nothing in it can be measured: there is to be one.
    """

    figure: str
    column: str = ""
    row: str = "*"
    table: str = "*"
    min: float | None = None
    max: float | None = None
    equals: str | None = None
    picture: bool = False

    def __post_init__(self) -> None:
        limits = sum(limit is not None for limit in (self.min, self.max, self.equals))
        if self.picture == bool(self.column) or self.picture == bool(limits):
            raise ValueError(f"{self.figure}: expected a column with a limit, or picture = true")

    @property
    def limit(self) -> str:
        """The limit as text."""
        if self.picture:
            return "drawn"
        parts = [
            f">= {self.min:g}" if self.min is not None else "",
            f"<= {self.max:g}" if self.max is not None else "",
        ]
        return self.equals if self.equals is not None else " and ".join(part for part in parts if part)

    def met_by(self, cell: str) -> bool:
        """Whether one cell is within the limit; a cell without a number is not."""
        if self.equals is not None:
            return cell == self.equals
        number = NUMBER.search(cell)
        if number is None:
            return False
        value = float(number[0])
        return (self.min is None or value >= self.min) and (self.max is None or value <= self.max)


@dataclass(frozen=True)
class Verdict:
    """A target and the rows that miss it; `rows` is the number of rows it was compared with."""

    target: Target
    rows: int
    missed: tuple[str, ...]

    def __str__(self) -> str:
        t = self.target
        if not self.rows:
            return f"target not measured: {t.figure} {t.limit} (no such row in this run)"
        if not self.missed:
            return f"target met: {t.figure} {t.limit} ({self.rows} rows)"
        return f"target missed: {t.figure} {t.limit}: {', '.join(self.missed)}"


def targets_of(name: str, path: Path = FILE) -> list[Target]:
    """Targets of an experiment; ValueError for a key that no target has, or no limit."""
    entries: list[dict[str, Any]] = tomllib.loads(path.read_text()).get(name, [])
    try:
        return [Target(**entry) for entry in entries]
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path.name}, {name}: {error}") from None


def judge(name: str, tables: Sequence[Table], path: Path = FILE) -> list[Verdict]:
    """Compare tables with the targets of an experiment."""
    return [_judge_one(target, tables) for target in targets_of(name, path)]


def _judge_one(target: Target, tables: Sequence[Table]) -> Verdict:
    if target.picture:
        return Verdict(target, sum(table.picture is not None for table in tables), ())
    cells = [
        (row[0], row[list(table.columns).index(target.column)])
        for table in tables
        if target.column in table.columns and fnmatch.fnmatchcase(table.title, target.table)
        for row in table.rows
        if fnmatch.fnmatchcase(row[0], target.row)
    ]
    missed = tuple(f"{name} ({cell})" for name, cell in cells if not target.met_by(cell))
    return Verdict(target, len(cells), missed)
