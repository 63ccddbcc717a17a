# SPDX-License-Identifier: MIT
"""How well the contour tracker knows that it is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from experiments.contour.contour import (
    CHOSEN_ON,
    REPORTED_ON,
    THESIS,
    Followed,
    follow_davis,
    open_davis,
    separation,
)
from experiments.registry import experiment
from experiments.table import Table
from sdftrack._core import EVIDENCE_BIAS as BIAS
from sdftrack._core import EVIDENCE_SURE as SURE
from sdftrack._core import EVIDENCE_WEIGHTS as WEIGHTS

RIGHT_IOU = 0.5
HEAD = [
    "video", "frames", "colours: AUC", "ok", "wrong", "evidence: AUC", "ok by evidence", "wrong by evidence"
]  # fmt: skip


@experiment(
    "contour_confidence",
    needs=["davis"],
    chosen_on=", ".join(CHOSEN_ON),
    reported_on=", ".join(REPORTED_ON),
    short={"most": 3},
)
def contour_confidence(*, data: Path, most: int | None = None) -> Table:
    """Does the confidence of the contour tracker tell right outlines from wrong ones, IoU of one half?

    All videos from a mask and from a box, as in the thesis (colours alone, without the flow) and with the defaults.

    Parameters
    ----------
    most
        images of each video, at most
    """
    cv2.setNumThreads(1)
    rows = []
    for group, names in {"chosen on": CHOSEN_ON, "reported": REPORTED_ON}.items():
        judged: list[Followed] = []
        colors: list[Followed] = []
        for name in names:
            video = open_davis(data / "davis", name, most)
            for some, options in ((judged, {}), (colors, THESIS)):
                some += [follow_davis(video, by, **options) for by in ("mask", "box")]
            rows.append(_row(name, judged[-2:], colors[-2:]))
        rows.append(_row(f"all {group}", judged, colors))
    return Table(f"ok from {SURE}, weights {BIAS}; {', '.join(str(w) for w in WEIGHTS)}", HEAD, rows)


def _row(name: str, judged: Sequence[Followed], colors: Sequence[Followed]) -> list[str]:
    row = [name, str(sum(len(run.ious) for run in judged))]
    for runs in (colors, judged):
        bad = np.concatenate([run.ious for run in runs]) < RIGHT_IOU
        ok = np.array([status == "ok" for run in runs for status in run.status])
        auc = separation(np.concatenate([run.confidence for run in runs]), bad)
        row += [
            "-" if np.isnan(auc) else f"{auc:.3f}",
            str(int(ok.sum())),
            f"{(ok & bad).sum()} of {bad.sum()}",
        ]
    return row
