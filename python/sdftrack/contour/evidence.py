# SPDX-License-Identifier: MIT
"""Confidence of an outline from evidence that its energy does not contain: the optical flow and the colours at the
start (docs/math/contour.md, section 8)."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.image_flow import BackwardFlow, moved_mask
from sdftrack.contour.masks import overlap
from sdftrack.results import Status

Mask = NDArray[np.bool_]
BITS = 3  # of each colour channel that are compared
MEMORY = 0.8  # weight of the past in the mean disagreement with the flow

# Logistic regression of "IoU >= 0.5": `python -m experiments run contour_confidence --fit` prints these.
BIAS = 4.23
WEIGHTS = (-2.21, -8.91, -4.23, -5.67)
SURE = 0.9  # `ok` from here on
MOST_SHARED = 0.55  # of the outline beside which the colours are the object's; chosen on CHOSEN_ON
MOST_INSTABILITY = 0.2  # of a first mask: what is followed from there may be anything, however well


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
    first_instability : float
        1 less the mean IoU of the first mask and those of the box shifted a little; 0 for a start from a mask.
    shared : float
        Share of the outline beside which the colours are those of the object nearby; the largest of the last frames,
        fading by 0.5 % per frame.
    """

    disagreement: float
    mean_disagreement: float
    strangeness: float
    first_instability: float = 0.0
    shared: float = 0.0


class EvidenceGatherer:
    """Compare each frame's mask with the first one, and with the last one moved by the optical flow."""

    def __init__(self, image: NDArray[np.uint8], mask: Mask, first_instability: float = 0.0) -> None:
        self._mask = mask
        self._first_instability = first_instability
        self._first = colors_inside(image, mask)
        self._mean = 0.0

    def gather(
        self, image: NDArray[np.uint8], mask: Mask, flow: BackwardFlow | None, shared: float = 0.0
    ) -> Evidence:
        """Evidence about the mask in the next image, given the flow from there to the last image."""
        expected = self._mask if flow is None else moved_mask(self._mask, flow)
        self._mask = mask
        disagreement = 1 - overlap(expected, mask)
        self._mean = MEMORY * self._mean + (1 - MEMORY) * disagreement
        strangeness = 1 - float(np.sqrt(colors_inside(image, mask) * self._first).sum())
        return Evidence(disagreement, self._mean, strangeness, self._first_instability, shared)

    def skip(self, mask: Mask) -> None:
        """A frame without an outline."""
        self._mask = mask


def certainty(evidence: Evidence) -> float:
    """Estimated chance that the outline's IoU with the truth is one half or more."""
    chance = float(1 / (1 + np.exp(-BIAS - np.dot(WEIGHTS, evidence[: len(WEIGHTS)]))))
    if evidence.first_instability > MOST_INSTABILITY:
        chance *= SURE
    return chance if evidence.shared <= MOST_SHARED else min(chance, 1 - evidence.shared)


def status_by_evidence(evidence: Evidence, status: Status, reason: str) -> tuple[Status, str, float]:
    """Status, reason and confidence. What the colours call lost or weak stays so."""
    confidence = certainty(evidence)
    if status != Status.OK or confidence >= SURE:
        return status, reason, confidence
    unstable = evidence.first_instability > MOST_INSTABILITY
    if not unstable and evidence.shared > MOST_SHARED:
        reason = f"the object has the colours of its surroundings along {100 * evidence.shared:.0f} % of the outline"
        return Status.WEAK, reason, confidence
    term = FIRST_TERM if unstable else int(np.argmin(np.multiply(WEIGHTS, evidence[: len(WEIGHTS)])))
    return Status.WEAK, REASONS[term], confidence


REASONS = (
    "the outline does not move as the image inside it does",
    "the outline has not moved as the image inside it did in the last frames",
    "the colours inside the outline differ from those at the start",
    "the first mask changes with the box; draw the box as tight as possible, or start from a mask",
)
FIRST_TERM = 3


def colors_inside(image: NDArray[np.uint8], mask: Mask) -> NDArray[np.float64]:
    """Shares of the colours inside."""
    bins = [1 << BITS] * 3
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    part = np.ascontiguousarray(mask[y : y + h, x : x + w]).view(np.uint8)
    if not w:
        return np.zeros(bins)
    counts = cv2.calcHist([image[y : y + h, x : x + w]], [0, 1, 2], part, bins, [0, 256] * 3)
    return np.asarray(counts, np.float64) / np.count_nonzero(part)
