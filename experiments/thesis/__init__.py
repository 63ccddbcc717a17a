# SPDX-License-Identifier: MIT
"""Reproduction of figures and tables of the thesis: one module each, with the printed values for comparison."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = ["FIGURES", "Context", "Figure", "find"]


@dataclass(frozen=True)
class Figure:
    """An experiment that can be reproduced."""

    id: str
    title: str
    module: str

    def run(self, context: Context) -> dict[str, Any]:
        """Run it; returns the numbers for result.json. Files are written into ``context.out``."""
        made: dict[str, Any] = importlib.import_module(f"experiments.thesis.{self.module}").run(context)
        return made


@dataclass(frozen=True)
class Context:
    """Settings of a figure.

    Attributes
    ----------
    out : Path
        An existing output folder for the figure.
    mesh : Path or None
        A mesh to use instead of the built-in shape.
    frames : int or None
        Number of frames, e.g. fewer for a quick test; None: as stated by the figure.
    options : dict
        Keyword arguments for `Tracker`.
    step : callable (done, total, label)
        Progress callback.
    unit : str or None
        Unit of the mesh; None: metres.
    """

    out: Path
    mesh: Path | None
    frames: int | None
    options: dict[str, Any]
    step: Callable[[int, int, str], None]
    unit: str | None = None


FIGURES = {
    f.id: f
    for f in [
        Figure("3.9", "time per frame against the number of pixels, CPU and GPU", "speed_3_9"),
        Figure("3.10", "depth-only tracking of a virtual object at four noise levels", "fig_3_10"),
        Figure(
            "3.12", "intrinsics over the number of frames of a known object, four noise levels", "fig_3_12"
        ),
        Figure("3.13", "Table 3.1: intrinsics judged by the angles of three planes", "fig_3_13"),
        Figure("3.15", "a ground plane: patch fitted, extended, taken out", "fig_3_15"),
        Figure("4.6", "time of the parts of a reconstruction, and the curves of 4.6 to 4.8", "speed_4_6"),
        Figure("4.13a", "RGB-D tracking of a known, textured object", "fig_4_13a"),
        Figure("4.13b", "an unknown object tracked and reconstructed, from a ball", "fig_4_13b"),
        Figure("4.14", "surface error of a reconstruction for five reaches of the evidence", "fig_4_14"),
        Figure("4.16", "a camera carried around an object, by the object and by the whole scene", "fig_4_16"),
        Figure("5.4", "time per frame against the number of objects", "fig_5_4"),
        Figure("5.6", "two look-alikes that meet and part, joint and independent trackers", "fig_5_6"),
        Figure("5.8", "relative pose of two look-alikes at rest, moving camera", "fig_5_8"),
        Figure("6.3", "silhouettes from their first harmonics", "fig_6_3"),
        Figure("6.6", "a contour tracked behind a bar, with a shape memory and without", "fig_6_6"),
        Figure("6.7", "the same for a hand", "fig_6_7"),
        Figure("6.8", "what the regression of harmonics cannot recover: a fence, no details", "fig_6_8"),
        Figure("6.9", "hidden silhouettes recovered, by how many harmonics are the inputs", "fig_6_9"),
        Figure("6.10", "hidden silhouettes detected: precision and recall", "fig_6_10"),
        Figure("6.11", "recovery and time against simpler ways (and Table 6.4)", "fig_6_11"),
        Figure("A.2", "times of superpixels at three sizes of image", "table_a_2"),
        Figure("A.3", "times of their parts: k-means, connectivity", "table_a_3"),
    ]
}


def find(name: str) -> Figure:
    """The figure with that id; ValueError lists the available ones."""
    if name not in FIGURES:
        raise ValueError(f"figure: expected one of {', '.join(FIGURES)}, got {name!r} (see --list)")
    return FIGURES[name]
