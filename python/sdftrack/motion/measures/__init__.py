# SPDX-License-Identifier: MIT
"""The measures. Importing this package enters them in `DEFINITIONS`, in the order of definitions.toml."""

from sdftrack.motion.definitions import DEFINITIONS, ROWS
from sdftrack.motion.measures import kinematics, smoothness

for _name in ROWS:
    if _name in DEFINITIONS:
        DEFINITIONS[_name] = DEFINITIONS.pop(_name)

__all__ = ["kinematics", "smoothness"]
