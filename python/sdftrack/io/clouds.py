# SPDX-License-Identifier: MIT
"""Point cloud files: PLY, OBJ, STL, text and numpy formats."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.saved_file import read_array
from sdftrack._internal.text_files import read_text
from sdftrack.mesh.files import check_ply_is_whole

FORMATS = (".ply", ".obj", ".stl", ".xyz", ".npy")


def read_cloud(file: Path) -> NDArray[Any]:
    """Read points (N, 3) in the file's unit, from one of `FORMATS`. FileNotFoundError; ValueError naming a file that is
    empty, truncated or not a point cloud."""
    if not file.is_file():
        raise FileNotFoundError(f"{file}: no such file")
    try:
        if file.suffix.lower() == ".npy":
            with file.open("rb") as opened:
                points = read_array(opened, file.stat().st_size)
        elif file.suffix.lower() == ".xyz":
            points = _read_text(file)
        else:
            points = _read_vertices(file)
    except FileNotFoundError:
        raise
    except Exception as error:
        raise ValueError(f"{file}: not a readable point cloud ({' '.join(str(error).split())})") from None
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{file}: expected points x, y, z of shape (N, 3), got {points.shape}")
    if points.dtype.kind not in "iuf":
        raise ValueError(f"{file}: expected points of numbers, got {points.dtype}")
    if not len(points):
        raise ValueError(f"{file}: expected points, got none")
    return points


def _read_text(file: Path) -> NDArray[np.float64]:
    rows: list[list[float]] = []
    for i, line in enumerate(read_text(file).splitlines(), 1):
        words = re.split(r"[\s,;]+", line.split("#")[0].strip())
        if words == [""]:
            continue
        if len(words) < 3:
            raise ValueError(f"line {i}: expected x y z, got {line.strip()[:60]!r}")
        try:
            rows.append([float(word) for word in words[:3]])
        except ValueError:
            raise ValueError(f"line {i}: expected x y z, got {line.strip()[:60]!r}") from None
    return np.array(rows, np.float64).reshape(-1, 3)


def _read_vertices(file: Path) -> NDArray[np.float64]:
    import trimesh

    if file.suffix.lower() == ".ply":
        check_ply_is_whole(file)
    loaded: Any = trimesh.load(file, process=False)
    if isinstance(loaded, trimesh.Scene):
        loaded = loaded.to_geometry() if loaded.geometry else None
    return np.asarray(getattr(loaded, "vertices", np.zeros((0, 3))), np.float64)
