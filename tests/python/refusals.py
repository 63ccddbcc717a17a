# SPDX-License-Identifier: MIT
"""What is refused: calls as rows of a table (what is called, the error, words of its message), and a command's line."""

import re
from collections.abc import Callable
from typing import Any

import pytest

Row = tuple[Callable[..., Any], "type[Exception] | tuple[type[Exception], ...]", str]


def refused(*rows: Row) -> pytest.MarkDecorator:
    """Runs a test with `call`, `error` and `words` of every row, which has the name of its words."""
    names = [re.sub(r"[^\w ]+", "", words)[:50] for _, _, words in rows]
    return pytest.mark.parametrize(("call", "error", "words"), rows, ids=names)


def assert_refused(
    call: Callable[..., Any],
    error: type[Exception] | tuple[type[Exception], ...],
    words: str,
    *arguments: Any,
) -> str:
    """The call raises the error, whose message is one line that matches the words; that line."""
    with pytest.raises(error, match=words) as told:
        call(*arguments)
    assert "\n" not in str(told.value)
    return str(told.value)


def error_line(capsys: pytest.CaptureFixture[str]) -> str:
    """The error that a command printed: exactly one line."""
    error = capsys.readouterr().err
    assert error.count("\n") == 1, error
    assert error.startswith("sdftrack: error: ")
    return error
