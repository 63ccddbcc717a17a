# SPDX-License-Identifier: MIT
"""Recorded sequences by layout: one file per layout, which registers its detection and reader."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Any

from sdftrack._internal.text_files import in_order, named
from sdftrack.camera.files import warn_if_doubtful
from sdftrack.io.datasets.sequence import LAYOUTS, Layout, LazyModels, Sequence, register
from sdftrack.io.writers.base import Journal

__all__ = ["LAYOUTS", "Layout", "LazyModels", "Sequence", "open_sequence", "register"]

MAX_LISTED = 200  # of what lies in a folder, looked at for a sequence


def open_sequence(path: str | os.PathLike[str], layout: str = "auto", **options: Any) -> Sequence:
    """Open a recorded sequence; frames are read on access.

    Parameters
    ----------
    path : folder or file
        docs/data.md describes the layouts.
    layout : str
        "auto", or the name of a layout: "bop", "k1", "tum", "folders", "open3d", "lerobot", "realsense", "azure",
        "ros1", "ros2" or "mcap".
    **options
        Those of the layout; None counts as not given.

    Returns
    -------
    Sequence
        Depth in metres, poses T_cam_obj in metres, whatever the files' units. A frame that cannot be read, or has a
        different size, is returned as a Frame without images whose `error` gives the reason.

    Raises
    ------
    FileNotFoundError
        No such folder or file.
    ValueError
        Unknown layout, no depth, no camera, implausible units, or an option that the layout does not have.
    ImportError
        The layout needs an extra that is not installed.

    Warns
    -----
    UserWarning
        Intrinsics that are likely those of an image of another size (docs/data.md, Checks).
    """
    root = Path(path)
    if layout != "auto" and layout not in LAYOUTS:
        raise ValueError(f"layout: expected auto or one of {', '.join(LAYOUTS)}, got {layout!r}")
    if not root.exists():
        raise FileNotFoundError(f"{root}: no such folder or file")
    if Journal.is_in(root):
        raise ValueError(
            f"{root}: a recording that was interrupted; the command that wrote it finishes it with --resume"
        )
    with named(root):
        kind = _detected(root) if layout == "auto" else LAYOUTS[layout]
        known = root.is_dir() or kind.detect(root)
    if not known:
        raise ValueError(
            f"{root}: expected a recording of layout {kind.name} ({kind.marks}), got another file"
        )
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in kind.options:
            takes = ", ".join(kind.options) or "none"
            raise ValueError(f"{name}: not an option of layout {kind.name}, whose options are: {takes}")
    with named(root):
        sequence = kind.open(root, **given)
    warn_if_doubtful(sequence.camera, str(root))
    return sequence.can_be_opened_again(partial(open_sequence, layout=kind.name, **given), root.resolve())


def _detected(root: Path) -> Layout:
    for kind in LAYOUTS.values():
        if kind.detect(root):
            return kind
    known = "; ".join(f"{kind.name} ({kind.marks})" for kind in LAYOUTS.values())
    for inside in in_order(root.iterdir())[:MAX_LISTED] if root.is_dir() else []:
        for kind in LAYOUTS.values():
            if kind.detect(inside):
                raise ValueError(
                    f"{root}: not a sequence itself, but {inside} is one ({kind.name}): open that"
                )
    lens = (
        "" if not (root / "depth").is_dir() else "; depth/ is there: a cam_K.txt (3 x 3) beside it is enough"
    )
    raise ValueError(f"{root}: unknown layout{lens}; known are: {known}")


# The readers register themselves; the order is the order in which they are tried.
from sdftrack.io.datasets import bop, k1, tum, folders, lerobot, realsense, azure  # noqa: E402, F401, I001
from sdftrack.io.datasets.bags import opening  # noqa: E402, F401
