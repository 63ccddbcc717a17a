# SPDX-License-Identifier: MIT
"""Trajectory files: TUM's text lines and Redwood's log."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.files import write_text

__all__ = ["quaternion", "read_log", "read_tum", "rotation", "write_log", "write_tum"]

Array = NDArray[np.float64]


def quaternion(R: ArrayLike) -> Array:
    """(x, y, z, w) of a (3, 3) rotation, w >= 0 (Bar-Itzhack: the dominant eigenvector, good for any angle)."""
    R = np.asarray(R, np.float64)
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
            [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
            [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]],
        ]
    )
    q: Array = np.linalg.eigh(K)[1][:, -1]  # reads the lower triangle
    return q if q[3] >= 0 else -q


def rotation(q: ArrayLike) -> Array:
    """(3, 3) rotation of a quaternion (x, y, z, w) of any length but 0."""
    x, y, z, w = np.asarray(q, dtype=np.float64)
    n = x * x + y * y + z * z + w * w
    if not (np.isfinite(n) and n > 0):
        raise ValueError(
            f"q: expected a quaternion (x, y, z, w) that is finite and not 0, got {[x, y, z, w]}"
        )
    s = 2 / n
    return np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )


def write_tum(path: str | os.PathLike[str], timestamps: Sequence[float], poses: ArrayLike) -> None:
    """Lines `timestamp tx ty tz qx qy qz qw` (s, m), completely or not at all."""
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for time, T in zip(timestamps, np.asarray(poses, dtype=np.float64).reshape(-1, 4, 4), strict=True):
        numbers = [*T[:3, 3], *quaternion(T[:3, :3])]
        lines.append(f"{time:.6f} " + " ".join(f"{v:.9g}" for v in numbers))
    write_text(path, "\n".join(lines) + "\n")


def read_tum(path: str | os.PathLike[str]) -> tuple[Array, Array]:
    """Timestamps (N,) in seconds and poses (N, 4, 4) of a TUM trajectory file."""
    rows = []
    for number, line in enumerate(Path(path).read_text(encoding="utf-8").splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            row = [float(v) for v in line.replace(",", " ").split()]
        except ValueError:
            row = []
        if len(row) != 8:
            raise ValueError(
                f"{path}, line {number}: expected 'timestamp tx ty tz qx qy qz qw', got {line!r}"
            )
        rows.append(row)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    for T, row in zip(poses, rows, strict=True):
        T[:3, :3], T[:3, 3] = rotation(row[4:]), row[1:4]
    return np.array([row[0] for row in rows]), poses


def write_log(path: str | os.PathLike[str], numbers: Sequence[int], poses: ArrayLike) -> None:
    """Redwood's trajectory log: a line of three integers, then the 4 x 4 matrix, m."""
    lines = []
    for i, T in zip(numbers, np.asarray(poses, dtype=np.float64).reshape(-1, 4, 4), strict=True):
        lines.append(f"{i} {i} {i + 1}")
        lines += [" ".join(f"{v:.12g}" for v in row) for row in T]
    write_text(path, "\n".join(lines) + "\n")


def read_log(path: str | os.PathLike[str]) -> dict[int, Array]:
    """Poses of a Redwood trajectory log, by the first integer of their header line."""
    lines = [s for s in Path(path).read_text(encoding="utf-8").splitlines() if s.strip()]
    try:
        blocks = [lines[i : i + 5] for i in range(0, len(lines), 5)]
        return {
            int(block[0].split()[0]): np.array(
                [[float(v) for v in row.split()] for row in block[1:]], dtype=np.float64
            ).reshape(4, 4)
            for block in blocks
        }
    except (ValueError, IndexError):
        raise ValueError(f"{path}: expected blocks of 'i i n' and four rows of four numbers") from None
