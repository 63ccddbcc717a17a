# SPDX-License-Identifier: MIT
"""Tables of the documents from the records: ``python -m experiments.render`` fills them in, ``--check`` compares.

In a page of docs/ a block ::

    <!-- table: NAME#ID -->
    <!-- end -->

holds the table ID of experiments/results/NAME.json; ``NAME#ID NAME#ID`` with equal columns become one table. What is
between the two lines is replaced.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments import record

DOCS = Path(__file__).resolve().parents[1] / "docs"
BLOCK = re.compile(r"(<!-- table: (.+?) -->\n).*?(<!-- end -->)", re.DOTALL)
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
    """(name of the experiment, id of the table) of each table of a page."""
    return [_reference(part) for found in BLOCK.finditer(text) for part in found[2].split()]


def filled(text: str, results: Path = record.RESULTS) -> str:
    """The page with every block filled from its records; ValueError for a table that a record does not have."""

    def fill(found: re.Match[str]) -> str:
        return (
            found[1]
            + table_text([_table(*_reference(part), results) for part in found[2].split()])
            + found[3]
        )

    return BLOCK.sub(fill, text)


def table_text(tables: Sequence[tuple[str, Mapping[str, Any], Mapping[str, Any]]]) -> str:
    """Markdown of (name, table, run): titles, rows and notes of all, and which runs measured them."""
    columns = tables[0][1]["columns"]
    for name, table, _ in tables:
        if table["columns"] != columns:
            raise ValueError(f"{name}#{table['id']}: expected the columns {columns}, got {table['columns']}")
    rows = [row for _, table, _ in tables for row in table["rows"]]
    notes = [note for _, table, _ in tables for note in table["notes"]]
    parts = [f"**{'; '.join(dict.fromkeys(table['title'] for _, table, _ in tables))}**"]
    if columns:
        sides = [_side([row[i] for row in rows]) for i in range(len(columns))]
        parts.append("\n".join(map(_line, [columns, sides, *rows])))
    if notes:
        parts.append("\\\n".join(notes))
    parts.append(f"<sub>{'; '.join(_sources(tables))}</sub>")
    return "\n\n".join(parts) + "\n"


def _reference(text: str) -> tuple[str, str]:
    name, mark, wanted = text.partition("#")
    if not mark or not wanted:
        raise ValueError(f"table: expected NAME#ID, got {text!r}")
    return name, wanted


def _table(name: str, wanted: str, results: Path) -> tuple[str, Mapping[str, Any], Mapping[str, Any]]:
    measured = record.load(name, results)
    for table in measured["tables"]:
        if table["id"] == wanted:
            retired = measured.get("retired") or table.get("retired")
            return name, table, {**measured["runs"][table["run"]], "retired": retired}
    ids = ", ".join(table["id"] for table in measured["tables"])
    raise ValueError(f"{name}: no table {wanted!r} in its record; expected one of: {ids}")


def _sources(tables: Sequence[tuple[str, Mapping[str, Any], Mapping[str, Any]]]) -> list[str]:
    """Experiments and their runs as text; experiments of one run stand together."""
    names: dict[str, list[str]] = {}
    for name, _, run in tables:
        machine = run["machine"]
        cores = (
            f", {machine['cores']} core{'s' if machine['cores'] != 1 else ''}" if machine.get("cores") else ""
        )
        load = f", {machine['load']}" if machine.get("load") else ""
        more = ", retired" if run.get("retired") else ""
        where = f"{machine['cpu']}{cores}{load} · {run['date']} · commit {run['commit']}{more}"
        names.setdefault(where, [])
        if f"`{name}`" not in names[where]:
            names[where].append(f"`{name}`")
    return [f"{', '.join(found)} · {where}" for where, found in names.items()]


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _side(cells: Sequence[str]) -> str:
    """Numbers are set to the right."""
    return "---:" if all(NUMBER.fullmatch(cell) for cell in cells) else "---"


if __name__ == "__main__":
    raise SystemExit(main())
