# SPDX-License-Identifier: MIT
"""A movement with the rests beside it, in which its onset and offset are searched."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["MARGIN_S", "with_rests"]

MARGIN_S = 0.25


def with_rests(movements: Sequence[tuple[float, float]], k: int) -> tuple[float, float]:
    """(start, end) of movement `k` and up to 0.25 s of the rests beside it, at most half of a hold."""
    start, end = movements[k]
    before = 0.5 * (start - movements[k - 1][1]) if k > 0 else MARGIN_S
    after = 0.5 * (movements[k + 1][0] - end) if k + 1 < len(movements) else MARGIN_S
    return start - min(before, MARGIN_S), end + min(after, MARGIN_S)
