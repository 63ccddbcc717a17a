# SPDX-License-Identifier: MIT
"""What ``sdftrack motion`` measures: the trajectories of each result, and the table of its recording."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sdftrack as st
from sdftrack._internal.csv_cells import cell_text
from sdftrack._internal.text_files import WRONG, read_text
from sdftrack._internal.validation import shown
from sdftrack.cli.options import Usage

if TYPE_CHECKING:
    from sdftrack.cli.motion import Motion

FARTHEST_M = 20.0  # from the first position: no hand carries an object farther in front of a camera


class AllLost(Exception):
    """No object of a result has any pose."""


@dataclass(frozen=True)
class Session:
    """Trajectories of one result; `up`: the direction against gravity in their frame, None where unknown."""

    name: str
    path: Path
    trajectories: list[Any]
    up: Any


def load_sessions(job: Motion) -> list[Session]:
    """One session per result, of names that differ: --session, or those of the files."""
    sessions: list[Session] = []
    for k, path in enumerate(job.results):
        own = path.stem if path.is_file() else path.resolve().name
        name = job.session[k] if job.session else own
        taken = [s.name for s in sessions]
        sessions.append(_load(path, f"{name} ({k + 1})" if name in taken else name, job))
    return sessions


def _load(path: Path, name: str, job: Motion) -> Session:
    from sdftrack.motion import in_frame, load, table_frame

    try:
        trajectories = load(path, fps=job.fps, unit=job.unit)
    except ValueError as error:
        if str(error).endswith("lost in all frames"):
            raise AllLost(str(error)) from None
        raise
    places = _chosen(path, [t.name for t in trajectories], job.object_)
    chosen = [_at_point(path, k, trajectories[k], job.point_obj()) for k in places]
    for t in chosen:
        _check_reach(path, t)
    up: Any = job.up_camera()
    if job.table:
        T = table_frame(*_table_of(path))
        up = T[2, :3] if up is None else up  # z of the table
        if job.frame == "table":
            chosen = [in_frame(t, T, "table") for t in chosen]
            up = T[:3, :3] @ up
    return Session(name, path, chosen, up)


def _chosen(path: Path, known: list[str], wanted: Sequence[str]) -> list[int]:
    """Places of the objects with these names, or numbers from 1; all without any."""
    places = []
    for word in wanted:
        if word in known:
            places.append(known.index(word))
        elif word.isdecimal() and 1 <= int(word) <= len(known):
            places.append(int(word) - 1)
        else:
            listed = ", ".join(f"{k} {name}" for k, name in enumerate(known, 1))
            raise ValueError(f"--object: expected a name or number of {path} ({listed}), got {word!r}")
    return sorted(set(places)) if wanted else list(range(len(known)))


def _check_reach(path: Path, trajectory: Any) -> None:
    import numpy as np

    x = trajectory.poses[trajectory.usable, :3, 3]
    far = float(np.linalg.norm(x - x[0], axis=1).max())
    if far > FARTHEST_M:
        raise ValueError(
            f"{path}: {trajectory.name} moves {far:.4g} m away from its start; is the file in mm or cm? Give its unit "
            "(--unit mm)"
        )


def _at_point(path: Path, k: int, trajectory: Any, point: str | tuple[float, ...]) -> Any:
    from sdftrack.motion import at_point, best_known_point

    if point == "origin":
        return trajectory
    if point == "center":
        middle = _center(path, trajectory.name, k)
        return at_point(trajectory, best_known_point(trajectory, (0, 0, 0) if middle is None else middle))
    return at_point(trajectory, point)


def _center(path: Path, name: str, k: int) -> Any:
    """The middle of the model that the report names, in its own unit; None where it is not known."""
    from sdftrack.cli.view import model_of_report
    from sdftrack.io.report_file import read_results

    if not path.is_dir():
        return None
    # Objects that are lost throughout have no trajectory, so the report may have more of them.
    names = [str(o["name"]) for o in read_results(path)["frames"][0]["objects"]]
    mesh = model_of_report(path, names.index(name) if names.count(name) == 1 else k)
    return None if mesh is None else 0.5 * (mesh.bounds[0] + mesh.bounds[1])


def _table_of(path: Path) -> Any:
    """(n, d) of the dominant plane in the first image of the recording that the report names."""
    from sdftrack.io.report_file import read_results

    if not path.is_dir():
        raise ValueError(
            f"--up, --frame: {path} has no recording in which the table could be found; give --up x,y,z"
        )
    settings = read_results(path)["settings"]
    source = settings.get("sequence")
    if source is None or not Path(source).exists():
        raise ValueError(f"--up, --frame: the recording {source} of {path} is not there; give --up x,y,z")
    with st.open_sequence(source, layout=settings.get("layout", "auto")) as seq:
        return st.remove_plane(seq[0], seq.camera)[1]


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
    if os.path.isfile(text):  # Path.is_file() fails where the times are too many to be the name of a file
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
        content = read_text(path)
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
