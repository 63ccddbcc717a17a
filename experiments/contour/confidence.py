# SPDX-License-Identifier: MIT
"""How well the contour tracker knows that it is wrong; fits the weights of its evidence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.contour.contour import CHOSEN_ON, REPORTED_ON, THESIS, Davis, open_davis, separation
from experiments.contour.opencv_ways import box_of
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour.evidence import BIAS, SURE, WEIGHTS, Evidence
from sdftrack.contour.tracker import ContourTracker
from sdftrack.metrics import iou

__all__ = ["contour_confidence", "fit_logistic", "starts"]

RIGHT_IOU = 0.5
PENALTY = 10.0  # of squared weights of terms of unit variance
NEWTON_STEPS = 30
MIN_FIRST_PX = 200


@dataclass(frozen=True)
class Judged:
    """Frames of a video followed a few ways: IoU, confidence, whether ok, evidence (NaN where lost)."""

    ious: NDArray[np.float64]
    confidence: NDArray[np.float64]
    ok: NDArray[np.bool_]
    evidence: NDArray[np.float64]


def starts(video: Davis, more: bool) -> Iterator[tuple[list[Any], list[Any], str]]:
    """Images, masks and the start; `more`: also backwards, and from a third and two thirds of the video on."""
    n = len(video.images)
    for step in (1, -1) if more else (1,):
        for first in dict.fromkeys((0, n // 3, 2 * n // 3) if more else (0,)):
            at = n - 1 if first == 0 and step < 0 else first
            if min(n, n - at if step > 0 else at + 1) < 2 or video.masks[at].sum() < MIN_FIRST_PX:
                continue
            for by in ("mask", "box"):
                yield video.images[at::step], video.masks[at::step], by


def _follow(video: Davis, more: bool, options: dict[str, Any]) -> Judged:
    frames = []
    for images, masks, by in starts(video, more):
        tracker = ContourTracker(**options)
        place: Any = {"mask": masks[0]} if by == "mask" else {"box": box_of(masks[0])}
        tracker.start(images[0], **place)
        for image, true in zip(images[1:], masks[1:], strict=True):
            result = tracker.track(image)
            terms = result.evidence or (np.nan,) * len(Evidence._fields)
            frames.append((iou(result.mask, true), result.confidence, result.ok, *terms))
    table = np.array(frames, np.float64)
    return Judged(table[:, 0], table[:, 1], table[:, 2] > 0, table[:, 3:])


def fit_logistic(
    terms: NDArray[np.float64], right: NDArray[np.bool_], weight: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Bias and weights of a logistic regression with a ridge, by Newton's method."""
    mean, scale = terms.mean(0), terms.std(0) + 1e-9
    rows = np.column_stack([np.ones(len(terms)), (terms - mean) / scale])
    ridge = PENALTY * np.eye(rows.shape[1])
    ridge[0, 0] = 1e-9
    found = np.zeros(rows.shape[1])
    for _ in range(NEWTON_STEPS):
        chance = 1 / (1 + np.exp(-rows @ found))
        slope = rows.T @ (weight * (chance - right)) + ridge @ found
        curvature = rows.T @ ((weight * chance * (1 - chance))[:, None] * rows) + ridge
        found -= np.linalg.solve(curvature, slope)
    weights = found[1:] / scale
    return float(found[0] - weights @ mean), weights


def _fit(videos: list[Judged]) -> str:
    """Weights from these videos, each with the same influence."""
    seen = [~np.isnan(v.evidence[:, 0]) for v in videos]
    terms = np.concatenate([v.evidence[s] for v, s in zip(videos, seen, strict=True)])
    right = np.concatenate([v.ious[s] >= RIGHT_IOU for v, s in zip(videos, seen, strict=True)])
    weight = np.concatenate([np.full(int(s.sum()), len(terms) / len(videos) / s.sum()) for s in seen])
    bias, weights = fit_logistic(terms, right, weight)
    return f"{bias:.3f}; " + ", ".join(f"{w:.3f}" for w in weights)


def _row(name: str, v: Judged, colors: Judged) -> list[str]:
    row = [name, str(len(v.ious))]
    for judged in (colors, v):
        bad = judged.ious < RIGHT_IOU
        auc = separation(judged.confidence, bad)
        row += [
            "-" if np.isnan(auc) else f"{auc:.3f}",
            f"{int(judged.ok.sum())}",
            f"{int((judged.ok & bad).sum())} of {int(bad.sum())}",
        ]
    return row


def _joined(videos: list[Judged]) -> Judged:
    return Judged(
        *(np.concatenate([getattr(v, field) for v in videos]) for field in Judged.__dataclass_fields__)
    )


@experiment(
    "contour_confidence",
    needs=["davis"],
    chosen_on=", ".join(CHOSEN_ON),
    reported_on=", ".join(REPORTED_ON),
    short={"most": 3},
)
def contour_confidence(*, data: Path, most: int | None = None, fit: bool = False) -> Table:
    """Does the confidence of the contour tracker tell right outlines from wrong ones, IoU of one half?

    All videos from a mask and from a box, as in the thesis (colours alone, without the flow) and with the defaults.

    Parameters
    ----------
    most
        images of each video, at most
    fit
        fit the weights of the evidence to the videos of the choice, each forwards and backwards from three frames
    """
    cv2.setNumThreads(1)
    title = f"ok from {SURE}, weights {BIAS}; {', '.join(str(w) for w in WEIGHTS)}"
    if fit:
        found = _fit([_follow(open_davis(data / "davis", n, most), True, {}) for n in CHOSEN_ON])
        title += f"; fitted here {found}"
    rows = []
    for group, names in {"chosen on": CHOSEN_ON, "reported": REPORTED_ON}.items():
        videos = [open_davis(data / "davis", name, most) for name in names]
        judged = [_follow(v, False, {}) for v in videos]
        colors = [_follow(v, False, THESIS) for v in videos]
        rows += [_row(v.name, j, c) for v, j, c in zip(videos, judged, colors, strict=True)]
        rows.append(_row(f"all {group}", _joined(judged), _joined(colors)))
    head = [
        "video",
        "frames",
        "colours: AUC",
        "ok",
        "wrong",
        "evidence: AUC",
        "ok by evidence",
        "wrong by evidence",
    ]
    return Table(title, head, rows)
