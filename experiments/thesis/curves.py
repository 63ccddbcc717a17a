# SPDX-License-Identifier: MIT
"""Curves used by several figures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["rotation_vectors"]

Array = NDArray[np.float64]


def rotation_vectors(poses: Array) -> Array:
    """Rotation relative to the first frame, rad, made continuous."""
    from sdftrack import _core

    out: list[Array] = []
    for T in poses:
        relative = np.eye(4)
        relative[:3, :3] = poses[0, :3, :3].T @ T[:3, :3]
        w = np.array(_core.rotation_log(relative))
        if out:  # of the vectors that mean the same turn, the one nearest to the last frame's
            angle = np.linalg.norm(w)
            axis = w / angle if angle > 1e-9 else np.zeros(3)
            choices = [w + 2 * np.pi * m * axis for m in (-2, -1, 0, 1, 2)]
            w = min(choices, key=lambda c: float(np.linalg.norm(c - out[-1])))
        out.append(w)
    return np.array(out)
