# SPDX-License-Identifier: MIT
"""What the contour tracker returns for a frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.evidence import Evidence
from sdftrack.contour.record import ArrayRecord, mask_png
from sdftrack.results import Status

__all__ = ["ContourResult"]


@dataclass(frozen=True, eq=False, repr=False)
class ContourResult(ArrayRecord):
    """Result of one frame.

    Attributes
    ----------
    mask : (H, W) bool
        Pixels of the object; empty if it is lost.
    warp : (3, 3) float64
        Maps the object's grid, (column, row) from its first cell, to pixels (x, y) of the image.
    phi : (ny, nx) float32
        Signed distance to the outline on the object's grid, in cells, negative inside, truncated beyond the band.
    status : Status
        "ok", "weak" (the mask may be wrong: it is occluded, its colours have changed, or it does not move as the image
        does) or "lost" (it is searched for in the next frames).
    reason : str
        Reason if the status is not "ok"; else empty.
    confidence : float
        0 to 1. Estimated chance that the mask is right (an IoU of 0.5 or more with the truth), from its agreement with
        the optical flow and with the colours at the start; with ``confidence="colors"``, the contrast across
        the outline relative to the start, times the similarity of the colours inside to those at the start (sum of
        sqrt(p q)).
    judgement : str or None
        Judgement of the shape memory: "unoccluded", "occluded" or "novel"; None without a memory or during burn-in.
    evidence : Evidence or None
        What the confidence was computed from; None at a start from a mask, while lost, and with
        ``confidence="colors"``.
    """

    mask: NDArray[np.bool_]
    warp: NDArray[np.float64]
    phi: NDArray[np.float32]
    status: Status
    reason: str
    confidence: float
    judgement: str | None = None
    evidence: Evidence | None = None

    @property
    def ok(self) -> bool:
        """Whether the status is "ok"."""
        return self.status == Status.OK

    def __repr__(self) -> str:
        said = f", {self.judgement}" if self.judgement else ""
        return (
            f"ContourResult({self.status}, confidence {self.confidence:.2f}{said}, {int(self.mask.sum())} px)"
        )

    def _repr_png_(self) -> bytes:
        return mask_png(self.mask)
