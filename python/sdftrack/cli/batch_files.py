# SPDX-License-Identifier: MIT
"""The journal of a batch, and the list of what it is to do."""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

from sdftrack._internal.files import write_text
from sdftrack.cli.batch_plan import Item
from sdftrack.cli.batch_task import Result

__all__ = ["JOURNAL", "Journal", "counts", "read_items", "read_journal", "write_items"]

JOURNAL, ITEMS = "journal.jsonl", "items.jsonl"


class Journal:
    """Events of a batch, a line of JSON each, from which another run goes on.

    Parameters
    ----------
    out : Path
        Folder of the batch.
    items : list of Item
        Of the plan.

    Raises
    ------
    ValueError
        The folder holds a batch whose calls of the same name were others.
    """

    def __init__(self, out: Path, items: list[Item]) -> None:
        self.ended = read_journal(out)
        for item in items:
            if item.name in self.ended:
                self.check(item, self.ended[item.name].get("digest"))
        self._file: TextIO = (out / JOURNAL).open("a", encoding="utf-8")
        if (out / JOURNAL).stat().st_size and not _ends_with_newline(out / JOURNAL):
            self._file.write("\n")  # after a line that a crash has cut

    def check(self, item: Item, digest: object) -> None:
        """ValueError if results of that name are those of another call."""
        if digest != item.digest:
            raise ValueError(
                f"out: expected a folder without results of other calls, got {item.name} with other options or of "
                "another recording; choose another folder, or give the job another name"
            )

    def status(self, item: Item) -> str | None:
        """How an item ended; None: not yet."""
        row = self.ended.get(item.name)
        return None if row is None else str(row["status"])

    def forget(self, item: Item) -> None:
        """An item is to be done again."""
        self.ended.pop(item.name, None)

    def add(self, item: Item, result: Result) -> None:
        """An item has ended."""
        row = {
            "time": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "item": item.name, "status": result.status,
            "reason": result.reason, "seconds": result.seconds, "digest": item.digest,
        }  # fmt: skip
        self._file.write(json.dumps(row) + "\n")
        self._file.flush()
        self.ended[item.name] = row

    def close(self) -> None:
        self._file.close()


def _ends_with_newline(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"


def read_journal(out: Path) -> dict[str, dict[str, Any]]:
    """The last event of each item; a line that was cut is left out."""
    path = out / JOURNAL
    if not path.is_file():
        return {}
    found: dict[str, dict[str, Any]] = {}
    with path.open(encoding="utf-8", errors="replace") as file:
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
    path = out / ITEMS
    if not path.is_file():
        raise FileNotFoundError(f"{out}: expected the folder of a batch (--out), found no {ITEMS} in it")
    with path.open(encoding="utf-8") as file:
        return [str(json.loads(line)["name"]) for line in file if line.strip()]


def counts(names: Iterable[str], ended: Mapping[str, Mapping[str, Any]]) -> Counter[str]:
    """Number of items by status; "open" where there is none yet."""
    return Counter(str(ended[name]["status"]) if name in ended else "open" for name in names)
