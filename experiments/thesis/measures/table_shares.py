# SPDX-License-Identifier: MIT
"""Which shares of a labelled scene a plane takes out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.synth.table_scene import TableScene

__all__ = ["STANDS_OUT_M", "removed"]

STANDS_OUT_M = 0.010
Mask = NDArray[np.bool_]


def removed(scene: TableScene, off_plane: Mask) -> dict[str, float]:
    """Shares (%) that are not in the mask: of the table, of object points that stand out, of all object points."""
    high = scene.objects & (scene.height_m > STANDS_OUT_M)
    return {
        name: 100 * float((~off_plane[where]).mean())
        for name, where in (("table", scene.table), ("high", high), ("objects", scene.objects))
    }
