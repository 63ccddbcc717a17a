# SPDX-License-Identifier: MIT
"""Command line options from the signature of a function: name, type and default; the help from its docstring.

Types: int, float, str, Path, bool (``--refine``, ``--no-refine``), any of these ``| None``, ``Literal`` of strings,
``tuple[TYPE, ...]`` (comma separated) and ``Settings`` (NAME=VALUE, may be repeated; values are Python literals).
"""

from __future__ import annotations

import argparse
import ast
import inspect
import re
import types
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeAlias, Union, get_args, get_origin, get_type_hints

Settings: TypeAlias = Mapping[str, Any]
NO_SETTINGS: Settings = MappingProxyType({})

# Options that mean the same everywhere.
COMMON = {
    "cache": "folder that keeps volumes and noise-free images between runs",
    "frames": "of each sequence",
    "mode": "depth, rgbd",
    "only": "names, comma separated",
    "options": "of the tracker",
    "seeds": "random draws of each case",
    "sigma": "depth noise, m",
    "step_deg": "largest rotation from frame to frame",
    "step_mm": "largest translation from frame to frame",
    "threads": "0: all cores",
    "voxels": "along the longest side of a shape",
}


def add_options(parser: argparse.ArgumentParser, function: Callable[..., Any]) -> None:
    """One option for each keyword parameter of `function`, except `data`, which the runner itself provides."""
    hints, said = get_type_hints(function), descriptions(function.__doc__ or "")
    for name, parameter in inspect.signature(function).parameters.items():
        if name == "data":
            continue
        help_text = said.get(name, COMMON.get(name, ""))
        flag = "--set" if name == "options" else "--" + name.replace("_", "-")
        parser.add_argument(flag, dest=name, **_argument(hints[name], parameter.default, help_text))


def descriptions(doc: str) -> dict[str, str]:
    """{name: text} of the section "Parameters" of a numpy-style docstring."""
    section = re.search(r"\n *Parameters\n *-+\n(.*?)(?:\n *\n|\Z)", inspect.cleandoc(doc), re.DOTALL)
    out: dict[str, str] = {}
    names: list[str] = []
    for line in section[1].split("\n") if section else []:
        if line and not line.startswith(" "):
            names = [name.strip() for name in line.split(":")[0].split(",")]
        for name in names if line.startswith(" ") else []:
            out[name] = f"{out.get(name, '')} {line.strip()}".strip()
    return out


def parse_settings(pairs: Iterable[str]) -> dict[str, Any]:
    """``["name=value", ...]`` as keyword arguments; values are Python literals, else text."""
    out: dict[str, Any] = {}
    for pair in pairs:
        name, equals, text = (part.strip() for part in pair.partition("="))
        if not equals or not name:
            raise ValueError(f"setting: expected NAME=VALUE, got {pair!r}")
        try:
            out[name] = ast.literal_eval(text)
        except (ValueError, SyntaxError):
            out[name] = {"true": True, "false": False}.get(text.lower(), text)
    return out


class _Setting(argparse.Action):
    """Collects NAME=VALUE."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        try:
            setattr(namespace, self.dest, {**getattr(namespace, self.dest), **parse_settings([values])})
        except ValueError as error:
            parser.error(f"argument {option_string}: {error}")


def _argument(kind: Any, default: Any, help_text: str) -> dict[str, Any]:
    """Arguments of `add_argument`."""
    out: dict[str, Any] = {"help": _with_default(help_text, default), "default": default}
    if get_origin(kind) is Mapping:
        return {"help": help_text, "default": {}, "action": _Setting, "metavar": "NAME=VALUE"}
    if default is inspect.Parameter.empty:
        out.update(required=True, default=None, help=help_text)
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(part for part in get_args(kind) if part is not type(None))
    if kind is bool:
        return {**out, "action": argparse.BooleanOptionalAction}
    if get_origin(kind) is tuple:
        return {**out, "type": _several(get_args(kind)[0]), "metavar": "A,B,..."}
    if get_origin(kind) is Literal:
        return {**out, "choices": get_args(kind)}
    return {**out, "type": kind, "metavar": {Path: "PATH", str: "TEXT"}.get(kind, "N")}


def _with_default(text: str, default: Any) -> str:
    if default is None or default is inspect.Parameter.empty or isinstance(default, Mapping):
        return text
    shown = ",".join(map(str, default)) if isinstance(default, tuple) else default
    return f"{text} (default: {shown})".strip().replace("%", "%%")


def _several(kind: Any) -> Callable[[str], tuple[Any, ...]]:
    """Converter of a comma separated list."""
    choices = get_args(kind) if get_origin(kind) is Literal else ()

    def convert(text: str) -> tuple[Any, ...]:
        parts = [part.strip() for part in text.split(",") if part.strip()]
        if unknown := [part for part in parts if choices and part not in choices]:
            raise argparse.ArgumentTypeError(f"expected some of {', '.join(choices)}, got {unknown[0]!r}")
        try:
            return tuple(parts) if choices else tuple(kind(part) for part in parts)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return convert
