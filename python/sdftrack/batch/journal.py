# SPDX-License-Identifier: MIT
"""How each call of a batch ended: a journal of JSON lines, from which another run goes on, and one table of all."""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO

from sdftrack._internal.extras import need
from sdftrack._internal.files import replacing, write_text
from sdftrack._internal.text_files import text_cell
from sdftrack.batch.plan import Item
from sdftrack.batch.task import Result

JOURNAL, ITEMS = "journal.jsonl", "items.jsonl"
SUCCEEDED = ("done", "lost")
FAILED = ("refused", "died", "skipped")
NUMBERS_OF = ("report.json", "result.json", "measures.json")
DEEPEST = 5  # of numbers in nested tables
MOST_ENTRIES = 20  # of a list, for example objects
LEFT_OUT = ("settings", "version", "seconds", "frames", "repetitions", "obj_id", "instance")


class Journal:
    """The journal of the folder `out`; ValueError if that holds a batch whose calls of the same name were others.
    `ended`: the last event of each item."""

    def __init__(self, out: Path, items: list[Item]) -> None:
        self.ended = read_journal(out)
        for item in items:
            if item.name in self.ended:
                self.check(item, self.ended[item.name]["digest"])
        self._file: BinaryIO = (out / JOURNAL).open("ab+")
        if self._file.tell():
            self._file.seek(-1, os.SEEK_END)
            if self._file.read() != b"\n":  # after a line that a crash has cut
                self._file.write(b"\n")

    def check(self, item: Item, digest: object) -> None:
        """ValueError if results of that name are those of another call."""
        if digest != item.digest:
            raise ValueError(
                f"out: expected a folder without results of other calls, got {item.name} with other options or of "
                "another recording; choose another folder, or give the job another name"
            )

    def status(self, name: str) -> str | None:
        return self.ended.get(name, {}).get("status")

    def succeeded(self, name: str) -> bool:
        return self.status(name) in SUCCEEDED

    def add(self, item: Item, result: Result) -> None:
        row = {
            "time": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "item": item.name, "status": result.status,
            "reason": result.reason, "seconds": result.seconds, "digest": item.digest,
        }  # fmt: skip
        self._file.write(json.dumps(row).encode() + b"\n")
        self._file.flush()
        self.ended[item.name] = row

    def close(self) -> None:
        self._file.close()


def read_journal(out: Path) -> dict[str, dict[str, Any]]:
    """The last event of each item; a line that was cut is left out."""
    found: dict[str, dict[str, Any]] = {}
    if (out / JOURNAL).is_file():
        for line in (out / JOURNAL).read_text(encoding="utf-8", errors="replace").split("\n"):
            try:
                row = json.loads(line)
                row["status"], row["reason"], row["seconds"], row["digest"]
                found[str(row["item"])] = row
            except (ValueError, KeyError, TypeError):
                continue
    return found


def write_items(out: Path, items: Iterable[Item]) -> None:
    """What the plan has become, for `batch status` and for people."""
    write_text(out / ITEMS, "".join(json.dumps(asdict(item)) + "\n" for item in items))


def read_items(out: Path) -> list[str]:
    """Names of the items of a batch; FileNotFoundError if the folder holds none."""
    if not (out / ITEMS).is_file():
        raise FileNotFoundError(f"{out}: expected the folder of a batch (--out), found no {ITEMS} in it")
    with (out / ITEMS).open(encoding="utf-8") as file:
        return [str(json.loads(line)["name"]) for line in file if line.strip()]


def write_summary(out: Path, items: list[Item], ended: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """A row for each item in the order of the plan: what it was, how it ended, the numbers of its results. In
    summary.csv, and in summary.parquet where pyarrow is there; returns the names written."""
    rows: list[dict[str, Any]] = []
    for item in items:
        last = ended.get(item.name, {"status": "open", "reason": ""})
        about = {"item": item.name, "job": item.job, "command": item.command, "recording": item.source}
        found = _numbers(out / item.name) if last["status"] in SUCCEEDED else {}
        rows.append({**about, **item.matrix, "status": last["status"], "reason": last["reason"], **found})
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table: list[list[Any]] = [columns, *([row.get(column) for column in columns] for row in rows)]
    write_text(out / "summary.csv", "".join(",".join(map(_cell, cells)) + "\n" for cells in table))
    try:
        pyarrow, parquet = need("pyarrow", "batch"), need("pyarrow.parquet", "batch")
    except ImportError:
        return ["summary.csv"]
    typed = pyarrow.table({c: _column([row.get(c) for row in rows]) for c in columns})
    with replacing(out / "summary.parquet") as temporary:
        parquet.write_table(typed, temporary)
    return ["summary.csv", "summary.parquet"]


def _numbers(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name in NUMBERS_OF:
        try:
            content = json.loads((folder / name).read_text(encoding="utf-8"))
        except (FileNotFoundError, ValueError):
            continue
        if isinstance(content, dict):
            frames = content.get("frames")
            if isinstance(frames, list):
                found |= _frame_counts([frame for frame in frames if isinstance(frame, dict)], len(frames))
            found |= dict(_leaves(content, "", 0))
    return found


def _frame_counts(frames: list[dict[str, Any]], count: int) -> dict[str, Any]:
    out: Counter[str] = Counter(frames=count)
    for frame in frames:
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
        elif isinstance(value, list) and len(value) <= MOST_ENTRIES:
            for number, entry in enumerate(value if all(isinstance(v, dict) for v in value) else []):
                own = "" if len(value) == 1 else f"{entry.get('name', number)}."
                yield from _leaves(entry, prefix + own, depth + 1)
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield prefix + key, value


def _cell(value: Any) -> str:
    return text_cell(value) if isinstance(value, str) else "" if value is None else str(value)


def _column(values: list[Any]) -> list[Any]:
    kind = next((kind for kind in (str, float) if any(isinstance(v, kind) for v in values)), None)
    return values if kind is None else [None if v is None else kind(v) for v in values]
