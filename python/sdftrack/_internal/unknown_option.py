# SPDX-License-Identifier: MIT
"""Consistent messages for unknown options, with the nearest name."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Iterable
from typing import Any, TypeVar

C = TypeVar("C", bound=type)


def did_you_mean(name: object, known: Iterable[str]) -> str | None:
    """The known name nearest to an unknown one, if any is similar."""
    near = difflib.get_close_matches(str(name), list(known), 1)
    return near[0] if near else None


def unknown_option(name: object, known: Iterable[str]) -> str:
    """The message for an unknown option.

    >>> unknown_option("paddin_m", ["padding_m", "max_pixels"])
    "unknown option 'paddin_m'; did you mean 'padding_m'?"
    """
    from sdftrack._internal.validation import shown  # not before: it needs numpy, which the help does not

    names = list(known)
    near = did_you_mean(name, names)
    return f"unknown option {shown(name)}; " + (
        f"did you mean {near!r}?" if near else f"known: {', '.join(names)}"
    )


def refuse_unknown(given: Iterable[object], known: Iterable[str]) -> None:
    """TypeError for the first unknown name in `given`."""
    names = list(known)
    for name in given:
        if name not in names:
            raise TypeError(unknown_option(name, names))


def refuses_unknown(cls: C) -> C:
    """Class decorator: errors for unknown keywords suggest the nearest one."""
    init: Any = cls.__init__  # type: ignore[misc]
    known = [name for name in inspect.signature(init).parameters if name != "self"]

    @functools.wraps(init)
    def checked(self: Any, *arguments: Any, **keywords: Any) -> None:
        refuse_unknown(keywords, known)
        init(self, *arguments, **keywords)

    cls.__init__ = checked  # type: ignore[misc]
    return cls
