# SPDX-License-Identifier: MIT
"""`save`: trajectories to a file, by its suffix."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from numpy.typing import ArrayLike

from sdftrack._internal.files import replacing, write_text
from sdftrack._internal.validation import of_kind, vector
from sdftrack.motion.files.c3d import write_c3d
from sdftrack.motion.files.opensim import orientation_text, position_text, trc_text
from sdftrack.motion.files.record import Array
from sdftrack.motion.files.table import table_text
from sdftrack.motion.trajectory import Trajectory

SUFFIXES = (".csv", ".c3d", ".sto", ".trc")


def save(
    path: str | os.PathLike[str],
    trajectories: Trajectory | Sequence[Trajectory],
    *,
    points: Mapping[str, Mapping[str, ArrayLike]] | None = None,
) -> None:
    """Write trajectories, completely or not at all; the suffix names the format (docs/data.md, "Trajectory files").

    Parameters
    ----------
    path : path
        ``.csv``: a table with everything, one row per object and frame; no other format has room for covariances.
        ``.c3d``: rigid bodies (extra ``motion``). ``.sto``: orientations for OpenSim, and the positions beside it as
        ``<stem>_position.sto``. ``.trc``: markers for OpenSim. A file of that name is replaced.
    trajectories : Trajectory or sequence of Trajectory
        With different names. Except in CSV, all objects have the same times; C3D and TRC have one frame rate.
    points : {name: {label: (3,) array}}, optional
        For ``.trc``: points of an object, in its frame, m, written as markers "<name>_<label>" beside its origin.

    Raises
    ------
    TypeError, ValueError, FileNotFoundError, ImportError
        In one line; then no file was written.

    Examples
    --------
    >>> st.motion.save("cup.trc", cup, points={"cup": {"rim": (0, 0, 0.05)}})  # doctest: +SKIP
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"path: expected a suffix of {', '.join(SUFFIXES)}, got {str(path)!r}")
    chosen = [trajectories] if isinstance(trajectories, Trajectory) else list(trajectories)
    _check(chosen)
    if points is not None and suffix != ".trc":
        raise ValueError(f"points: only a .trc file has markers, got {str(path)!r}")
    if suffix == ".csv":
        write_text(path, table_text(chosen))
    elif suffix == ".trc":
        write_text(path, trc_text(chosen, _checked_points(points or {}, chosen), path.name))
    elif suffix == ".c3d":
        with replacing(path) as temporary:
            write_c3d(temporary, chosen)
    else:
        texts = orientation_text(chosen), position_text(chosen)
        with replacing(path) as first, replacing(path.with_name(f"{path.stem}_position.sto")) as second:
            for file, text in zip((first, second), texts, strict=True):
                file.write_text(text, encoding="utf-8")


def _check(trajectories: list[Trajectory]) -> None:
    if not trajectories:
        raise ValueError("trajectories: expected at least one, got none")
    for t in trajectories:
        of_kind(t, Trajectory, "trajectories")
    names = [t.name for t in trajectories]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"trajectories: expected a different name for each, got {twice[0]!r} twice")


def _checked_points(
    points: Mapping[str, Mapping[str, ArrayLike]], trajectories: list[Trajectory]
) -> dict[str, dict[str, Array]]:
    names = [t.name for t in trajectories]
    checked: dict[str, dict[str, Array]] = {}
    for name, labelled in points.items():
        if name not in names:
            raise ValueError(f"points: expected names of the trajectories, {names}, got {name!r}")
        checked[name] = {}
        for label, point in labelled.items():
            if not label:
                raise ValueError(f"points[{name!r}]: expected a label of the point, got {label!r}")
            checked[name][label] = vector(point, f"points[{name!r}][{label!r}]")
    return checked
