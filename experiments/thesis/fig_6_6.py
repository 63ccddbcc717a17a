# SPDX-License-Identifier: MIT
"""Figure 6.6: tracking behind a tree, with the memory of shapes and without.

Set-up: the printed video, a car, is not available: a running cat, which changes its shape, behind a bar. Printed: both
ways alike while nothing is in front; behind the tree the contour is corrupted without the memory, and is not with it.
"""

from __future__ import annotations

from typing import Any

from experiments.thesis import Context
from experiments.thesis.closed_loops import followed

__all__ = ["run"]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    return followed(context, "cat", "Figure 6.6, a synthetic running cat behind a bar, in place of a car")
