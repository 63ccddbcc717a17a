# SPDX-License-Identifier: MIT
"""Trajectories in text files of one pose per line: TUM's, and BOP's results."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np

from sdftrack._internal.validation import shown
from sdftrack.io.report_file import BOP_HEADER
from sdftrack.io.trajectories import read_tum_rows
from sdftrack.motion.files.record import (
    Array,
    Record,
    gaps_as_lost,
    matrices_as_poses,
    quaternions_as_poses,
    times_from_numbers,
)

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
