# SPDX-License-Identifier: MIT
"""Text in CSV files that a spreadsheet does not take for a formula, and back."""

from __future__ import annotations

# What spreadsheets take for the beginning of a formula (OWASP, "CSV Injection"); the last four are full-width.
_FORMULA = "=+-@\t\r\n＝＋－＠"
_GUARD = "'"


def text_cell(text: str) -> str:
    """A cell of the file: the text, behind an apostrophe if it could be a formula, in quotes if it needs some.

    Numbers do not go through here: -1 stays a number, while an object of the name "-1" is text.

    >>> text_cell("cup"), text_cell("=1+1"), text_cell("a,b")
    ('cup', "'=1+1", '"a,b"')
    """
    if _is_guardable(text):
        text = _GUARD + text
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\r\n') else text


def cell_text(cell: str) -> str:
    """The text that `text_cell` was given, from a cell as ``csv`` reads it.

    >>> cell_text("'=1+1"), cell_text("'tis"), cell_text("''=1+1")
    ('=1+1', "'tis", "'=1+1")
    """
    return cell[1:] if cell.startswith(_GUARD) and _is_guardable(cell[1:]) else cell


def _is_guardable(text: str) -> bool:
    """Whether it begins as a formula does, also behind apostrophes, which reading would otherwise take off."""
    return text.lstrip(_GUARD).startswith(tuple(_FORMULA))
