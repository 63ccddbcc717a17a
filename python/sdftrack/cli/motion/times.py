# SPDX-License-Identifier: MIT
"""Times that ``sdftrack motion`` is given: signals to start, and repetitions corrected by hand."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sdftrack._internal.csv_cells import cell_text
from sdftrack._internal.text_files import WRONG, read_text
from sdftrack._internal.validation import shown
from sdftrack.cli.options import Usage

__all__ = ["Spans", "read_cues", "read_spans", "spans_of"]

Spans = dict[str | None, list[tuple[float, float]]]  # by name of the object; None: of every object
FORM = (
    "a repetitions.json of this command, [[start_s, end_s], ...], or a CSV file with columns start_s,end_s "
    "(and object)"
)


def read_cues(text: str | None) -> list[float]:
    """Times from ``t1,t2`` or from a file with a time per line or exercise.json's ``cues_s``."""
    if text is None:
        return []
    path = Path(text)
    if path.is_file():
        content = read_text(path)
        if path.suffix == ".json":
            return _cues_of_json(path, content)
        text = ",".join(content.split())
    try:
        cues = [float(v) for v in text.replace(";", ",").split(",") if v]
    except ValueError:
        cues = [math.nan]
    if not all(map(math.isfinite, cues)):
        raise Usage(f"expected times in seconds, t1,t2,..., or a file of them, got {shown(text)}", "--cues")
    return cues


def _cues_of_json(path: Path, content: str) -> list[float]:
    try:
        value = json.loads(content)
        return [float(v) for v in (value["cues_s"] if isinstance(value, dict) else value)]
    except WRONG:
        raise ValueError(
            f'--cues {path}: expected JSON with "cues_s": [t1, t2, ...], or [t1, t2, ...]'
        ) from None


def read_spans(path: Path) -> Spans:
    """Start and end of the repetitions of each object in a corrected ``repetitions.json``, or in a CSV file."""
    if not path.is_file():
        raise FileNotFoundError(f"--repetitions: no such file: {path}")
    try:
        content = path.read_text(encoding="utf-8-sig")
        spans = _spans_of_csv(content) if path.suffix.lower() == ".csv" else _spans_of_json(content)
    except WRONG:
        raise ValueError(f"--repetitions {path}: expected {FORM}") from None
    for rows in spans.values():
        _check(path, sorted(rows))
    return {name: sorted(rows) for name, rows in spans.items()}


def _spans_of_json(content: str) -> Spans:
    value = json.loads(content)
    if isinstance(value, dict) and "objects" in value:
        return {str(o["object"]): [_span(r) for r in o["repetitions"]] for o in value["objects"]}
    return {None: [_span(r) for r in (value["repetitions"] if isinstance(value, dict) else value)]}


def _spans_of_csv(content: str) -> Spans:
    spans: Spans = {}
    for row in csv.DictReader(io.StringIO(content, newline=""), skipinitialspace=True):
        spans.setdefault(cell_text(row.get("object") or "") or None, []).append(_span(row))
    return spans or {None: []}


def _span(row: Any) -> tuple[float, float]:
    a, b = (row["start_s"], row["end_s"]) if isinstance(row, dict) else row
    return float(a), float(b)


def _check(path: Path, rows: Sequence[tuple[float, float]]) -> None:
    if not rows:
        raise ValueError(f"--repetitions {path}: expected at least one repetition, got none")
    for k, (start, end) in enumerate(rows):
        if not (math.isfinite(start) and math.isfinite(end) and start < end):
            raise ValueError(f"--repetitions {path}: expected start_s < end_s, got {start:g} and {end:g}")
        if k and start < rows[k - 1][1]:
            raise ValueError(
                f"--repetitions {path}: expected repetitions one after another, but the one from {start:g} s starts "
                f"before that from {rows[k - 1][0]:g} s ends ({rows[k - 1][1]:g} s)"
            )


def spans_of(spans: Spans, path: Path, trajectory: Any) -> list[tuple[float, float]] | None:
    """The repetitions of one object, within its recording; None: the file does not speak of it."""
    rows = spans.get(trajectory.name, spans.get(None))
    first, last = float(trajectory.times_s[0]), float(trajectory.times_s[-1])
    for start, end in rows or ():
        if start < first - 1e-6 or end > last + 1e-6:
            raise ValueError(
                f"--repetitions {path}: expected times within the recording of {trajectory.name}, {first:g} to "
                f"{last:g} s, got {start:g} to {end:g} s"
            )
    return rows
