# SPDX-License-Identifier: MIT
"""Figure 6.7: a hand that is tracked while something is in front, with the memory of shapes and without.

Set-up: the printed video is not available: a synthetic hand behind a bar. Printed: both ways alike while nothing is in
front; then the segmentation is wrong without the memory, and the contours are correct with it.
"""

from __future__ import annotations

from typing import Any

from experiments.thesis import Context
from experiments.thesis.closed_loops import followed

__all__ = ["run"]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    return followed(context, "hand", "Figure 6.7, a synthetic hand behind a bar")
