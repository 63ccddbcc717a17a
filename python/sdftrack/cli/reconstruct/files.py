# SPDX-License-Identifier: MIT
"""Output of ``sdftrack reconstruct`` in addition to that of ``track``: shape, mesh, and images of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.cli.progress import Tell

__all__ = ["write_mesh_files", "write_refined", "write_shape", "write_sides", "write_turntable"]

TURN_PICTURES, TURN_FPS = 90, 30.0


def write_mesh_files(
    out: Path, mesh: Any, colors_from: Any, formats: list[str], texture: int | None
) -> list[str]:
    """Write mesh.ply and the other formats; returns their names. Existing files are replaced atomically.

    `texture`: side of a texture, in texels, with the colours of `colors_from`; ignored for .stl and meshes without
    colours.
    """
    from sdftrack.mesh.writing import TEXTURE_FORMATS, files_beside

    names = []
    for suffix in dict.fromkeys(["ply", *formats]):
        name = f"mesh.{suffix}"
        if texture is None or f".{suffix}" not in TEXTURE_FORMATS or mesh.colors is None:
            mesh.save(out / name)
        else:
            mesh.save(out / name, texture=texture, colors_from=colors_from)
            names += files_beside(name)
        names.append(name)
    return list(dict.fromkeys(names))


def write_shape(out: Path, shape: Any) -> list[str]:
    """shape.npz; its name."""
    shape.cropped().save(out / "shape.npz")
    return ["shape.npz"]


def write_sides(out: Path, mesh: Any, T: NDArray[np.float64], threads: int, min_seen: float) -> list[str]:
    """Write mesh.png; returns its name. `T`: T_cam_obj of the first image; `min_seen`: minimum of an observed
    vertex."""
    from sdftrack.viz.pictures import save_picture
    from sdftrack.viz.turntable import four_sides

    save_picture(out / "mesh.png", four_sides(mesh, T, threads=threads, min_seen=min_seen))
    return ["mesh.png"]


def write_turntable(
    out: Path, mesh: Any, T: NDArray[np.float64], threads: int, min_seen: float, tell: Tell
) -> list[str]:
    """Write turntable.mp4, which starts with the view of mesh.png; returns its name."""
    from sdftrack.io.video import write_video
    from sdftrack.viz.turntable import turning

    def told() -> Iterator[NDArray[np.uint8]]:
        for n, picture in enumerate(turning(mesh, T, TURN_PICTURES, threads=threads, min_seen=min_seen), 1):
            yield picture
            tell(n, TURN_PICTURES, "turntable.mp4")

    write_video(out / "turntable.mp4", told(), TURN_FPS)
    return ["turntable.mp4"]


def write_refined(out: Path, poses: dict[int, Any], times: list[float]) -> list[str]:
    """Write refined_0.txt: the poses of the refined mesh, in the format of trajectory_0.txt."""
    from sdftrack._internal.files import write_text
    from sdftrack.recorder import tum_row

    rows = [tum_row(times[n], T) for n, T in sorted(poses.items())]
    write_text(out / "refined_0.txt", "\n".join(rows) + "\n")
    return ["refined_0.txt"]
