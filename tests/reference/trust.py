# SPDX-License-Identifier: MIT
"""The evidence for a pose as one number: docs/trust.md."""

from __future__ import annotations

import numpy as np

WEIGHTS = {
    "constant": -25.97, "log_gap": -1.22, "unhidden": 29.29, "log_ends": 0.87, "missing": -4.22, "log_rough": -1.55,
}  # fmt: skip


def evidence(
    agree: int,
    farther: int,
    missing: int,
    expected: int,
    gap_m: float,
    ends: int,
    runs_on: int,
    roughness: float,
) -> float:
    """Chance that this is the object, about at this pose: a logistic function of counts, gap and roughness."""
    ending = (ends + 1) / (ends + runs_on + 2)
    log_odds = (
        WEIGHTS["constant"]
        + WEIGHTS["log_gap"] * np.log(1e3 * gap_m + 0.5)
        + WEIGHTS["unhidden"] * (agree + 1) / (agree + farther + 2)
        + WEIGHTS["log_ends"] * np.log(ending / (1 - ending))
        + WEIGHTS["missing"] * missing / expected
        + WEIGHTS["log_rough"] * np.log(np.clip(roughness, 0.5, 20.0))
    )
    return float(1 / (1 + np.exp(-log_odds)))
