# SPDX-License-Identifier: MIT
"""Score of a pose against the depth image in a region, used to compare start hypotheses."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["HypothesisScore", "score_pose"]

MIN_M, PER_M = (
    0.006,
    0.01,
)  # a measurement this near to the model's depth is its surface; per metre of distance
CLICK_PX = 4  # a pose is of another thing where nothing of it lies this near to the click


class HypothesisScore(NamedTuple):
    """How well a pose explains the depth image in a region, 0..1.

    Attributes
    ----------
    seen : float
        Fraction of the unoccluded surface that is observed where the pose predicts it.
    explained : float
        Fraction of the region's depth measurements that lie on the surface.
    clicked : bool
        Whether the clicked measurement lies on it.
    """

    seen: float
    explained: float
    clicked: bool

    @property
    def value(self) -> float:
        """One number, to compare poses by."""
        return self.seen * self.explained if self.clicked else 0.0


def score_pose(
    sdf: Any,
    camera: Any,
    depth: NDArray[np.float32],
    T: NDArray[np.float64],
    region: NDArray[np.bool_],
    px: Any,
) -> HypothesisScore:
    """Compare a depth image with the rendering at a pose; `px`: (x, y) that must lie on the surface."""
    expected = sdf.render(camera, T)[0]
    on = expected > 0
    near = MIN_M + PER_M * expected
    agree = on & (np.abs(depth - expected) < near)
    past = on & (depth > expected + near)
    front = on & (depth > 0) & (depth < expected - near)
    seen = float(agree.sum()) / max(1.0, float(agree.sum() + past.sum()) + 0.5 * float(front.sum()))
    x, y = px
    about = agree[max(0, y - CLICK_PX) : y + CLICK_PX + 1, max(0, x - CLICK_PX) : x + CLICK_PX + 1]
    return HypothesisScore(seen, float((agree & region).sum()) / max(1, int(region.sum())), bool(about.any()))
