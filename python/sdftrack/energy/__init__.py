# SPDX-License-Identifier: MIT
"""Access to the kernels, for experiments and teaching."""

from sdftrack.energy.energy import Energy, minimize
from sdftrack.energy.pose_fits import PoseFit, PoseFitter, fit_poses
from sdftrack.energy.state import Linearization, Minimum, State
from sdftrack.imaging.back_projection import back_project

__all__ = [
    "Energy",
    "Linearization",
    "Minimum",
    "PoseFit",
    "PoseFitter",
    "State",
    "back_project",
    "fit_poses",
    "minimize",
]
