# SPDX-License-Identifier: MIT
"""Confidence of an outline from evidence that its energy does not contain: the optical flow and the colours at the
start (docs/math/contour.md, section 8)."""

from __future__ import annotations

from typing import NamedTuple

from sdftrack import _core
from sdftrack.results import Status


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


def certainty(evidence: Evidence) -> float:
    """Estimated chance that the outline's IoU with the truth is one half or more."""
    return _core.contour_certainty(evidence)


def status_by_evidence(evidence: Evidence, status: Status, reason: str) -> tuple[Status, str, float]:
    """Status, reason and confidence. What the colours call lost or weak stays so."""
    said, why, confidence = _core.contour_verdict(evidence, status.value, reason)
    return Status(said), why, confidence
