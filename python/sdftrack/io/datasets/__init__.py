# SPDX-License-Identifier: MIT
"""Recorded sequences by layout: one file per layout, which registers its detection and reader."""

from __future__ import annotations

import os
from pathlib import Path

from sdftrack.io.datasets.layouts import LAYOUTS, Layout, register
from sdftrack.io.datasets.sequence import LazyModels, Sequence

__all__ = ["LAYOUTS", "Layout", "LazyModels", "Sequence", "open_sequence", "register"]


def open_sequence(path: str | os.PathLike[str], layout: str = "auto") -> Sequence:
    """Open a recorded sequence; frames are read on access.

    Parameters
    ----------
    path : folder
        docs/data.md describes the layouts.
    layout : "auto", "bop", "tum", "open3d", "k1" or "folders"

    Returns
    -------
    Sequence
        Depth in metres, poses T_cam_obj in metres, whatever the files' units. A frame that cannot be read, or has a
        different size, is returned as a Frame without images whose `error` gives the reason.

    Raises
    ------
    FileNotFoundError
        No such folder.
    ValueError
        Unknown layout, no depth, no camera, or implausible units.
    """
    root = Path(path)
    known = "; ".join(f"{k.name} ({k.marks})" for k in LAYOUTS.values())
    if not root.exists():
        raise FileNotFoundError(f"{root}: no such folder")
    if layout != "auto":
        if layout not in LAYOUTS:
            raise ValueError(f"layout: expected auto or one of {', '.join(LAYOUTS)}, got {layout!r}")
        if not root.is_dir():
            raise ValueError(f"{root}: expected a folder of layout {layout}, got a file")
        return LAYOUTS[layout].open(root)
    if root.is_dir():
        for kind in LAYOUTS.values():
            if kind.detect(root):
                return kind.open(root)
        inside = [p for p in sorted(root.iterdir())[:200] if p.is_dir()]
        for folder in inside:
            for kind in LAYOUTS.values():
                if kind.detect(folder):
                    raise ValueError(
                        f"{root}: not a sequence itself, but {folder} is one ({kind.name}): open that"
                    )
    else:
        raise ValueError(f"{root}: unknown layout, it is a file; known are folders: {known}")
    raise ValueError(f"{root}: unknown layout; known are: {known}")


# The readers register themselves; the order is the order in which they are tried.
from sdftrack.io.datasets import bop, k1, tum, folders, open3d  # noqa: E402, F401, I001
