# SPDX-License-Identifier: MIT
"""What an experiment returns: tables, as text for the terminal and as plain values for the record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sdftrack.evaluation.tables import text_table

__all__ = ["Table"]


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
    """

    title: str
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    notes: Sequence[str] = ()
    numbers: Any = None

    def __post_init__(self) -> None:
        if twice := sorted({c for c in self.columns if list(self.columns).count(c) > 1}):
            raise ValueError(
                f"columns of {self.title!r}: expected no two alike, got {', '.join(twice)} twice"
            )

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
