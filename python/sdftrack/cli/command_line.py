# SPDX-License-Identifier: MIT
"""The command line for a command that runs other ones."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from functools import cache
from typing import Any

__all__ = ["commands", "run_line"]


def run_line(arguments: list[str]) -> int:
    """Run a command as `sdftrack` does; returns the exit code."""
    return int(_app().run(arguments))


@cache
def commands() -> Mapping[str, Any]:
    """The commands by name, as typer made them."""
    import typer

    group: Any = typer.main.get_command(_app().app)
    return dict(group.commands)


def _app() -> Any:
    # By its name: it assembles all commands, this one's user among them.
    return importlib.import_module("sdftrack.cli.app")
