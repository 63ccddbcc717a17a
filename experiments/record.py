# SPDX-License-Identifier: MIT
"""What an experiment measured, as JSON: one file for each experiment, ``experiments/results/NAME.json``.

::

    {"name": "synthetic",
     "runs": [{"machine": {"cpu": "...", "cores": 2}, "commit": "1a2b3c4", "date": "2026-11-23",
               "settings": {"frames": 300}, "seconds": 41.2, "sources": {"experiments/a/b.py": "1f0c..."}}],
     "tables": [{"id": "300-frames", "title": "...", "columns": ["mesh", "mean mm"],
                 "rows": [["spot", "0.0244"]], "notes": ["..."], "numbers": null, "run": 0}]}

``run`` is the index of the run that measured the table. Cells are text: they are shown as they were printed.

``"retired": true`` in a record, or in a table: its experiment has chosen a default once and is gone.
"""

from __future__ import annotations

import datetime
import json
import os
import platform
import re
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).resolve().parent / "results"
_VALUE = r'(?:"(?:[^"\\\n]|\\.)*"|[-+\w.]+)'
MOST_NUMBERS = 400  # beside a table: of one frame each they would be the larger part of all records
FLAT_LIST = re.compile(rf"\[\n\s*({_VALUE}(?:,\n\s*{_VALUE})*)\n\s*\]")


def save(
    name: str,
    settings: Mapping[str, Any],
    tables: Sequence[Mapping[str, Any]],
    seconds: float,
    *,
    sources: Mapping[str, str] | None = None,
    instead_of: Mapping[str, Any] | None = None,
    folder: Path = RESULTS,
) -> Path:
    """Record a run. It replaces the run with the same settings; those with others stay beside it.

    Parameters
    ----------
    name : str
        Name of the experiment.
    settings : mapping
        Options of the run; values that JSON does not know become text.
    tables : sequence of mappings
        ``title``, ``columns``, ``rows`` and optionally ``id`` (default: `table_id` of the title; of equal ones the
        later end in -2, -3), ``notes`` (lines below the table) and ``numbers`` (unrounded values, where they are few).
    seconds : float
        Wall-clock time of the run.
    sources : mapping, optional
        Digests of what was measured with (:mod:`experiments.sources`).
    instead_of : mapping, optional
        Settings of another run that it replaces, too.
    folder : Path
        Where the file NAME.json is, or is to be.

    Returns
    -------
    Path
        The file. It is written whole or not at all.

    Raises
    ------
    ValueError
        A row whose number of cells differs from the number of columns.
    """
    run = {
        "machine": machine(),
        "commit": _commit(),
        "date": datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        "settings": json.loads(json.dumps(dict(settings), default=_plain)),
        "seconds": round(seconds, 3),
        **({} if sources is None else {"sources": dict(sources)}),
    }
    measured = [_checked(name, table) for table in tables]
    before = load(name, folder) if path_of(name, folder).exists() else {"runs": [], "tables": []}
    return _write(_merged(name, before, run, measured, instead_of), path_of(name, folder))


def load(name: str, folder: Path = RESULTS) -> dict[str, Any]:
    """The record of an experiment; FileNotFoundError names the records that there are."""
    path = path_of(name, folder)
    if not path.exists():
        there = ", ".join(names(folder)) or "none"
        raise FileNotFoundError(
            f"{name}: no record in {folder}; expected one of: {there}; run the experiment first"
        )
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return record


def names(folder: Path = RESULTS) -> list[str]:
    """Names of the experiments that have a record."""
    return sorted(path.name.removesuffix(".json") for path in folder.glob("*.json"))


def path_of(name: str, folder: Path = RESULTS) -> Path:
    """The file of an experiment's record."""
    return folder / f"{name}.json"


def table_id(title: str) -> str:
    """Lower-case words of a title joined by hyphens; "table" for a title without any."""
    return "-".join(re.findall(r"[a-z0-9.]+", title.lower())).replace(".", "-") or "table"


def machine() -> dict[str, Any]:
    """This machine: model of the processor and the number of cores that this process may use."""
    model = platform.processor() or platform.machine()
    try:
        found = re.search(
            r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.MULTILINE
        )
        model = found[1] if found else model
    except OSError:
        pass  # not Linux
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    # More waits than there are cores: times are not those of this machine alone.
    busy = hasattr(os, "getloadavg") and os.getloadavg()[2] > (cores or 1) + 0.5
    return {"cpu": model, "cores": cores, **({"load": "shared with other work"} if busy else {})}


def _commit() -> str | None:
    """The commit of the source folder, with "+changes" if files differ from it; None outside a repository."""
    root = Path(__file__).resolve().parents[1]

    def git(*arguments: str) -> str:
        done = subprocess.run(
            ["git", "-C", str(root), *arguments], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    try:
        others = ":(exclude)experiments/results"  # so that several experiments can be recorded in a row
        changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", others)
        return git("rev-parse", "--short", "HEAD") + ("+changes" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return None


def _checked(name: str, table: Mapping[str, Any]) -> dict[str, Any]:
    title, columns = str(table["title"]), list(table["columns"])
    rows = [[str(cell) for cell in row] for row in table["rows"]]
    for number, row in enumerate(rows):
        if len(row) != len(columns):
            raise ValueError(
                f"{name}: {title!r}: row {number}: expected {len(columns)} cells, got {len(row)}: {row}"
            )
    return {
        "id": table.get("id"),
        "title": title,
        "columns": columns,
        "rows": rows,
        "notes": list(table.get("notes") or []),
        "numbers": numbers if _size(numbers := table.get("numbers")) <= MOST_NUMBERS else None,
    }


def _size(value: Any) -> int:
    """How many numbers and words a value of the record holds."""
    if isinstance(value, Mapping):
        return sum(map(_size, value.values()))
    if isinstance(value, str) or not hasattr(value, "__iter__"):
        return 1
    return sum(map(_size, value))


def _merged(
    name: str,
    before: Mapping[str, Any],
    run: dict[str, Any],
    measured: Sequence[dict[str, Any]],
    instead_of: Mapping[str, Any] | None,
) -> dict[str, Any]:
    """The record with the new run instead of those that it replaces; tables keep their ids."""
    runs = [old for old in before["runs"] if old["settings"] not in (run["settings"], instead_of)]
    places = {number: runs.index(old) for number, old in enumerate(before["runs"]) if old in runs}
    kept = [{**table, "run": places[table["run"]]} for table in before["tables"] if table["run"] in places]
    known = [(table["title"], table["id"]) for table in before["tables"] if table["run"] not in places]
    taken = [table["id"] for table in kept]
    for table in measured:
        same = next((pair for pair in known if pair[0] == table["title"]), None)
        if same:
            known.remove(same)
        wanted = table["id"] or (same[1] if same else table_id(table["title"]))
        table["id"] = _unused(wanted, [*taken, *(other for _, other in known)])
        taken.append(table["id"])
    return {
        "name": name,
        "runs": [*runs, run],
        "tables": kept + [{**table, "run": len(runs)} for table in measured],
    }


def _unused(wanted: str, taken: Sequence[str]) -> str:
    number, name = 1, wanted
    while name in taken:
        number += 1
        name = f"{wanted}-{number}"
    return name


def _plain(value: Any) -> Any:
    """Arrays and scalars of numpy as lists and numbers, anything else as text."""
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _write(record: dict[str, Any], path: Path) -> Path:
    text = json.dumps(record, indent=1, ensure_ascii=False, default=_plain) + "\n"
    text = FLAT_LIST.sub(lambda found: "[" + re.sub(r"\n\s*", " ", found[1]) + "]", text)  # a row on one line
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        Path(temporary).chmod(0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return path
