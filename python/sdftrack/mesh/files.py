# SPDX-License-Identifier: MIT
"""Mesh files and their units."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.text_files import reason

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
FORMATS = (".ply", ".obj", ".glb", ".stl")
HEADER_BYTES = 64 * 1024  # of a PLY, at most


def read_mesh(
    file: Path,
) -> tuple[NDArray[np.float64], NDArray[Any], NDArray[np.uint8] | None, NDArray[np.float32] | None]:
    """Vertices (V, 3) in the file's unit, faces (F, 3), and per-vertex colours and `seen` if present.

    FileNotFoundError; ValueError for a file that is not a mesh, is truncated, or has no triangle.
    """
    import trimesh

    if not file.is_file():
        raise FileNotFoundError(f"mesh: no such file: {file}")
    try:
        if file.suffix.lower() == ".ply":
            check_ply_is_whole(file)
        loaded: Any = trimesh.load(str(file), force="mesh", process=False)
        vertices, faces = np.asarray(loaded.vertices, np.float64), np.asarray(loaded.faces)
    except Exception as error:
        raise ValueError(
            f"mesh: cannot read {file}: {reason(error)}; expected one of {', '.join(FORMATS)}"
        ) from error
    if len(faces) == 0:
        raise ValueError(f"mesh: {file} has no triangles ({len(vertices)} vertices); is it a point cloud?")
    return vertices, faces, vertex_colors(loaded), _vertex_seen(loaded)


def unit_scale(unit: str | None) -> float:
    """Metres per unit; None means metres."""
    if unit is None:
        return 1.0
    if unit not in UNITS:
        raise ValueError(f"unit: expected None or one of {', '.join(map(repr, UNITS))}, got {unit!r}")
    return UNITS[unit]


def vertex_colors(loaded: Any) -> NDArray[np.uint8] | None:
    """(V, 3) uint8 vertex colours read by trimesh; a texture is sampled at the vertices."""
    visual = getattr(loaded, "visual", None)
    try:
        if visual is None:
            return None
        if visual.kind == "texture":
            visual = visual.to_color()
        if visual.kind != "vertex":
            return None
        colors = np.asarray(visual.vertex_colors)
    except Exception:  # a texture image that is missing or broken: the shape is still good
        return None
    if colors.ndim != 2 or len(colors) != len(loaded.vertices):
        return None
    return np.ascontiguousarray(colors[:, :3], dtype=np.uint8)


def _vertex_seen(loaded: Any) -> NDArray[np.float32] | None:
    attributes = getattr(loaded, "vertex_attributes", {})
    seen = attributes.get("seen", attributes.get("_seen"))  # glTF wants names of one's own to begin so
    if seen is None:
        rows = loaded.metadata.get("_ply_raw", {}).get("vertex", {}).get("data")
        names = getattr(getattr(rows, "dtype", None), "names", None) or ()
        seen = rows["seen"] if "seen" in names else None
    if seen is None or np.size(seen) != len(loaded.vertices):
        return None
    return np.asarray(seen, np.float32).reshape(-1)  # a column, where it is of a .glb


def check_ply_is_whole(file: Path) -> None:
    """ValueError if an ASCII PLY has fewer lines than its header states: the reader would accept it."""
    with open(file, "rb") as stream:
        head = stream.read(HEADER_BYTES)
        end = re.search(rb"end_header[ \t]*\r?\n?", head)
        if not head.startswith(b"ply") or end is None or not re.search(rb"^format\s+ascii", head, re.M):
            return
        counts = [int(n) for n in re.findall(rb"^element\s+\S+\s+(\d+)", head[: end.start()], re.M)]
        stream.seek(end.end())
        lines = sum(1 for line in stream if line.strip())
    if lines < sum(counts):
        raise ValueError(f"truncated: its header states {sum(counts)} lines of data, found {lines}")
