# SPDX-License-Identifier: MIT
"""Access to the kernels, for experiments and teaching."""

from sdftrack.energy.energy import Energy, minimize
from sdftrack.energy.state import Linearization, Minimum, State
from sdftrack.imaging.back_projection import back_project

__all__ = ["Energy", "Linearization", "Minimum", "State", "back_project", "minimize"]
