# SPDX-License-Identifier: MIT
"""`load`: trajectories of any file that is known."""

from __future__ import annotations

import csv
import io
import math
import os
import warnings
from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np

from sdftrack._internal.text_files import contents, decoded
from sdftrack._internal.validation import number, shown
from sdftrack.io.report_file import BOP_HEADER, read_results, read_tum_rows, result_of
from sdftrack.motion.files.c3d import read_c3d
from sdftrack.motion.files.table import (
    TITLE,
    Array,
    Record,
    gaps_as_lost,
    matrices_as_poses,
    quaternions_as_poses,
    read_table,
    times_from_numbers,
)
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
        text = decoded(path.read_bytes())  # line breaks as they are: names may have some
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


# -- Text files of one pose per line: TUM's, and BOP's results


Key = tuple[int, int]  # scene_id, obj_id
Row = tuple[int, Array]  # line, pose
MAX_IMAGES = 1_000_000  # 9 hours at 30 Hz; more are timestamps in place of numbers


def read_tum_file(path: Path, fps: float | None) -> list[Record]:
    """``timestamp tx ty tz qx qy qz qw``: one object, named after the file."""
    lines, rows = read_tum_rows(path)
    times = rows[:, 0] if fps is None else np.arange(len(rows)) / fps
    poses = quaternions_as_poses(rows[:, 1:4], rows[:, 4:], lambda i: f"{path}, line {lines[i]}")
    return [Record(path.stem, times, poses, gaps_as_lost(poses))]


def read_bop(path: Path, text: str, fps: float | None) -> list[Record]:
    """One record per object of a scene and instance, t in millimetres; images without the object are gaps."""
    objects = _bop_rows(path, text)
    records = []
    scenes = {scene for scene, _ in objects}
    for (scene, obj_id), images in sorted(objects.items()):
        # Images of the whole scene, since another object may be seen where this one is lost.
        seen = sorted({im for key, rows in objects.items() if key[0] == scene for im in rows})
        step = math.gcd(*np.diff(seen).tolist()) or 1
        numbers = range(seen[0], seen[-1] + 1, step)
        if len(numbers) > MAX_IMAGES:
            raise ValueError(
                f"{path}: expected images numbered one after the other, got numbers from {seen[0]} to {seen[-1]} "
                f"for {len(seen)} images"
            )
        times = times_from_numbers(
            numbers, fps, f"{path}: BOP results number their images and have no timestamps"
        )
        name = f"object_{obj_id}" if len(scenes) == 1 else f"scene_{scene}_object_{obj_id}"
        count = check_order(images, f"{path}: obj_id {obj_id}")
        for k in range(count):
            poses = np.full((len(numbers), 4, 4), np.nan)
            for im, rows in images.items():
                poses[(im - seen[0]) // step] = rows[k][1]
            label = name if count == 1 else f"{name}_{k + 1}"
            records.append(Record(label, times, poses, gaps_as_lost(poses)))
    return records


def _bop_rows(path: Path, text: str) -> dict[Key, dict[int, list[Row]]]:
    """Rows of each object by image, in the order of the file."""
    reader = csv.DictReader(io.StringIO(text, newline=""))
    numbers: list[tuple[int, int, int]] = []
    matrices: list[Array] = []
    lines: list[int] = []
    for row in reader:
        try:
            R, t = ([float(v) for v in (row[name] or "").split()] for name in ("R", "t"))
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = np.reshape(R, (3, 3)), np.reshape(t, 3)
            numbers.append((int(row["scene_id"]), int(row["obj_id"]), int(row["im_id"])))
        except (TypeError, ValueError, KeyError, OverflowError):
            raise ValueError(
                f"{path}, line {reader.line_num}: expected '{BOP_HEADER}' with 9 numbers R and 3 numbers t, "
                f"got {shown(','.join(str(v) for v in row.values()))}"
            ) from None
        matrices.append(T)
        lines.append(reader.line_num)
    poses = matrices_as_poses(np.array(matrices).reshape(-1, 4, 4), lambda i: f"{path}, line {lines[i]}, R")
    objects: dict[Key, dict[int, list[Row]]] = {}
    for (scene, obj_id, im_id), line, pose in zip(numbers, lines, poses, strict=True):
        objects.setdefault((scene, obj_id), {}).setdefault(im_id, []).append((line, pose))
    return objects


def check_order(images: Mapping[int, Sequence[tuple[int, Array]]], what: str) -> int:
    """Number of instances of one object, if their order in the file can be that of one each; `images`: rows by image.

    ValueError if an image has fewer rows than another, as the order does not tell which instance is missing, or if two
    instances have exchanged their places: between two images, both would have moved less together if they were
    exchanged.
    """
    counts = {len(rows) for rows in images.values()}
    advice = "read the result folder, which names the instances, or one instance per obj_id"
    if len(counts) > 1:
        fewest = min(images, key=lambda im: len(images[im]))
        raise ValueError(
            f"{what}: expected as many rows in every image, but image {fewest} has {len(images[fewest])} and another "
            f"{max(counts)}, and the order does not tell which instance is missing; {advice}"
        )
    count = counts.pop()
    for before, after in pairwise(sorted(images)):
        for a, b in combinations(range(count), 2):
            was, now = (np.array([images[im][k][1][:3, 3] for k in (a, b)]) for im in (before, after))
            straight, crossed = (
                np.linalg.norm(now - was, axis=1).sum(),
                np.linalg.norm(now[::-1] - was, axis=1).sum(),
            )
            if crossed < straight:
                raise ValueError(
                    f"{what}: expected the instances in the same order in every image, but rows {a + 1} and {b + 1} "
                    f"exchange their places between images {before} and {after}; {advice}"
                )
    return count
