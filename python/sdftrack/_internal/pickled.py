# SPDX-License-Identifier: MIT
"""Objects stored in a pickle file: written completely or not at all, read with clear errors."""

from __future__ import annotations

import os
import pickle
from typing import Any, TypeVar

from sdftrack._internal.files import write_whole

__all__ = ["load_pickled", "save_pickled"]

T = TypeVar("T")


def save_pickled(thing: Any, path: str | os.PathLike[str]) -> None:
    """Write `thing`, completely or not at all."""
    write_whole(path, lambda file: pickle.dump(thing, file))


def load_pickled(path: str | os.PathLike[str], kind: type[T]) -> T:
    """Read a file written by `kind.save`; FileNotFoundError or ValueError naming the file."""
    if not os.path.isfile(path):
        raise FileNotFoundError(f"{kind.__name__.lower()}: no such file: {os.fspath(path)}")
    try:
        with open(path, "rb") as file:
            thing = pickle.load(file)
    except (pickle.UnpicklingError, EOFError, AttributeError, ImportError, IndexError) as error:
        raise ValueError(
            f"{os.fspath(path)}: expected a file of {kind.__name__}.save, got an unreadable one ({error})"
        ) from None
    if not isinstance(thing, kind):
        raise ValueError(f"{os.fspath(path)}: expected a saved {kind.__name__}, got {type(thing).__name__}")
    return thing
