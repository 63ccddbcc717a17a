# SPDX-License-Identifier: MIT
"""What ``sdftrack motion`` measures: the trajectories of each result, and the table of its recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sdftrack.cli.common import Usage

__all__ = ["AllLost", "Session", "Wishes", "load_sessions", "numbers_of", "parse_point"]

Numbers = tuple[float, ...]
FARTHEST_M = 20.0  # from the first position: no hand carries an object farther in front of a camera


class AllLost(Exception):
    """No object of a result has any pose."""


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


def load_sessions(paths: Sequence[Path], names: Sequence[str], wishes: Wishes) -> list[Session]:
    """One session per result, of names that differ: `names`, or those of the files."""
    sessions: list[Session] = []
    for k, path in enumerate(paths):
        own = path.stem if path.is_file() else path.resolve().name
        name = names[k] if names else own
        taken = [s.name for s in sessions]
        sessions.append(_load(path, f"{name} ({k + 1})" if name in taken else name, wishes))
    return sessions


def _load(path: Path, name: str, wishes: Wishes) -> Session:
    from sdftrack.motion import in_frame, load, table_frame

    try:
        trajectories = load(path, fps=wishes.fps, unit=wishes.unit)
    except ValueError as error:
        if str(error).endswith("lost in all frames"):
            raise AllLost(str(error)) from None
        raise
    places = _chosen(path, [t.name for t in trajectories], wishes.objects)
    chosen = [_at_point(path, k, trajectories[k], wishes.point) for k in places]
    for t in chosen:
        _check_reach(path, t)
    up: Any = wishes.up
    if wishes.table:
        T = table_frame(*_table_of(path))
        up = T[2, :3] if wishes.up is None else up  # z of the table
        if wishes.in_table_frame:
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


def _at_point(path: Path, k: int, trajectory: Any, point: str | Numbers) -> Any:
    from sdftrack.motion import at_point, best_known_point

    if point == "origin":
        return trajectory
    if point == "center":
        middle = _center(path, trajectory.name, k)
        return at_point(trajectory, best_known_point(trajectory, (0, 0, 0) if middle is None else middle))
    return at_point(trajectory, point)


def _center(path: Path, name: str, k: int) -> Any:
    """The middle of the model that the report names, in its own unit; None where it is not known."""
    from sdftrack.cli.view_files import model_of_report
    from sdftrack.io.report_file import read_results

    if not path.is_dir():
        return None
    # Objects that are lost throughout have no trajectory, so the report may have more of them.
    names = [str(o["name"]) for o in read_results(path)["frames"][0]["objects"]]
    mesh = model_of_report(path, names.index(name) if names.count(name) == 1 else k)
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
        return st.remove_plane(seq[0], seq.camera)[1]


def parse_point(text: str) -> str | Numbers:
    """`center`, `origin` or coordinates in metres."""
    return text if text in ("center", "origin") else numbers_of(text, 3, "--point")


def numbers_of(text: str, count: int, option: str) -> Numbers:
    """`count` finite numbers separated by commas; usage error otherwise."""
    import math

    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or not all(map(math.isfinite, values)):
        raise Usage(f"expected {count} numbers separated by commas, got {text!r}", option)
    return values
