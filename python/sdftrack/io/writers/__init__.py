# SPDX-License-Identifier: MIT
"""Sequences written frame by frame, one file per layout; docs/data.md describes the layouts."""

from __future__ import annotations

import os
import warnings

from sdftrack._internal.files import replacing_folder
from sdftrack._internal.validation import of_kind
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.io.writers.base import Contents, LayoutWriter
from sdftrack.io.writers.bop import BopWriter
from sdftrack.io.writers.mcap import McapWriter
from sdftrack.io.writers.one_object import Open3DWriter, TumWriter

__all__ = ["WRITERS", "Contents", "LayoutWriter", "save_sequence"]

WRITERS: dict[str, type[LayoutWriter]] = {
    kind.name: kind for kind in (BopWriter, TumWriter, Open3DWriter, McapWriter)
}


def save_sequence(
    path: str | os.PathLike[str], seq: Sequence, layout: str = "bop", *, color: str = "png"
) -> None:
    """Write `seq` into the new or empty folder `path`, completely or not at all.

    Parameters
    ----------
    path : folder
    seq : Sequence
    layout : "bop", "tum", "open3d" or "mcap"
        bop: every pose, mask and model; depth in the unit that represents it exactly, else in 0.1 mm (in 1 mm beyond
        6.5 m). tum: one object, depth in 0.2 mm up to 13.1 m. open3d: one object, depth in 1 mm up to 65.5 m. Depth
        that a sensor delivers in millimetres is exact in all of them. mcap (extra ``bags``): a ROS 2 recording with
        both cameras, poses and models; any depth is exact. An unreadable frame has no images in bop and is
        omitted in the others. Colour that is not aligned to depth is omitted by the first three, with a
        UserWarning, because they cannot store the mapping; mcap stores the images, but of a projective mapping only
        those, with a UserWarning.
    color : "png", "jpg" or "video"
        Files of the colour images; only png is exact. video (not in mcap): ``color.mkv``, H.264, read by this package;
        other programs find the depth images alone.

    Raises
    ------
    FileExistsError
        The folder is not empty.
    ValueError
        Something that the layout cannot represent: lens distortion (bop, open3d), changing cameras or several objects
        (tum, open3d), depth beyond its range.
    """
    of_kind(seq, Sequence, "seq")
    if layout not in WRITERS:
        raise ValueError(f"layout: expected one of {', '.join(WRITERS)}, got {layout!r}")
    lost = WRITERS[layout].lost_of_color(seq.camera)
    if lost:
        warnings.warn(f"{path}: {lost}", stacklevel=2)
    contents = Contents(seq.camera, seq.objects, seq.models)
    with replacing_folder(path) as folder, WRITERS[layout](folder, contents, color) as writer:
        for i, frame in enumerate(seq):
            writer.add(frame, seq.ground_truth.get(i), seq.masks(i), seq.ids[i])
        writer.finish()
