# SPDX-License-Identifier: MIT
"""Whether a motion leaves a shape as it is, point by point."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.sdf import sample


def distance_from_itself(sdf: Any, S: NDArray[np.float64], points: int = 200) -> float:
    """The 95 % quantile of |phi(S p)| over points p of the surface (m); about 0 for a symmetry S."""
    p = sdf.surface_samples(points)[0].astype(np.float64) @ S[:3, :3].T + S[:3, 3]
    return float(np.quantile([abs(sample(sdf.values, sdf.voxel_size, sdf.origin, x)[0]) for x in p], 0.95))
