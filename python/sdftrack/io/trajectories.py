# SPDX-License-Identifier: MIT
"""Trajectory files: TUM's text lines and Redwood's log."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import quaternion, rotation
from sdftrack._internal.text_files import contents, named, read_text
from sdftrack._internal.validation import shown

TUM_HEADER = "# timestamp tx ty tz qx qy qz qw"

Array = NDArray[np.float64]


def tum_line(time_s: float, T: Array, digits: str = ".12g") -> str:
    """``timestamp tx ty tz qx qy qz qw`` (s, m) of a (4, 4) pose; `digits`: format of the numbers."""
    numbers = [*T[:3, 3], *quaternion(T[:3, :3])]
    return f"{time_s:.6f} " + " ".join(f"{v:{digits}}" for v in numbers)


def read_tum_rows(path: str | os.PathLike[str]) -> tuple[list[int], Array]:
    """Line numbers, from 1, and the (N, 8) numbers `timestamp tx ty tz qx qy qz qw` of a TUM file, as they are."""
    lines, rows = [], []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            row = [float(v) for v in line.replace(",", " ").split()]
        except ValueError:
            row = []
        if len(row) != 8:
            raise ValueError(
                f"{path}, line {number}: expected 'timestamp tx ty tz qx qy qz qw', got {shown(line)}"
            )
        lines.append(number)
        rows.append(row)
    return lines, np.array(rows, np.float64).reshape(-1, 8)


def read_tum(path: str | os.PathLike[str]) -> tuple[Array, Array]:
    """Timestamps (N,) in seconds and poses (N, 4, 4) of a TUM trajectory file."""
    lines, rows = read_tum_rows(path)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    for T, row, line in zip(poses, rows, lines, strict=True):
        with named(f"{os.fspath(path)}, line {line}"):
            T[:3, :3], T[:3, 3] = rotation(row[4:]), row[1:4]
    return rows[:, 0], poses


def log_lines(number: int, T: Array) -> list[str]:
    """Redwood's block of one (4, 4) pose: a line of three integers, then the matrix, m."""
    return [f"{number} {number} {number + 1}", *(" ".join(f"{v:.15g}" for v in row) for row in T)]


def read_log(path: str | os.PathLike[str]) -> dict[int, Array]:
    """Poses of a Redwood trajectory log, by the first integer of their header line."""
    lines = [s for s in read_text(path).splitlines() if s.strip()]
    with contents(path, "blocks of 'i i n' and four rows of four numbers"):
        blocks = [lines[i : i + 5] for i in range(0, len(lines), 5)]
        return {
            int(block[0].split()[0]): np.array(
                [[float(v) for v in row.split()] for row in block[1:]], dtype=np.float64
            ).reshape(4, 4)
            for block in blocks
        }
