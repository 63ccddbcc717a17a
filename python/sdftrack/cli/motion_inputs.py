# SPDX-License-Identifier: MIT
"""What ``sdftrack motion`` reads: trajectories, the table of their recording, cues and corrected repetitions."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sdftrack.cli.common import Usage

__all__ = ["Session", "Wishes", "load_sessions", "numbers_of", "parse_point", "read_cues", "read_spans"]

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class Wishes:
    """How trajectories are read. `point`: "center", "origin" or coordinates; `table`: find it in the recording."""

    fps: float | None
    unit: str | None
    objects: tuple[str, ...]
    point: str | Numbers
    up: Numbers | None
    table: bool
    in_table_frame: bool


@dataclass(frozen=True)
class Session:
    """Trajectories of one result; `up`: the direction against gravity in their frame, None where unknown."""

    name: str
    path: Path
    trajectories: list[Any]
    up: Any


def load_sessions(paths: Sequence[Path], wishes: Wishes) -> list[Session]:
    """One session per result, of names that differ."""
    sessions: list[Session] = []
    for path in paths:
        session = _load(path, wishes)
        names = [s.name for s in sessions]
        if session.name in names:
            session = replace(session, name=f"{session.name} ({len(sessions) + 1})")
        sessions.append(session)
    return sessions


def _load(path: Path, wishes: Wishes) -> Session:
    from sdftrack.motion import in_frame, load, table_frame

    trajectories = load(path, fps=wishes.fps, unit=wishes.unit)
    if wishes.objects:
        known = [t.name for t in trajectories]
        missing = [n for n in wishes.objects if n not in known]
        if missing:
            raise ValueError(f"--object: {path} has {', '.join(known)}, not {missing[0]!r}")
        trajectories = [t for t in trajectories if t.name in wishes.objects]
    trajectories = [_at_point(path, k, t, wishes.point) for k, t in enumerate(trajectories)]
    up: Any = wishes.up
    if wishes.table:
        normal, offset = _table_of(path)
        up = normal if wishes.up is None else up
        if wishes.in_table_frame:
            T = table_frame(normal, offset)
            trajectories = [in_frame(t, T, "table") for t in trajectories]
            up = T[:3, :3] @ up
    return Session(path.stem if path.is_file() else path.resolve().name, path, trajectories, up)


def _at_point(path: Path, k: int, trajectory: Any, point: str | Numbers) -> Any:
    from sdftrack.motion import at_point, best_known_point

    if point == "origin":
        return trajectory
    if point == "center":
        middle = _center(path, k)
        return at_point(trajectory, best_known_point(trajectory, (0, 0, 0) if middle is None else middle))
    return at_point(trajectory, point)


def _center(path: Path, k: int) -> Any:
    """The middle of the model that the report names, in its own unit; None where it is not known."""
    from sdftrack.cli.view_files import model_of_report

    mesh = model_of_report(path, k) if path.is_dir() else None
    return None if mesh is None else 0.5 * (mesh.bounds[0] + mesh.bounds[1])


def _table_of(path: Path) -> Any:
    """(n, d) of the dominant plane in the first image of the recording that the report names."""
    import sdftrack as st
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
        _, (normal, offset) = st.remove_plane(seq[0], seq.camera)
    # The camera is above the table.
    return (normal, offset) if offset >= 0 else (-normal, -offset)


def parse_point(text: str) -> str | Numbers:
    """`center`, `origin` or coordinates in metres."""
    return text if text in ("center", "origin") else numbers_of(text, 3, "--point")


def numbers_of(text: str, count: int, option: str) -> Numbers:
    """`count` numbers separated by commas; usage error otherwise."""
    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        raise Usage(f"expected {count} numbers separated by commas, got {text!r}", option)
    return values


def read_cues(text: str | None) -> list[float]:
    """Times from ``t1,t2`` or from a file with a time per line or exercise.json's ``cues_s``."""
    if text is None:
        return []
    path = Path(text)
    if path.is_file():
        content = path.read_text(encoding="utf-8")
        if path.suffix == ".json":
            return [float(v) for v in _json(path, content, "cues_s")]
        text = ",".join(content.split())
    try:
        return [float(v) for v in text.replace(";", ",").split(",") if v]
    except ValueError:
        raise Usage(
            f"expected times in seconds, t1,t2,..., or a file of them, got {text!r}", "--cues"
        ) from None


def read_spans(path: Path) -> list[tuple[float, float]]:
    """Start and end of the repetitions of the first object in a ``repetitions.json``."""
    if not path.is_file():
        raise FileNotFoundError(f"--repetitions: no such file: {path}")
    content = path.read_text(encoding="utf-8")
    try:
        value = json.loads(content)
        rows = value["objects"][0]["repetitions"] if isinstance(value, dict) else value
        return [(float(a), float(b)) for a, b in rows]
    except (ValueError, TypeError, KeyError, IndexError):
        raise ValueError(
            f"--repetitions {path}: expected a repetitions.json of this command, or [[start_s, end_s], ...]"
        ) from None


def _json(path: Path, content: str, key: str) -> Any:
    try:
        return json.loads(content)[key]
    except (ValueError, TypeError, KeyError):
        raise ValueError(f"--cues {path}: expected JSON with {key!r}: [t1, t2, ...]") from None
