# SPDX-License-Identifier: MIT
"""Sample frames of a sequence with known poses: the set-up of a figure, as the thesis shows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.pictures import around, images
from experiments.table import Table
from sdftrack.viz.overlay import backdrop, depth_picture

COLUMNS = 6


def evenly(frames: int, columns: int = COLUMNS, first: int = 0) -> list[int]:
    """Numbers of so many frames from `first` to the last one."""
    return [int(i) for i in np.linspace(first, frames - 1, columns)]


def sample_frames(
    title: str,
    seq: Any,
    shown: Sequence[int],
    half_m: float,
    more: Mapping[str, Callable[[int], float]] | None = None,
    above: Mapping[str, Sequence[tuple[str, NDArray[np.uint8]]]] | None = None,
) -> Table:
    """Frames of a sequence around its objects, in colour, where there is any, and in depth.

    Parameters
    ----------
    half_m
        half of the side of the square that is shown, m
    more
        numbers of a frame by the heading of their column
    above
        rows of pictures above these
    """
    lens, rows = seq.camera.depth, []
    pictures: dict[str, list[tuple[str, Any]]] = {name: list(row) for name, row in (above or {}).items()}
    for i in shown:
        frame, places = seq[i], np.array([T[:3, 3] for T in seq.ground_truth[i].values()])
        middle = places.mean(axis=0)
        kinds = {} if frame.color is None else {"colour": backdrop(frame, seq.camera)}
        for name, picture in {**kinds, "depth": depth_picture(np.asarray(frame.depth))}.items():
            part = around(picture, middle, lens, half_m)
            pictures.setdefault(name, []).append((f"frame {i}" * (name == next(iter(kinds), "depth")), part))
        pixels = sum(int(np.count_nonzero(mask)) for mask in seq.masks(i).values())
        row = {"frame": i, "mm": 1e3 * float(np.linalg.norm(middle)), "pixels": pixels}
        rows.append({**row, **{name: value(i) for name, value in (more or {}).items()}})
    columns = {"frame": "frame:d", "away mm": "mm:.0f", "pixels": "pixels:d"}
    columns |= {name: f"{name}:.1f" for name in more or {}}
    return Table.of(title, columns, rows, picture=lambda: images(pictures, 1.9))
