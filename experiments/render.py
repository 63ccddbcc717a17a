# SPDX-License-Identifier: MIT
"""Tables of the documents from the records: ``python -m experiments.render`` fills them in, ``--check`` compares.

In a page of docs/ a block ::

    <!-- table: NAME#ID -->
    <!-- end -->

holds the table ID of experiments/results/NAME.json. What is between the two lines is replaced.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments import record

__all__ = ["DOCS", "blocks", "filled", "main", "table_text"]

DOCS = Path(__file__).resolve().parents[1] / "docs"
BLOCK = re.compile(r"(<!-- table: (\S+?)#(\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
NUMBER = re.compile(r"[-+]?[\d.,]+( ?%| x)?|-|nan|")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry of the command; the exit code: 1 if --check finds a page that differs from its records."""
    parser = argparse.ArgumentParser(prog="python -m experiments.render", description=__doc__.split("\n")[0])
    parser.add_argument("--check", action="store_true", help="change nothing, name the pages that differ")
    parser.add_argument("--docs", type=Path, default=DOCS, metavar="PATH", help="folder of the pages")
    parser.add_argument(
        "--results", type=Path, default=record.RESULTS, metavar="PATH", help="folder of the records"
    )
    asked = parser.parse_args(arguments)
    differ = []
    for page in sorted(asked.docs.rglob("*.md")):
        before = page.read_text(encoding="utf-8")
        try:
            after = filled(before, asked.results)
        except (FileNotFoundError, ValueError) as error:
            print(f"{page}: {error}", file=sys.stderr)
            return 1
        if after != before:
            differ.append(page)
            if not asked.check:
                page.write_text(after, encoding="utf-8")
    for page in differ:
        print(f"{page}: differs from its records; run python -m experiments.render" if asked.check else page)
    return 1 if asked.check and differ else 0


def blocks(text: str) -> list[tuple[str, str]]:
    """(name of the experiment, id of the table) of each block of a page."""
    return [(found[2], found[3]) for found in BLOCK.finditer(text)]


def filled(text: str, results: Path = record.RESULTS) -> str:
    """The page with every block filled from its record; ValueError for a table that the record does not have."""

    def fill(found: re.Match[str]) -> str:
        name, wanted = found[2], found[3]
        measured = record.load(name, results)
        for table in measured["tables"]:
            if table["id"] == wanted:
                return found[1] + table_text(name, table, measured["runs"][table["run"]]) + found[4]
        ids = ", ".join(table["id"] for table in measured["tables"])
        raise ValueError(f"{name}: no table {wanted!r} in its record; expected one of: {ids}")

    return BLOCK.sub(fill, text)


def table_text(name: str, table: Mapping[str, Any], run: Mapping[str, Any]) -> str:
    """Markdown of a table: title, rows, notes, and which run measured it."""
    parts = [f"**{table['title']}**"]
    if table["columns"]:
        sides = [_side([row[i] for row in table["rows"]]) for i in range(len(table["columns"]))]
        parts.append("\n".join(map(_line, [table["columns"], sides, *table["rows"]])))
    if table["notes"]:
        parts.append("\\\n".join(table["notes"]))
    cpu, cores = run["machine"]["cpu"], run["machine"]["cores"]
    where = cpu if cores is None else f"{cpu}, {cores} cores" if cores != 1 else f"{cpu}, 1 core"
    copied = ", transcribed" if run.get("transcribed") else ""
    parts.append(f"<sub>`{name}` · {where} · {run['date']} · commit {run['commit']}{copied}</sub>")
    return "\n\n".join(parts) + "\n"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _side(cells: Sequence[str]) -> str:
    """Numbers are set to the right."""
    return "---:" if all(NUMBER.fullmatch(cell) for cell in cells) else "---"


if __name__ == "__main__":
    raise SystemExit(main())
