# SPDX-License-Identifier: MIT
"""Translates advice in error messages for the command line: ``unit='mm'`` becomes ``--unit mm``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

__all__ = ["as_options", "options_of"]

# Of every command, also where the parser could not tell which one was meant.
COMMON = {"voxels": "--voxels", "unit": "--unit", "holes": "--holes", "overwrite": "--overwrite"}
NAME = r"(?<![\w/])([a-z][a-z0-9_]*)="  # not in a path
END = r"(?=[\s,;.)]|$)"


def options_of(command: Any, arguments: Sequence[str]) -> dict[str, str]:
    """Options of the (sub)command called by the arguments, by the name of the Python argument."""
    for word in arguments:
        below = getattr(command, "commands", {}).get(word)
        if below is None:
            break
        command = below
    own = {}
    for parameter in getattr(command, "params", []):
        long = [text for text in getattr(parameter, "opts", []) if text.startswith("--")]
        if long and parameter.name:
            own[parameter.name] = long[0]
    return {**COMMON, **own}


def as_options(text: str, options: dict[str, str]) -> str:
    """Rewrite Python arguments in `text` as options; advice without a corresponding option is removed."""
    # Code in brackets, such as (points[np.isfinite(points).all(axis=1)]), is for those who write code.
    text = re.sub(r" \([a-z_]+\[.*?\]\)", "", text)
    text = re.sub(r"\bpass " + NAME + r", or ", lambda m: m[0] if m[1] in options else "", text)
    text = re.sub(r",? or (?:pass )?" + NAME + END, lambda m: m[0] if m[1] in options else "", text)
    text = re.sub(r" \(" + NAME + END, lambda m: m[0] if m[1] in options else " (", text)
    text = re.sub(r",? or [^,;()]* \(from Python: \w+\)", "", text).replace(" ()", "")
    text = re.sub(r"\bpass " + NAME + "False", lambda m: "leave out " + options.get(m[1], m[1]), text)
    if "no_plane" in options:
        text = re.sub(r"\bplane=None\b", options["no_plane"], text)
    text = re.sub(r"^([a-z][a-z0-9_]*):", lambda m: f"{options.get(m[1], m[1])}:", text)

    def option(match: re.Match[str]) -> str:
        name, value = match[1], match[2] or ""
        if name not in options:
            return match[0]
        if value in ("", "True"):
            return options[name]
        return f"{options[name]} " + re.sub(r"['\"()\s]", "", value)

    return re.sub(NAME + r"('\w+'|\"\w+\"|\([^()]*\)|\w[\w.]*)?", option, text)
