# SPDX-License-Identifier: MIT
"""The reference of the command line, from the commands themselves: added to the page command_line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

PAGE = "command_line"


def commands(command: Any, path: str) -> Iterator[tuple[str, Any]]:
    """The commands that do something, with their whole names, in the order of `sdftrack --help`."""
    inner = getattr(command, "commands", None)
    if inner is None:
        yield path, command
        return
    for name, each in inner.items():
        yield from commands(each, f"{path} {name}")


def prose(text: str) -> str:
    """Help as Markdown: options in it are code, and a bracket opens no tag."""
    return re.sub(r"(?<![\w-])--[a-z][\w-]*", r"`\g<0>`", text.replace("<", "&lt;"))


def cell(text: str) -> str:
    return prose(" ".join(str(text).split())).replace("|", "\\|")


def names_of(option: Any) -> str:
    names = ", ".join([*option.opts, *option.secondary_opts])
    value = "" if getattr(option, "is_flag", False) else f" {option.metavar or option.name.upper()}"
    return f"`{names}{value}`".replace("|", "\\|")


def default_of(option: Any) -> str:
    if option.required:
        return "required"
    shown = getattr(option, "show_default", None)
    if isinstance(shown, str):
        return cell(shown)
    if option.default is None or callable(option.default) or option.default in ([], (), ""):
        return ""
    if option.is_flag:
        return (option.opts if option.default else option.secondary_opts or ["off"])[0].removeprefix("--")
    return cell(getattr(option.default, "value", option.default))


def section(path: str, command: Any) -> str:
    context = command.make_context(path, [], resilient_parsing=True)
    usage = " ".join([path, *command.collect_usage_pieces(context)])
    options = [p for p in command.params if p.param_type_name == "option" and not p.hidden]
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    lines = [f"## {path}", "", "```text", usage, "```", "", prose(command.help or ""), ""]
    lines += [f"* `{p.metavar or p.name.upper()}`: {cell(p.help or '')}" for p in arguments]
    lines += ["", "| option | meaning | default |", "| --- | --- | --- |"]
    lines += [f"| {names_of(p)} | {cell(p.help or '')} | {default_of(p)} |" for p in options]
    return "\n".join([*lines, ""])


def reference() -> str:
    from sdftrack.cli.app import parser

    return "\n".join(section(path, each) for path, each in commands(parser(), "sdftrack"))


def add_reference(_app: Any, docname: str, source: list[str]) -> None:
    if docname == PAGE:
        source[0] += "\n" + reference()


def setup(app: Any) -> dict[str, Any]:
    app.connect("source-read", add_reference)
    return {"parallel_read_safe": True}
