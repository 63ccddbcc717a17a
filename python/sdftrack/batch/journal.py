# SPDX-License-Identifier: MIT
"""The journal of a batch: how each call ended, a line of JSON each, from which another run goes on."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO

from sdftrack._internal.files import write_text
from sdftrack.batch.plan import Item
from sdftrack.batch.task import Result

JOURNAL, ITEMS = "journal.jsonl", "items.jsonl"
SUCCEEDED = ("done", "lost")
FAILED = ("refused", "died", "skipped")


class Journal:
    """The journal of the folder `out`; ValueError if that holds a batch whose calls of the same name were others."""

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
        """How an item ended; None: not yet."""
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
    if not (out / JOURNAL).is_file():
        return {}
    found: dict[str, dict[str, Any]] = {}
    with (out / JOURNAL).open(encoding="utf-8", errors="replace") as file:
        for line in file:
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
