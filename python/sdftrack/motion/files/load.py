# SPDX-License-Identifier: MIT
"""`load`: trajectories of any file that is known."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np

from sdftrack._internal.text_files import contents
from sdftrack._internal.validation import number
from sdftrack.io.report_file import read_results, result_of
from sdftrack.motion.files.c3d import read_c3d
from sdftrack.motion.files.record import Record, times_from_numbers
from sdftrack.motion.files.table import TITLE, read_table
from sdftrack.motion.files.text_rows import read_bop, read_tum_file
from sdftrack.motion.trajectory import USABLE, Trajectory

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}  # metres per unit
KNOWN = (
    "a result folder of sdftrack (report.json), .txt or .tum (TUM), .csv (BOP results, or written by st.motion.save), "
    ".c3d"
)


def load(
    path: str | os.PathLike[str],
    *,
    fps: float | None = None,
    unit: str | None = None,
    name: str | None = None,
) -> list[Trajectory]:
    """Trajectories of a file, one per object (docs/data.md, "Trajectory files").

    Parameters
    ----------
    path : path
        A result folder of `sdftrack track`, `reconstruct` or `live`; a TUM file (.txt, .tum); BOP results (.csv); a
        C3D file with rigid bodies (.c3d, extra ``motion``); a table of `save` (.csv).
    fps : float, optional
        Images per second. Replaces the times of the file: image number / fps where images are numbered (result
        folders, BOP), else row / fps. Required where the file has no times.
    unit : {"m", "cm", "mm"}, optional
        Unit of the lengths in the file. Default: that of the format, which is metres, for BOP millimetres, and for C3D
        the one that the file names.
    name : str, optional
        Only objects of this name; where the file names none (TUM, BOP), the name that the object gets.

    Returns
    -------
    list of Trajectory
        Poses in metres. Where the file has no pose, or NaN, the object is "lost". Objects without any pose are left
        out, with a warning. If names repeat, "_2", "_3", ... is added.

    Raises
    ------
    FileNotFoundError, ValueError, ImportError
        In one line, with the file's name.

    Examples
    --------
    >>> cup, = st.motion.load("out/trajectory_0.txt", name="cup")  # doctest: +SKIP
    """
    path = Path(path)
    if fps is not None:
        fps = number(fps, "fps")
        if not 0 < fps < 1e6:
            raise ValueError(f"fps: expected images per second, more than 0, got {fps:g}")
    if unit is not None and unit not in UNITS:
        raise ValueError(f"unit: expected one of {list(UNITS)}, got {unit!r}")
    records, own_unit, names_objects = _read(path, fps, unit)
    if name is not None and names_objects:
        known = sorted({record.name for record in records})
        records = [record for record in records if record.name == name]
        if not records:
            raise ValueError(f"name: {path} has no object {name!r}; it has {', '.join(known) or 'none'}")
    elif name is not None:
        for k, record in enumerate(records):
            record.name = name if len(records) == 1 else f"{name}_{k + 1}"
    return _trajectories(records, UNITS[unit or own_unit], path)


def _read(path: Path, fps: float | None, unit: str | None) -> tuple[list[Record], str, bool]:
    """Records, the unit of their lengths, and whether the file names its objects."""
    if path.name == "report.json":
        path = path.parent
    if path.is_dir():
        if not (path / "report.json").is_file():
            raise ValueError(f"{path}: this folder has no report.json; expected {KNOWN}")
        return read_result_folder(path, fps), "m", True
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file or folder")
    suffix = path.suffix.lower()
    if suffix not in (".txt", ".tum", ".csv", ".c3d"):
        raise ValueError(f"{path}: a trajectory cannot be read from '{path.suffix}'; expected {KNOWN}")
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: the file is empty")
    if suffix == ".c3d":
        records, own = read_c3d(path, fps, unit)
        return records, own, True
    try:
        text = path.read_bytes().decode("utf-8-sig")  # line breaks as they are: names may have some
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected text, got a binary file") from None
    if suffix != ".csv":
        return read_tum_file(path, fps), "m", False
    if text.startswith(TITLE):
        if unit not in (None, "m"):
            raise ValueError(f"unit: the columns of {path} are in metres, got {unit!r}")
        return read_table(path, text, fps), "m", True
    if text.startswith("scene_id,"):
        return read_bop(path, text, fps), "mm", False
    raise ValueError(
        f"{path}: expected BOP results, which begin with 'scene_id,im_id,obj_id,', or a table of st.motion.save, which "
        f"begins with '{TITLE}', got {text[:40].splitlines()[0]!r}"
    )


def _trajectories(records: list[Record], metres: float, path: Path) -> list[Trajectory]:
    scale = np.array([metres, metres, metres, 1, 1, 1])
    trajectories: list[Trajectory] = []
    lost, taken = [], set[str]()
    for record in records:
        seen = np.isfinite(record.poses).all(axis=(1, 2)) & np.isin(record.status, USABLE)
        if not seen.any():
            if len(record.times_s):
                lost.append(record.name)
            continue
        poses = record.poses.copy()
        poses[:, :3, 3] *= metres
        covariances = record.covariances
        if covariances is not None:
            covariances = covariances * scale[:, None] * scale
        label, n = record.name, 1
        while label in taken:
            n += 1
            label = f"{record.name}_{n}"
        taken.add(label)
        try:
            trajectories.append(
                Trajectory(record.times_s, poses, covariances, record.status, label, record.frame)
            )
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
    if not trajectories:
        raise ValueError(
            f"{path}: expected at least one pose, but "
            + (f"{', '.join(lost)}: lost in all frames" if lost else "there is none")
        )
    if lost:
        warnings.warn(f"{path}: left out, without any pose: {', '.join(lost)}", stacklevel=3)
    return trajectories


def read_result_folder(folder: Path, fps: float | None) -> list[Record]:
    """One record per object that the report has in any frame; where a frame does not have it, it is lost."""
    path = folder / "report.json"
    rows = read_results(folder)["frames"]
    with contents(path, "a report of sdftrack"):
        results = [result_of(row) for row in rows]
        # Objects may be added and removed while a camera runs: k numbers them, not their position in a frame.
        places = [{int(entry["k"]): i for i, entry in enumerate(row["objects"])} for row in rows]
        images = np.array([row["im_id"] for row in rows], np.float64)
        stamps = np.array([np.nan if r.timestamp is None else r.timestamp for r in results], np.float64)
        entries = {int(entry["k"]): entry for row in rows for entry in row["objects"]}
        names = {k: str(entry["name"]) for k, entry in sorted(entries.items())}
    if fps is not None or not np.isfinite(stamps).all():
        missing = int(np.count_nonzero(~np.isfinite(stamps)))
        why = f"{path}: {missing} of {len(rows)} frames have no timestamp"
        stamps = times_from_numbers(images, fps, why)
    records = []
    for k, name in names.items():
        poses, covariances = np.full((len(rows), 4, 4), np.nan), np.full((len(rows), 6, 6), np.nan)
        status = ["lost"] * len(rows)
        for i, (result, place) in enumerate(zip(results, places, strict=True)):
            if k in place:
                j = place[k]
                poses[i], covariances[i] = result.poses[j], result.motion_covariances[j]
                status[i] = str(result.status[j])
        records.append(Record(name, stamps, poses, status, covariances))
    return records
