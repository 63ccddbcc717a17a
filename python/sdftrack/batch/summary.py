# SPDX-License-Identifier: MIT
"""One table of a batch: what each call was, how it ended, and the numbers of its results."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sdftrack._internal.csv_cells import text_cell
from sdftrack._internal.extras import need
from sdftrack._internal.files import replacing, write_text
from sdftrack.batch.plan import Item

NUMBERS_OF = ("report.json", "result.json", "measures.json")
DEEPEST = 5  # of numbers in nested tables
MOST_ENTRIES = 20  # of a list, for example objects
LEFT_OUT = ("settings", "version", "seconds", "frames", "repetitions", "obj_id", "instance")


def summary_rows(
    out: Path, items: list[Item], ended: Mapping[str, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """A row for each item in the order of the plan: what it was, how it ended, the numbers of its results."""
    rows = []
    for item in items:
        row: dict[str, Any] = {
            "item": item.name, "job": item.job, "command": item.command, "recording": item.source, **item.matrix,
        }  # fmt: skip
        last = ended.get(item.name, {})
        row["status"] = last.get("status", "open")
        row["reason"] = last.get("reason", "")
        if row["status"] in ("done", "lost"):
            row |= _numbers(out / item.name)
        rows.append(row)
    return rows


def _numbers(folder: Path) -> dict[str, Any]:
    """Counts and single numbers in the JSON files of a folder of results."""
    found: dict[str, Any] = {}
    for name in NUMBERS_OF:
        path = folder / name
        if not path.is_file():
            continue
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except ValueError:
            continue
        if isinstance(content, dict):
            frames = content.get("frames")
            if isinstance(frames, list):
                found |= _frame_counts(frames)
            found |= dict(_leaves(content, "", 0))
    return found


def _frame_counts(frames: list[Any]) -> dict[str, Any]:
    """Number of frames, and of poses (or outlines) by status."""
    out: Counter[str] = Counter(frames=len(frames))
    for frame in frames:
        if not isinstance(frame, dict):
            continue
        objects = frame.get("objects")
        for entry in objects if isinstance(objects, list) else [frame]:
            if isinstance(entry, dict) and isinstance(entry.get("status"), str):
                out[entry["status"]] += 1
    return dict(out)


def _leaves(content: dict[str, Any], prefix: str, depth: int) -> Iterable[tuple[str, Any]]:
    """Single numbers with the names of the tables around them; entries of a list by their names."""
    for key, value in content.items():
        if key in LEFT_OUT or depth > DEEPEST:
            continue
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.", depth + 1)
        elif (
            isinstance(value, list) and len(value) <= MOST_ENTRIES and all(isinstance(v, dict) for v in value)
        ):
            for number, entry in enumerate(value):
                own = "" if len(value) == 1 else f"{entry.get('name', number)}."
                yield from _leaves(entry, prefix + own, depth + 1)
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield prefix + key, value


def write_summary(out: Path, rows: list[dict[str, Any]]) -> list[str]:
    """summary.csv, and summary.parquet where pyarrow is there; returns the names written."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = [[text_cell(column) for column in columns]]
    table += [[_cell(row.get(column)) for column in columns] for row in rows]
    write_text(out / "summary.csv", "".join(",".join(cells) + "\n" for cells in table))
    try:
        pyarrow, parquet = need("pyarrow", "batch"), need("pyarrow.parquet", "batch")
    except ImportError:
        return ["summary.csv"]
    typed = pyarrow.table({c: _column([row.get(c) for row in rows]) for c in columns})
    with replacing(out / "summary.parquet") as temporary:
        parquet.write_table(typed, temporary)
    return ["summary.csv", "summary.parquet"]


def _cell(value: Any) -> str:
    return text_cell(value) if isinstance(value, str) else "" if value is None else str(value)


def _column(values: list[Any]) -> list[Any]:
    """Values of one type: numbers, or text where there is some."""
    if any(isinstance(v, str) for v in values):
        return [None if v is None else str(v) for v in values]
    if any(isinstance(v, float) for v in values):
        return [None if v is None else float(v) for v in values]
    return values
