# SPDX-License-Identifier: MIT
"""`save`: trajectories to a file, by its suffix."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sdftrack._internal.files import replacing, write_text
from sdftrack._internal.rotations import quaternion
from sdftrack._internal.validation import of_kind, vector
from sdftrack.motion.files.c3d import write_c3d
from sdftrack.motion.files.table import Array, regular_rate_hz, shared_times, table_text
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


# -- Files of OpenSim: orientations and positions as storages (.sto), points as markers (.trc)


NAN3, NAN4 = ["nan"] * 3, ["nan"] * 4


def orientation_text(trajectories: Sequence[Trajectory]) -> str:
    """A storage of quaternions w,x,y,z: the type that OpenSim reads as TimeSeriesTableQuaternion."""
    # Signs are those of continuous motion: q and -q are one rotation, but not one curve.
    columns = []
    for t in trajectories:
        last, column = np.array([0.0, 0.0, 0.0, 1.0]), []
        for T, usable in zip(t.poses, t.usable, strict=True):
            if usable:
                q = quaternion(T[:3, :3])
                last = q if q @ last >= 0 else -q
            column.append(_cell(last[[3, 0, 1, 2]]) if usable else ",".join(NAN4))
        columns.append(column)
    return _storage(trajectories, "Quaternion", columns)


def position_text(trajectories: Sequence[Trajectory]) -> str:
    """A storage of positions x,y,z in metres: TimeSeriesTableVec3."""
    columns = [
        [_cell(T[:3, 3]) if usable else ",".join(NAN3) for T, usable in zip(t.poses, t.usable, strict=True)]
        for t in trajectories
    ]
    return _storage(trajectories, "Vec3", columns)


def _storage(trajectories: Sequence[Trajectory], kind: str, columns: list[list[str]]) -> str:
    times = shared_times(trajectories, ".sto")
    _check_names([t.name for t in trajectories])
    rate = trajectories[0].rate_hz
    head = [f"DataRate={rate:.6f}"] if np.isfinite(rate) else []
    head += [f"DataType={kind}", "version=3", "endheader"]
    rows = ["\t".join(["time", *(t.name for t in trajectories)])]
    rows += ["\t".join([repr(float(time)), *cells]) for time, *cells in zip(times, *columns, strict=True)]
    return "\n".join([*head, *rows]) + "\n"


def trc_text(
    trajectories: Sequence[Trajectory], points: Mapping[str, Mapping[str, Array]], file_name: str
) -> str:
    """Markers in millimetres: the origin of each object, under its name, and its `points`, as "<name>_<label>"."""
    times = shared_times(trajectories, ".trc")
    rate = regular_rate_hz(times, ".trc")
    names, markers = [], []
    for t in trajectories:
        for label, point in {"": np.zeros(3), **points.get(t.name, {})}.items():
            names.append(f"{t.name}_{label}" if label else t.name)
            track = t.poses[:, :3, :3] @ point + t.poses[:, :3, 3]
            markers.append(np.where(t.usable[:, None], 1e3 * track, np.nan))
    _check_names(names)
    n, m = len(times), len(names)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{file_name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:.9g}\t{rate:.9g}\t{n}\t{m}\tmm\t{rate:.9g}\t1\t{n}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, m + 1) for axis in "XYZ"),
        "",
    ]
    for i, time in enumerate(times):
        values = [repr(float(v)) if np.isfinite(v) else "nan" for marker in markers for v in marker[i]]
        lines.append("\t".join([str(i + 1), repr(float(time)), *values]))
    return "\n".join(lines) + "\n"


def _cell(values: Array) -> str:
    return ",".join(repr(float(v)) for v in values)


def _check_names(names: Sequence[str]) -> None:
    for name in names:
        if any(c in name for c in "\t\r\n") or name != name.strip() or not name:
            raise ValueError(
                f"{name!r}: a name in a file of OpenSim has no tab, no line break and no space at its ends"
            )
    if len(set(names)) < len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise ValueError(f"points: two markers would have the name {twice[0]!r}; choose other labels")
