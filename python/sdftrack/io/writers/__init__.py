# SPDX-License-Identifier: MIT
"""Sequences written frame by frame, one file per layout; docs/data.md describes the layouts."""

from sdftrack.io.writers.base import Contents, LayoutWriter
from sdftrack.io.writers.bop import BopWriter
from sdftrack.io.writers.mcap import McapWriter
from sdftrack.io.writers.open3d import Open3DWriter
from sdftrack.io.writers.tum import TumWriter

__all__ = ["WRITERS", "Contents", "LayoutWriter"]

WRITERS: dict[str, type[LayoutWriter]] = {
    kind.name: kind for kind in (BopWriter, TumWriter, Open3DWriter, McapWriter)
}
