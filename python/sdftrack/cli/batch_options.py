# SPDX-License-Identifier: MIT
"""The options of a command by the names that a plan uses, and their text on a command line."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from sdftrack._internal.unknown_option import unknown_option
from sdftrack.batch.addresses import is_address
from sdftrack.cli.command_line import commands

__all__ = ["Options", "options_of_command"]


class Options:
    """What a command understands."""

    def __init__(self, name: str, command: Any) -> None:
        self._name, self._command = name, command
        found = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]
        self._by_key = {self._long(p).removeprefix("--").replace("-", "_"): p for p in found}
        self._of_files = {
            key for key, p in self._by_key.items() if "Path" in str(p.type_descriptor.annotation)
        }
        self.keys = frozenset(self._by_key)
        self._arguments = sum(p.param_type_name == "argument" for p in command.params)

    @staticmethod
    def _long(parameter: Any) -> str:
        return next(text for text in parameter.opts if text.startswith("--"))

    def words(self, key: str, value: Any, base: Path) -> list[str]:
        """The words of `key` = `value` on a command line; paths of files become whole, relative ones are below `base`.

        Raises
        ------
        ValueError
            Unknown option, or a value that a command line cannot have.
        """
        parameter = self._by_key.get(key.replace("-", "_"))
        if parameter is None:
            raise ValueError(unknown_option(key, self._by_key))
        name = self._long(parameter)
        if parameter.is_flag:
            if not isinstance(value, bool):
                raise ValueError(f"{key}: expected true or false, got {value!r}")
            off = parameter.secondary_opts
            return [name] if value else [off[0]] if off else []
        values = value if isinstance(value, list) else [value]
        if len(values) > 1 and not parameter.multiple:
            raise ValueError(f"{key}: expected one value for each call, got the list {value!r}")
        out = []
        for each in values:
            if isinstance(each, bool) or not isinstance(each, (str, int, float)):
                raise ValueError(f"{key}: expected text or a number, got {each!r}")
            out += [name, self._text(key, each, base)]
        return out

    def _text(self, key: str, value: Any, base: Path) -> str:
        """A value as text; what names an existing file below `base` becomes its path."""
        text = str(value)
        if is_address(text) or not isinstance(value, str) or not text:
            return text
        path = base / Path(text).expanduser()
        if path.exists():
            return str(path)
        if key.replace("-", "_") in self._of_files:
            raise ValueError(f"{key}: no such file: {path}")
        return text

    def check(self, words: list[str]) -> None:
        """ValueError if the command line is wrong; nothing is run."""
        try:
            self._command.make_context(self._name, [*["x"] * self._arguments, *words, "--out", "x"])
        except Exception as error:  # typer may bring its own copy of click
            if not hasattr(error, "format_message"):
                raise
            raise ValueError(" ".join(error.format_message().split())) from None


@cache
def options_of_command(name: str) -> Options:
    """The options of a subcommand of sdftrack."""
    return Options(name, commands()[name])
