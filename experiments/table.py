# SPDX-License-Identifier: MIT
"""What an experiment returns: tables, as text for the terminal and as plain values for the record, and a picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sdftrack.cli.common import text_table


@dataclass(frozen=True)
class Table:
    """One table.

    Attributes
    ----------
    title : str
    columns : sequence of str
        No two alike, so that a target can name one. Empty: there are notes only.
    rows : sequence of sequence of str
        Formatted cells; the first names the row.
    notes : sequence of str
        Lines below the table.
    numbers : dict, list or None
        The unrounded values, for the record.
    picture : callable or None
        Draws what the table is about: a figure of Matplotlib. Called only where it is saved.
    """

    title: str
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    notes: Sequence[str] = ()
    numbers: Any = None
    picture: Callable[[], Any] | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if twice := sorted({c for c in self.columns if list(self.columns).count(c) > 1}):
            raise ValueError(
                f"columns of {self.title!r}: expected no two alike, got {', '.join(twice)} twice"
            )

    @classmethod
    def of(
        cls,
        title: str,
        columns: Mapping[str, str],
        rows: Sequence[Mapping[str, Any]] | Mapping[str, Mapping[str, Any]],
        **more: Any,
    ) -> Table:
        """A table of rows of values; `columns` has ``"key:format"`` for each heading, see `cell`.

        Of a mapping, the keys are the values "name" of its rows. The rows are also the numbers of the record, unless
        `more` has others.
        """
        named = [{"name": name, **row} for name, row in rows.items()] if isinstance(rows, Mapping) else rows
        made = [cells(columns, row) for row in named]
        return cls(title, list(columns), made, **{"numbers": rows, **more})

    def __str__(self) -> str:
        body = text_table(self.title, self.columns, self.rows) if self.columns else self.title
        return "\n".join([body, *self.notes])

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as `experiments.record` writes them."""
        return {
            "title": self.title,
            "columns": list(self.columns),
            "rows": [list(row) for row in self.rows],
            "notes": list(self.notes),
            "numbers": self.numbers,
        }


def cells(columns: Mapping[str, str], row: Mapping[str, Any]) -> list[str]:
    """A row of values as text, under the headings of `columns`; what a row does not have is "-"."""
    fields = (spec.partition(":") for spec in columns.values())
    return [cell(row.get(key), how) for key, _, how in fields]


def cell(value: Any, how: str = "") -> str:
    """A value as text: "-" for None, "yes" or "no", text as it is, a number in the format `how`."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else format(value, how)
