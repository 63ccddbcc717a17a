# SPDX-License-Identifier: MIT
"""Access to the kernels, for experiments and teaching."""

from sdftrack.energy.energy import Energy, Linearization, Minimum, State, back_project, minimize
from sdftrack.energy.pose_fits import PoseFit, PoseFitter, fit_poses

__all__ = [
    "Energy", "Linearization", "Minimum", "PoseFit", "PoseFitter", "State", "back_project", "fit_poses", "minimize",
]  # fmt: skip
