# SPDX-License-Identifier: MIT
"""``sdftrack motion``: an exercise measured from tracked poses."""

from sdftrack.cli.motion.command import motion

__all__ = ["motion"]
