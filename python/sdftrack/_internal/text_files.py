# SPDX-License-Identifier: MIT
"""Text, JSON and TOML files of others: whatever is wrong with their contents is a ValueError that names the file."""

from __future__ import annotations

import codecs
import contextlib
import json
import os
from collections.abc import Callable, Iterator
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
    """The value in a JSON file."""
    return parsed_json(Path(path).read_bytes(), path)


def parsed_json(text: str | bytes, path: str | os.PathLike[str]) -> Any:
    """The value of JSON that is in a file."""
    return _parsed(json.loads, text, path, "JSON")


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The tables of a TOML file."""
    import tomllib

    return _parsed(tomllib.loads, Path(path).read_bytes(), path, "TOML")


def _parsed(parse: Callable[[Any], Any], text: str | bytes, path: str | os.PathLike[str], kind: str) -> Any:
    try:
        return parse(decoded(text) if isinstance(text, bytes) else text)
    except UnicodeDecodeError:
        raise ValueError(f"{os.fspath(path)}: not a {kind} file: expected text, got a binary file") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{os.fspath(path)}: not a {kind} file ({reason(error)})") from None
