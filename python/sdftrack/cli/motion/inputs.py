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
from sdftrack._internal.text_files import WRONG, cell_text, read_text
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
    sessions: list[Session] = []
    for k, path in enumerate(job.results):
        own = path.stem if path.is_file() else path.resolve().name
        name = job.session[k] if job.session else own
        taken = [s.name for s in sessions]
        sessions.append(_load(path, f"{name} ({k + 1})" if name in taken else name, job))
    return sessions


def _load(path: Path, name: str, job: Motion) -> Session:
    import numpy as np

    from sdftrack.motion import at_point, best_known_point, in_frame, load, table_frame

    try:
        trajectories = load(path, fps=job.fps, unit=job.unit)
    except ValueError as error:
        if str(error).endswith("lost in all frames"):
            raise AllLost(str(error)) from None
        raise
    chosen, point = [], job.point_obj()
    for k in _chosen(path, [t.name for t in trajectories], job.object_):
        t = trajectories[k]
        if point == "center":
            middle = _center(path, t.name, k)
            t = at_point(t, best_known_point(t, (0, 0, 0) if middle is None else middle))
        elif point != "origin":
            t = at_point(t, point)
        x = t.poses[t.usable, :3, 3]
        far = float(np.linalg.norm(x - x[0], axis=1).max())
        if far > FARTHEST_M:
            raise ValueError(
                f"{path}: {t.name} moves {far:.4g} m away from its start; is the file in mm or cm? Give its unit "
                "(--unit mm)"
            )
        chosen.append(t)
    up: Any = job.up_camera()
    if job.table:
        T = table_frame(*_table_of(path))
        up = T[2, :3] if up is None else up  # z of the table
        if job.frame == "table":
            chosen = [in_frame(t, T, "table") for t in chosen]
            up = T[:3, :3] @ up
    return Session(name, path, chosen, up)


def _chosen(path: Path, known: list[str], wanted: Sequence[str]) -> list[int]:
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
    if os.path.isfile(text):  # Path.is_file() fails where the times are too many to be the name of a file
        path, content = Path(text), read_text(Path(text))
        if path.suffix == ".json":
            try:
                value = json.loads(content)
                return [float(v) for v in (value["cues_s"] if isinstance(value, dict) else value)]
            except WRONG:
                form = 'JSON with "cues_s": [t1, t2, ...], or [t1, t2, ...]'
                raise ValueError(f"--cues {path}: expected {form}") from None
        text = ",".join(content.split())
    try:
        cues = [float(v) for v in text.replace(";", ",").split(",") if v]
    except ValueError:
        cues = [math.nan]
    if not all(map(math.isfinite, cues)):
        raise Usage(f"expected times in seconds, t1,t2,..., or a file of them, got {shown(text)}", "--cues")
    return cues


def read_spans(path: Path) -> Spans:
    """Start and end of the repetitions of each object in a corrected ``repetitions.json``, or in a CSV file."""
    if not path.is_file():
        raise FileNotFoundError(f"--repetitions: no such file: {path}")
    spans: Spans = {}
    try:
        content = read_text(path)
        if path.suffix.lower() == ".csv":
            for row in csv.DictReader(io.StringIO(content, newline=""), skipinitialspace=True):
                spans.setdefault(cell_text(row.get("object") or "") or None, []).append(_span(row))
            spans = spans or {None: []}
        else:
            value = json.loads(content)
            by_object = isinstance(value, dict) and "objects" in value
            given: dict[str | None, Any] = {}
            if by_object:
                given = {str(o["object"]): o["repetitions"] for o in value["objects"]}
            else:
                given[None] = value["repetitions"] if isinstance(value, dict) else value
            spans = {name: [_span(row) for row in rows] for name, rows in given.items()}
    except WRONG:
        raise ValueError(f"--repetitions {path}: expected {FORM}") from None
    for rows in spans.values():
        rows.sort()
        if not rows:
            raise ValueError(f"--repetitions {path}: expected at least one repetition, got none")
        for k, (start, end) in enumerate(rows):
            if not (math.isfinite(start) and math.isfinite(end) and start < end):
                raise ValueError(f"--repetitions {path}: expected start_s < end_s, got {start:g} and {end:g}")
            if k and start < rows[k - 1][1]:
                raise ValueError(
                    f"--repetitions {path}: expected repetitions one after another, but the one from {start:g} s "
                    f"starts before that from {rows[k - 1][0]:g} s ends ({rows[k - 1][1]:g} s)"
                )
    return spans


def _span(row: Any) -> tuple[float, float]:
    a, b = (row["start_s"], row["end_s"]) if isinstance(row, dict) else row
    return float(a), float(b)


def spans_of(spans: Spans, path: Path, trajectory: Any) -> list[tuple[float, float]] | None:
    rows = spans.get(trajectory.name, spans.get(None))
    first, last = float(trajectory.times_s[0]), float(trajectory.times_s[-1])
    for start, end in rows or ():
        if start < first - 1e-6 or end > last + 1e-6:
            raise ValueError(
                f"--repetitions {path}: expected times within the recording of {trajectory.name}, {first:g} to "
                f"{last:g} s, got {start:g} to {end:g} s"
            )
    return rows
