# SPDX-License-Identifier: MIT
"""The tables of options, from the schema of the core: added to the page options."""

from __future__ import annotations

import json
import re
from typing import Any

from sdftrack import _core
from sdftrack.contour.lwpr_data import AUTO

PAGE = "options"
MARK = re.compile(r"<!-- options: (\w+) -->")
TABLES: dict[str, Any] = {
    "tracker": _core.TrackerOptions, "reconstruct": _core.ReconstructionOptions, "contour": _core.ContourOptions,
    "lwpr": _core.LwprOptions, "memory": _core.MemoryOptions,
}  # fmt: skip


def table(name: str) -> str:
    lines = ["| option | default | expected | unit | meaning |", "| --- | --- | --- | --- | --- |"]
    for option in TABLES[name].fields().values():
        auto = name == "lwpr" and option.name in AUTO  # follows from the data, which the core does not know
        default = "auto" if auto else option.default
        shown = json.dumps(default) if isinstance(default, str) else repr(default)
        about = option.metadata
        expected = about["expected"] + (' or `"auto"`' if auto else "")
        cells = [f"`{option.name}`", f"`{shown}`", expected, about["unit"], about["meaning"]]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines)


def add_tables(_app: Any, docname: str, source: list[str]) -> None:
    if docname == PAGE:
        source[0] = MARK.sub(lambda mark: table(mark[1]), source[0])


def setup(app: Any) -> dict[str, Any]:
    app.connect("source-read", add_tables)
    return {"parallel_read_safe": True}
