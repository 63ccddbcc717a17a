# SPDX-License-Identifier: MIT
"""The commands that a batch runs, as the app hands them to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sdftrack.cli.options import Field

__all__ = ["Commands", "key_of"]


@dataclass(frozen=True)
class Commands:
    """The commands of the program, handed in by what assembles them, this one among them.

    Attributes
    ----------
    fields : function of a command's name
        Its options and arguments.
    check : function of a command line
        Parses it; nothing is run.
    run : function of a command line
        Runs it and returns the exit code; importable by workers.
    """

    fields: Callable[[str], list[Field]]
    check: Callable[[list[str]], None]
    run: Callable[[list[str]], int]

    def options(self, name: str) -> dict[str, Field]:
        """The options of a command, by the names that a plan uses."""
        return {key_of(f.name.removeprefix("--")): f for f in self.fields(name) if f.is_option}


def key_of(name: str) -> str:
    return name.replace("-", "_")
