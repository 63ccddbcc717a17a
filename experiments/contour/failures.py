# SPDX-License-Identifier: MIT
"""Figures 6.5 and 6.8: silhouettes that the regression recovers, and its two failures: a fence, no detail in sight."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from experiments.contour.shape_protocol import Case, cases, gaits, learnt, middle_alone
from experiments.contour.splits import NOTE
from experiments.pictures import images
from experiments.progress import step
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour.dct import harmonics, series
from sdftrack.contour.result import Assessment
from sdftrack.metrics import iou

RULES = {"LWPR 8-10 -> 1-7": "printed", "memory": "remembered"}
FENCE = 0.4  # share hidden
EVERY = 8  # frames
SHOWN = 0.4  # of the queries
GAITS = ("cat", "jumper", "walker", "hand")
HARMONICS = 10
JUDGEMENTS = ("novel", "occluded", "unoccluded")


@experiment(
    "thesis.6.8",
    chosen_on="nothing was chosen here",
    reported_on="the synthetic hand, seed 0",
    short={"frames": 80},
)
def failures(*, frames: int | None = None) -> Table:
    """Figure 6.8: what the regression of harmonics cannot recover: a fence, no details.

    All frames of the synthetic hand learnt; a fence, or all but a disc inside hidden. Printed: pictures of wrong shapes
    by 8-10 -> 1-7 or a like split; both cases may be found to be "not learnt", which is not guaranteed.
    """
    masks = gaits(frames)["hand"]
    asked = masks[::EVERY]
    hidden = {
        "many small occluders": cases(asked, (FENCE,), "fence"),
        "no detail in sight": [middle_alone(mask, 0.7) for mask in asked],
    }
    said: dict[str, dict[str, list[Assessment]]] = {}
    for i, (name, rule) in enumerate(RULES.items()):
        step(i, len(RULES), name)
        memory = learnt(masks, rule=rule, capacity=512, settle=min(20, len(masks)))
        said[name] = {what: [memory.assess(c.seen) for c in some] for what, some in hidden.items()}
    overlaps = {"visible part": "seen:.3f", "completed": "completed:.3f", "accepted": "accepted:.3f"}
    return Table.of(
        f"Figure 6.8, the hand, {len(masks)} frames: overlaps, shares of judgements; {NOTE}",
        {"hidden": "hidden", "way": "way", **overlaps, **{j: f"{j}:.2f" for j in JUDGEMENTS}},
        [
            {"hidden": what, "way": name, **_row(some, answers[what])}
            for what, some in hidden.items()
            for name, answers in said.items()
        ],
        notes=["printed: wrong shapes, pictures only"],
        picture=lambda: _picture(hidden, said),
    )


def _row(some: list[Case], answers: list[Assessment]) -> dict[str, Any]:
    judged = Counter[str](a.judgement for a in answers)
    both = list(zip(some, answers, strict=True))
    return {
        "seen": float(np.mean([iou(c.seen, c.whole) for c in some])),
        "completed": float(np.mean([iou(a.completed, c.whole) for c, a in both])),
        "accepted": float(np.mean([iou(a.mask, c.whole) for c, a in both])),
        **{j: judged[j] / len(some) for j in JUDGEMENTS},
    }


@experiment(
    "thesis.6.5",
    chosen_on="nothing was chosen here",
    reported_on="the synthetic cat, walker, hand and jumper, seed 0",
    short={"frames": 80},
)
def recovered(*, frames: int | None = None, share: float = 0.33) -> Table:
    """Figure 6.5: silhouettes with a rectangle hidden, recovered by the printed rule, in pairs: DCT and silhouette.

    All frames learnt, harmonics 8-10 give 1-7; the middle pair is what is in sight. Printed: pictures.

    Parameters
    ----------
    share
        of the silhouette that is hidden
    """
    rows, pictures = [], {}
    for k, (name, masks) in enumerate(gaits(frames).items()):
        step(k, len(GAITS), name)
        memory = learnt(masks, rule="printed", capacity=512, settle=min(20, len(masks)))
        some = cases(masks[::EVERY], (share,), "rectangle", seed=k)
        answers = [memory.assess(c.seen) for c in some]
        overlaps = _row(some, answers)
        rows.append({"set": name, "share": share, **overlaps})
        case, answer = some[len(some) // 2], answers[len(some) // 2]
        pictures[name] = [
            pair
            for title, mask in (
                ("whole", case.whole),
                ("in sight", case.seen),
                ("recovered", answer.completed),
            )
            for pair in ((title, _false_colors(mask)), (f"{iou(mask, case.whole):.2f}", mask))
        ]
    columns = {"set": "set", "hidden": "share:.2f", "in sight": "seen:.3f", "recovered": "completed:.3f"}
    return Table.of(
        f"Figure 6.5, overlaps; {NOTE}", columns, rows, picture=lambda: images(pictures, side=1.7)
    )


def _false_colors(mask: Any) -> Any:
    """Of the inverse of the cut DCT: blue for -1, red for 1."""
    values = np.clip(series(harmonics(mask, HARMONICS), mask.shape, size=mask.shape[0]), -1, 1)[..., None]
    red, blue = np.array([220, 40, 40]), np.array([40, 60, 220])
    return np.where(values > 0, 255 + values * (red - 255), 255 - values * (blue - 255)).astype(np.uint8)


def _picture(hidden: dict[str, list[Case]], said: dict[str, dict[str, list[Assessment]]]) -> Any:
    rows = {}
    for what, some in hidden.items():
        k = int(SHOWN * len(some))
        shown = [("silhouette", some[k].whole), ("in sight", some[k].seen)]
        for name, answers in said.items():
            answer = answers[what][k]
            title = f"{name}: {answer.judgement},\n{iou(answer.mask, some[k].whole):.2f}"
            shown.append((title, answer.mask))
        rows[what] = shown
    return images(rows, side=2.2)
