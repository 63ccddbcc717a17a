# SPDX-License-Identifier: MIT
"""Confidence of an outline from evidence that its energy does not contain: the optical flow and the colours at the
start (docs/math/contour.md, section 8)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.image_flow import BackwardFlow, moved_mask
from sdftrack.results import Status

__all__ = ["Evidence", "EvidenceGatherer", "certainty", "status_by_evidence"]

Mask = NDArray[np.bool_]
BITS = 3  # of each colour channel that are compared
MEMORY = 0.8  # weight of the past in the mean disagreement with the flow

# Logistic regression of "IoU >= 0.5": `python -m experiments run contour_confidence --fit` prints these.
BIAS = 4.177
WEIGHTS = (-3.818, -9.196, -3.118)
SURE = 0.9  # `ok` from here on


class Evidence(NamedTuple):
    """What an outline is judged by.

    Attributes
    ----------
    disagreement : float
        1 less the IoU of the mask and the last mask moved by the optical flow.
    mean_disagreement : float
        The same, averaged over the last frames.
    strangeness : float
        1 less the affinity (sum of sqrt(p q)) of the colours inside and those at the start.
    """

    disagreement: float
    mean_disagreement: float
    strangeness: float


class EvidenceGatherer:
    """Compare each frame's mask with the first one, and with the last one moved by the optical flow."""

    def __init__(self, image: NDArray[np.uint8], mask: Mask) -> None:
        self._mask = mask
        self._first = _colors(image, mask)
        self._mean = 0.0

    def gather(self, image: NDArray[np.uint8], mask: Mask, flow: BackwardFlow | None) -> Evidence:
        """Evidence about the mask in the next image, given the flow from there to the last image."""
        expected = self._mask if flow is None else moved_mask(self._mask, flow)
        self._mask = mask
        either = int((expected | mask).sum())
        disagreement = 1 - int((expected & mask).sum()) / either if either else 1.0
        self._mean = MEMORY * self._mean + (1 - MEMORY) * disagreement
        strangeness = 1 - float(np.sqrt(_colors(image, mask) * self._first).sum())
        return Evidence(disagreement, self._mean, strangeness)

    def skip(self, mask: Mask) -> None:
        """A frame without an outline."""
        self._mask = mask


def certainty(evidence: Evidence) -> float:
    """Estimated chance that the outline's IoU with the truth is one half or more."""
    return float(1 / (1 + np.exp(-BIAS - np.dot(WEIGHTS, evidence))))


def status_by_evidence(evidence: Evidence, status: Status, reason: str) -> tuple[Status, str, float]:
    """Status, reason and confidence. What the colours call lost or weak stays so."""
    confidence = certainty(evidence)
    if status != Status.OK or confidence >= SURE:
        return status, reason, confidence
    return Status.WEAK, REASONS[int(np.argmin(np.multiply(WEIGHTS, evidence)))], confidence


REASONS = (
    "the outline does not move as the image inside it does",
    "the outline has not moved as the image inside it did in the last frames",
    "the colours inside the outline differ from those at the start",
)


def _colors(image: NDArray[np.uint8], mask: Mask) -> NDArray[np.float64]:
    """Shares of the colours inside."""
    chosen = image[mask] >> (8 - BITS)
    bins = (chosen[:, 0].astype(np.intp) << 2 * BITS) | (chosen[:, 1].astype(np.intp) << BITS) | chosen[:, 2]
    return np.bincount(bins, minlength=1 << 3 * BITS) / max(len(bins), 1)
