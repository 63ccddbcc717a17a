# SPDX-License-Identifier: MIT
"""The volume of a reconstruction: its limits, and a copy of its shape."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdftrack.sdf import SDF

MAX_VOXELS = 512
BYTES_PER_VOXEL = 20


def shape_of(core: Any, least: int) -> SDF:
    """A copy of the current distances and colours; colours observed less than `least` are omitted."""
    rgb_seen = core.rgb_seen.reshape(-1, 4)
    seen = np.flatnonzero(rgb_seen[:, 3] >= least)
    colors = None
    if rgb_seen[seen, :3].any():
        colors = np.zeros(rgb_seen.shape, np.uint8)
        colors[seen, :3] = (rgb_seen[seen, :3] + 128) >> 8
        colors[seen, 3] = 255
        colors = colors.reshape(core.rgb_seen.shape)
    return SDF(np.array(core.phi), core.voxel_m, core.origin, colors)
