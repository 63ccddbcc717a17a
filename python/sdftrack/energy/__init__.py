# SPDX-License-Identifier: MIT
"""The kernels themselves, for experiments and teaching."""

from sdftrack.energy.energy import Energy, minimize
from sdftrack.energy.state import Linearization, Minimum, State
from sdftrack.imaging.back_projection import back_project

__all__ = ["Energy", "Linearization", "Minimum", "State", "back_project", "minimize"]
