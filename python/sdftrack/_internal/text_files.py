# SPDX-License-Identifier: MIT
"""Files of others: text, JSON and TOML, whose wrong contents are a ValueError that names the file; the order of names;
cells of CSV files that a spreadsheet does not take for a formula."""

from __future__ import annotations

import codecs
import contextlib
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

# What contents of another form raise: a list in the place of a table, numbers beyond a float or an int, ...
WRONG = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
SHOWN = 400  # characters of a reason


@contextlib.contextmanager
def contents(path: str | os.PathLike[str], expected: str) -> Iterator[None]:
    """Errors of contents that are not what is `expected`, as ValueError that names the file and tells the reason."""
    try:
        yield
    except WRONG as error:
        told = reason(error).removeprefix(f"{os.fspath(path)}: ")
        raise ValueError(f"{os.fspath(path)}: expected {expected}, got other contents ({told})") from None


@contextlib.contextmanager
def named(path: str | os.PathLike[str]) -> Iterator[None]:
    """Errors of a reader of many parts, as ValueError with the name of the file or folder if they have none yet."""
    try:
        yield
    except (*WRONG, OSError) as error:
        told = os.fspath(path) in str(error) or getattr(error, "filename", None) is not None
        if isinstance(error, OSError) and told:
            raise
        if isinstance(error, ValueError | TypeError):
            if told and not isinstance(error, UnicodeError):
                raise
            raise ValueError(f"{os.fspath(path)}: {reason(error)}") from error
        raise ValueError(f"{os.fspath(path)}: damaged contents ({reason(error)})") from error


def reason(error: BaseException) -> str:
    """What is wrong with contents that raised this, in one line."""
    if isinstance(error, KeyError):
        return f"the field {error} is missing"
    if isinstance(error, RecursionError):
        return "nested too deeply"
    return reason_of(error)[:SHOWN]


def reason_of(error: BaseException) -> str:
    """Why a run ended early, in one line."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted"
    return " ".join(str(error).split()) or type(error).__name__


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file, UTF-8, or UTF-16 with its mark, with line ends as "\\n"; ValueError if it is none."""
    try:
        return decoded(Path(path).read_bytes()).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        raise ValueError(f"{os.fspath(path)}: expected text, got a binary file") from None


def decoded(data: bytes) -> str:
    """The text of bytes without the byte order mark, with which editors of Windows begin a file."""
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return data.decode("utf-16" if wide else "utf-8-sig")


def read_json(path: str | os.PathLike[str]) -> Any:
    return parsed_json(Path(path).read_bytes(), path)


def parsed_json(text: str | bytes, path: str | os.PathLike[str]) -> Any:
    return _parsed(json.loads, text, path, "JSON")


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    import tomllib

    return _parsed(tomllib.loads, Path(path).read_bytes(), path, "TOML")


def _parsed(parse: Callable[[Any], Any], text: str | bytes, path: str | os.PathLike[str], kind: str) -> Any:
    try:
        return parse(decoded(text) if isinstance(text, bytes) else text)
    except UnicodeDecodeError:
        raise ValueError(f"{os.fspath(path)}: not a {kind} file: expected text, got a binary file") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{os.fspath(path)}: not a {kind} file ({reason(error)})") from None


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


NUMBERS = re.compile(r"(\d+)")
TIME = re.compile(r"(?:\D*?)(\d+\.\d+)")  # a whole name, with or without a word before the seconds


def natural(name: str) -> tuple[Any, ...]:
    """Sort key of a name: its numbers by value, what follows the dot of a name that is a time as decimals.

    >>> sorted(["d_10", "d_9", "d_0008"], key=natural), sorted(["10.03", "9.5", "9.12"], key=natural)
    (['d_0008', 'd_9', 'd_10'], ['9.12', '9.5', '10.03'])
    """
    parts: list[Any] = NUMBERS.split(name)
    decimals = TIME.fullmatch(name) is not None
    for i in range(1, len(parts), 2):
        parts[i] = float(f"0.{parts[i]}") if decimals and i == 3 else int(parts[i])
    return (*parts, name)


def in_order(files: Iterable[Path]) -> list[Path]:
    """Files in the order of their folders, then of their names without the suffix."""
    return sorted(files, key=lambda file: (natural(str(file.parent)), natural(file.stem), file.suffix))
