# SPDX-License-Identifier: MIT
"""Errors of fitted primitives against the rendered solids."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from experiments.synth.solids import SolidScene
from sdftrack.primitives import PrimitiveFit

Array = NDArray[np.float64]
ALIKE = 0.1  # two radii of an ellipsoid that differ by less have no directions of their own


@dataclass(frozen=True)
class Error:
    """Errors of one fit: the largest relative error of a length, and the angle (deg; nan: no axis) to the true axes.

    `size_sd` and `axis_sd_deg`: the largest standard deviations stated by the fit.
    """

    size: float
    axis_deg: float
    size_sd: float
    axis_sd_deg: float


def measure(fit: PrimitiveFit, scene: SolidScene) -> Error:
    """Errors of a fit of the correct kind; the axes of a box or ellipsoid may be in any order."""
    found, true = np.array(list(fit.size.values())), np.array(list(scene.size.values()))
    size_sd = float((np.sqrt(np.diag(fit.covariance)[6:]) / found).max())
    R = fit.T_cam_obj[:3, :3].T @ scene.T_cam_obj[:3, :3]
    if scene.kind in ("box", "ellipsoid"):
        order = max(permutations(range(3)), key=lambda p: sum(abs(R[p[j], j]) for j in range(3)))
        found = found[list(order)]
        own = [j for j in range(3) if scene.kind == "box" or is_own(true, j)]
        angles = [angle_deg(abs(R[order[j], j])) for j in own]
        sds = [_axis_sd(fit, order[j]) for j in own]
    elif scene.kind == "sphere":
        angles, sds = [], []
    else:
        angles = [angle_deg(R[2, 2] if scene.kind == "cone" else abs(R[2, 2]))]
        sds = [_axis_sd(fit, 2)]
    nan = float("nan")
    worst = float(np.abs(found / true - 1).max())
    return Error(worst, max(angles, default=nan), size_sd, max(sds, default=nan))


def is_own(radii: Array, j: int) -> bool:
    """Whether an ellipsoid's radius differs from both others: the axes of a circle are arbitrary."""
    return min(abs(np.log(radii[j] / radii[k])) for k in range(3) if k != j) > ALIKE


def _axis_sd(fit: PrimitiveFit, axis: int) -> float:
    """Stated sd (deg) of the direction of an axis, ignoring rotation about itself."""
    a = fit.T_cam_obj[:3, axis]
    across = np.eye(3) - np.outer(a, a)
    return float(np.degrees(np.sqrt(np.trace(across @ fit.covariance[3:6, 3:6] @ across))))


def angle_deg(cosine: float) -> float:
    """Angle of a cosine, which may exceed one due to rounding."""
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def measure_patch(fit: PrimitiveFit, scene: SolidScene) -> tuple[Array, Array, float]:
    """Relative errors of width and height, the errors over their stated deviations, angle of the normal (deg).

    The sides may be in either order.
    """
    R = fit.T_cam_obj[:3, :3].T @ scene.T_cam_obj[:3, :3]
    order = slice(None) if abs(R[0, 0]) > abs(R[0, 1]) else slice(None, None, -1)
    true = np.array(list(scene.size.values()))
    found, sd = np.array(list(fit.size.values()))[order], np.sqrt(np.diag(fit.covariance)[6:])[order]
    return found / true - 1, (found - true) / sd, angle_deg(R[2, 2])
