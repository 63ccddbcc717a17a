# SPDX-License-Identifier: MIT
"""The shape memory on hidden silhouettes, and what simpler ways give."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from experiments.contour.shape_baselines import BASELINES
from experiments.contour.shape_protocol import (
    DAVIS,
    SHARES,
    Answer,
    Case,
    asked,
    baseline,
    cases,
    davis_masks,
    detection,
    gaits,
    halves,
    learnt,
    middle_alone,
)
from experiments.data import has
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour.dct import harmonics, silhouette
from sdftrack.metrics import iou

Mask: TypeAlias = NDArray[np.bool_]
BARS = (0.2, 0.3, 0.4, 0.5, 0.6)
RULES = {"memory": "remembered", "LWPR": "printed"}
EVERY = {"gait": 5, "video": 1}  # of the second half: gaits are long
INTERLEAVED = 2  # the second protocol: every second frame learnt, the others asked about


def _sets(folder: Path | None, frames: int | None) -> dict[str, tuple[Mask, int]]:
    out = {name: (masks, EVERY["gait"]) for name, masks in gaits(frames).items()}
    if folder is not None:
        for name in DAVIS:
            out[name] = (davis_masks(folder, name)[:frames], EVERY["video"])
    return out


def _mean(answers: list[Answer], what: str = "completed") -> float:
    return float(np.mean([getattr(a, what) for a in answers]))


def recovery_row(learn: Mask, ask: Mask) -> dict[str, float]:
    """Overlaps with bars that hide 20 to 60 %: of the completed masks, `kept`: with what is seen kept."""
    what = cases(ask, BARS, "bar")
    row = {"none": float(np.mean([iou(c.seen, c.whole) for c in what]))}
    for name, rule in RULES.items():
        answers = asked(learnt(learn, rule=rule), what)
        row[name] = _mean(answers)
        row[f"{name} judged"] = _mean(answers, "accepted")
        row[f"{name} novel"] = float(np.mean([a.judgement == "novel" for a in answers]))
        row[f"{name} ms"] = 1e3 * float(np.median([a.seconds for a in answers]))
    for name in BASELINES:
        row[name] = _mean(baseline(name, learn, what))
        row[f"{name} kept"] = _mean(baseline(name, learn, what, keep_seen=True))
    return row


def detection_row(learn: Mask, ask: Mask) -> dict[str, float]:
    """Average precisions with rectangles that hide 10 to 80 %, and the whole masks."""
    what = cases(ask, (0.0, *SHARES), "rectangle")
    row: dict[str, float] = {}
    for name, rule in RULES.items():
        memory = learnt(learn, rule=rule)
        answers = asked(memory, what)
        gated = detection(answers)
        free = [dataclasses.replace(a, judgement="occluded") for a in answers]
        row[name] = detection(free).average_precision
        row[f"{name} gated"] = gated.average_precision
        row[f"{name} F1"], row[f"{name} best F1"] = gated.f1, gated.best
    for name in BASELINES:
        row[name] = detection(baseline(name, learn, what)).average_precision
    return row


def hard_row(learn: Mask, ask: Mask) -> dict[str, float]:
    """Fences, and a piece of the middle alone: shares called novel and unoccluded, overlap of what is accepted else.

    `worse`: share whose accepted mask is farther from the truth than what is seen.
    """
    memory = learnt(learn)
    row: dict[str, float] = {}
    for kind, seen in (("fence", cases(ask, (0.3, 0.4, 0.5), "fence")), ("middle", _middles(ask))):
        answers = asked(memory, seen)
        row[f"{kind} novel"] = float(np.mean([a.judgement == "novel" for a in answers]))
        row[f"{kind} whole"] = float(np.mean([a.judgement == "unoccluded" for a in answers]))
        taken = [(a.accepted, iou(c.seen, c.whole)) for a, c in zip(answers, seen, strict=True)]
        taken = [t for t, a in zip(taken, answers, strict=True) if a.judgement == "occluded"]
        row[f"{kind} overlap"] = float(np.mean([t[0] for t in taken])) if taken else float("nan")
        row[f"{kind} worse"] = sum(t[0] < t[1] for t in taken) / len(answers)
    return row


def _middles(masks: Mask) -> list[Case]:
    """Nothing of the outline is seen."""
    return [case for case in map(middle_alone, masks) if np.count_nonzero(case.seen) >= 12]


def order_row(learn: Mask, ask: Mask) -> dict[str, float]:
    """Overlap of whole silhouettes cut to 10 harmonics, and of those recovered, for both kinds of harmonics."""
    row = {}
    what = cases(ask, BARS, "bar")
    for order in ("max", "sum"):
        cut = [iou(silhouette(harmonics(m, 10, order), 64, order), m) for m in ask]
        row[f"{order} cut"] = float(np.mean(cut))
        row[f"{order} LWPR"] = _mean(asked(learnt(learn, rule="printed", order=order), what))
        row[f"{order} memory"] = _mean(asked(learnt(learn, order=order), what))
    return row


def _table(title: str, rows: dict[str, dict[str, float]], columns: Sequence[str], digits: int = 3) -> Table:
    cells = [[name, *(f"{row[c]:.{digits}f}" for c in columns)] for name, row in rows.items()]
    return Table(title, ["set", *columns], cells)


@experiment(
    "shape_memory",
    uses=["davis"],
    chosen_on="the four gaits and the masks of davis, first halves",
    reported_on="the second halves of the same sets",
    short={"frames": 24, "only": ("cat",)},
)
def shape_memory(*, data: Path, frames: int | None = None, only: tuple[str, ...] = ()) -> list[Table]:
    """The shape memory on hidden silhouettes: overlap, detection, fences, time; and what simpler ways give.

    It learns the first half of each set and is asked about the second. Sets: four synthetic gaits and, where the folder
    `davis` is at hand, the hand-made masks of four videos, each aligned by itself. "LWPR" is the source's way (rule
    "printed", harmonics 8-10 give 1-7), "memory" the default.

    Parameters
    ----------
    frames
        at most so many of each set
    only
        sets, comma separated; none: all
    """
    folder = data / "davis" if has("davis", data) else None
    found: dict[str, dict[str, dict[str, float]]] = {
        k: {} for k in ("recovery", "detection", "hard", "orders", "interleaved")
    }
    for name, (masks, every) in _sets(folder, frames).items():
        if only and name not in only:
            continue
        learn, ask = halves(masks, every)
        found["recovery"][name] = recovery_row(learn, ask)
        found["detection"][name] = detection_row(learn, ask)
        found["hard"][name] = hard_row(learn, ask)
        found["orders"][name] = order_row(learn, ask)
        if every == 1:
            found["interleaved"][name] = recovery_row(masks[::INTERLEAVED], masks[1::INTERLEAVED])
    return _tables(found)


def _tables(found: dict[str, dict[str, dict[str, float]]]) -> list[Table]:
    plain, kept = list(BASELINES), [f"{b} kept" for b in BASELINES]
    judged = [f"{n} {c}" for n in RULES for c in ("judged", "novel", "ms")]
    gated = [f"{n} {c}" for n in RULES for c in ("gated", "F1", "best F1")]
    hard = [f"{k} {c}" for k in ("fence", "middle") for c in ("novel", "whole", "overlap", "worse")]
    orders = [f"{o} {c}" for o in ("max", "sum") for c in ("cut", "LWPR", "memory")]
    every = ["none", "memory", "LWPR", *plain, *kept]
    # title, which rows, columns
    contents: list[tuple[str, str, Sequence[str]]] = [
        ("First half learnt. Bars hide 20 to 60 %: mean overlap of the completed mask with the truth", "recovery",
         ["none", "memory", "LWPR", *plain]),
        ("The same, baselines with what is seen kept and thick parts added, as the memory does", "recovery",
         ["memory", *kept]),
        ("The same: mask that is accepted by the judgement, share called novel, ms per frame (median)", "recovery",
         judged),
        ("Rectangles hide 10 to 80 %, and whole masks: average precision of the error alone", "detection",
         ["memory", "LWPR", *plain]),
        ("The same, novel counting as not occluded; F1 of the judgements and the best of the curve", "detection",
         gated),
        ("Fences that hide 30 to 50 %, a disc inside alone: novel, whole, overlap if occluded, worse than seen",
         "hard", hard),
        ("Harmonics of order max(u, v) + 1 and u + v + 1: ten of a whole mask, recovered under bars", "orders",
         orders),
        ("Videos, every second frame learnt, the others asked about: overlap under bars of 20 to 60 %",
         "interleaved", every),
    ]  # fmt: skip
    return [_table(title, found[key], columns) for title, key, columns in contents if found[key]]
