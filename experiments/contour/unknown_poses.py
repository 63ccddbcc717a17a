# SPDX-License-Identifier: MIT
"""The shape memory on silhouettes that it does not know: whether its answer is ever worse than no answer."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.common.protocol import say
from experiments.contour.breakdancer import breakdancer, tumbling
from experiments.contour.shape_protocol import FRAMES, cases, davis_masks, halves, learnt
from experiments.data import has
from experiments.registry import experiment
from experiments.synth.gait import gait
from experiments.table import Table
from sdftrack.metrics import iou

Mask: TypeAlias = NDArray[np.bool_]
Sets: TypeAlias = dict[str, tuple[Mask, Mask]]  # silhouettes to learn, and to ask about

SHARES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
DOUBTS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, np.inf)
MAX_DOUBT = 2.0  # of what `ShapeMemory.recover` adds
CHOSEN_VIDEOS = ("cows", "camel", "libby", "bmx-trees")
HELD_OUT_VIDEOS = ("dance-twirl", "drift-straight", "soapbox")
EVERY = 6  # of the second half of a gait
EVERY_OTHER = 5  # of another object
WORSE = 0.01  # overlap


@dataclass(frozen=True)
class Query:
    """A hidden silhouette: overlaps of what is seen and of the mask accepted without regard to doubt; the doubt.

    ``doubt``: infinite if nothing is to be added.
    """

    cell: tuple[str, float, str]
    seen: float
    completed: float
    doubt: float

    def accepted(self, most: float) -> float:
        """Overlap of the mask that is accepted if that much doubt is."""
        return self.completed if self.doubt <= most else self.seen


def _queries(name: str, learn: Mask, ask: Mask) -> list[Query]:
    memory = learnt(learn)
    out = []
    for by in ("bar", "rectangle"):
        for case in cases(ask, SHARES, by):
            said, seen = memory.assess(case.seen), iou(case.seen, case.whole)
            occluded = said.judgement == "occluded"
            completed = iou(said.completed, case.whole) if occluded else seen
            out.append(Query((name, case.share, by), seen, completed, said.doubt if occluded else np.inf))
    return out


def _gaits(seeds: Iterable[int], frames: int, tumble: bool) -> Sets:
    """Gaits that repeat, known in the second half; `tumble`: also turned, learned so or upright."""
    out: Sets = {}
    for seed in seeds:
        for kind in FRAMES:
            masks = gait(kind, frames, seed)
            learn, ask = halves(masks, EVERY)
            out[f"{kind} {seed}"] = learn, ask
            if tumble:
                turned_learn, turned = halves(tumbling(masks, seed), EVERY)
                out[f"tumbling {kind} {seed}"] = turned_learn, turned
                out[f"upright, then tumbling {kind} {seed}"] = learn, turned
    return out


def _breakdancers(seeds: Iterable[int], frames: int) -> Sets:
    return {f"breakdancer {s}": halves(breakdancer(frames, s)) for s in seeds}


def _videos(folder: Path | None, names: tuple[str, ...], others: tuple[str, ...]) -> Sets:
    """First halves learned, second halves asked about; and the next of `others` asked about."""
    if folder is None:
        return {}
    read = {name: davis_masks(folder, name) for name in {*names, *others}}
    out: Sets = {name: halves(read[name]) for name in names}
    for one, other in pairwise(others):
        out[f"{one}, then {other}"] = read[one], read[other][::EVERY_OTHER]
    return out


def _all(sets: Sets) -> list[Query]:
    out = []
    for name, (learn, ask) in sets.items():
        out += _queries(name, learn, ask)
        say(name)
    return out


def _worst(queries: list[Query], most: float) -> tuple[float, tuple[str, float, str]]:
    """The largest mean loss against what is seen of all cells (a set, a share, a kind of cover), and the cell."""
    cells = defaultdict(list)
    for q in queries:
        cells[q.cell].append(q.accepted(most) - q.seen)
    return min((float(np.mean(gains)), cell) for cell, gains in cells.items())


def _limits(title: str, queries: list[Query], doubts: Iterable[float]) -> Table:
    known = [q for q in queries if q.cell[0].split()[0] in FRAMES]
    rows = []
    for most in doubts:
        gains = np.array([q.accepted(most) - q.seen for q in queries])
        loss, (name, share, by) = _worst(queries, most)
        rows.append([
            "any" if np.isinf(most) else f"{most:g}",
            f"{loss:+.3f}" if loss < 0 else "none",
            f"{name}, {by}, {share:g}" if loss < 0 else "",
            f"{100 * np.mean(gains < -WORSE):.2f}",
            f"{gains.min():+.2f}",
            f"{np.mean([q.accepted(most) for q in queries]):.3f}",
            f"{np.mean([q.accepted(most) for q in known]):.4f}",
        ])  # fmt: skip
    columns = [
        "largest doubt", "worst mean loss of a cell", "where", "queries worse, %", "worst query", "overlap",
        "overlap, known gaits",
    ]  # fmt: skip
    seen = np.mean([q.seen for q in queries])
    note = f"{len(queries)} queries; overlap of what is seen {seen:.3f}"
    return Table(title, columns, rows, [note])


GROUPS = ("tumbling", "upright", "breakdancer")


def _group(name: str) -> str:
    first = name.split()[0].rstrip(",")
    if first in FRAMES:
        return "known gaits"
    if first in GROUPS:
        return {"tumbling": "tumbling gaits", "upright": "learned upright, then tumbling"}.get(first, first)
    return "another object" if ", then " in name else first


def _by_set(title: str, queries: list[Query]) -> Table:
    groups = defaultdict(list)
    for q in queries:
        groups[_group(q.cell[0])].append(q)
    shares = SHARES[1:6]
    rows = []
    for name, some in groups.items():
        cells = []
        for share in shares:
            at = [q for q in some if q.cell[1] == share]
            ways = [(q.seen, q.completed, q.accepted(MAX_DOUBT)) for q in at]
            cells.append(" / ".join(f"{x:.3f}" for x in np.mean(ways, axis=0)))
        worse = [
            100 * np.mean([q.accepted(most) < q.seen - WORSE for q in some]) for most in (np.inf, MAX_DOUBT)
        ]
        rows.append([name, *cells, " / ".join(f"{x:.1f}" for x in worse)])
    return Table(title, ["set", *(f"{s:.0%}" for s in shares), "queries worse, %"], rows)


@experiment(
    "unknown_poses",
    uses=["davis"],
    chosen_on="cows, camel, libby, bmx-trees; gaits of seed 0, breakdancers 0 to 3",
    reported_on="dance-twirl, drift-straight, soapbox; gaits of other seeds, other breakdancers",
    short={"seeds": 1, "frames": 24},
)
def unknown_poses(*, data: Path, seeds: int = 3, frames: int = 240) -> list[Table]:
    """The shape memory on poses and objects that it does not know: whether an answer is worse than none.

    Bars and rectangles hide 10 to 70 % of silhouettes, or nothing. Sets: gaits of which the second half is known; the
    same tumbling; the same learned upright; a breakdancer, whose poses do not repeat; hand-made masks of videos, and of
    another video than the one learned. The mask that the memory gives is compared with what is seen; "worse": by more
    than 0.01 of overlap.

    Parameters
    ----------
    seeds
        held-out seeds of each gait; the first one also tumbling
    frames
        of each gait
    """
    cv2.setNumThreads(1)
    folder = data / "davis" if has("davis", data) else None
    few = min(84, frames)
    chosen = _all(
        _videos(folder, CHOSEN_VIDEOS, CHOSEN_VIDEOS)
        | _breakdancers(range(4), few)
        | _gaits([0], frames, tumble=True)
    )
    held_out = _all(
        _videos(folder, HELD_OUT_VIDEOS, ("bmx-trees", *HELD_OUT_VIDEOS, "cows"))
        | _breakdancers(range(4, 8), few)
        | _gaits([1], frames, tumble=True)
        | _gaits(range(2, seeds + 1), frames, tumble=False)
    )
    return [
        _limits("Largest doubt, on the sets that it was chosen on", chosen, DOUBTS),
        _limits("Held-out sets", held_out, (MAX_DOUBT, np.inf)),
        _by_set("Held-out sets, overlap by the share hidden: seen / any doubt / memory", held_out),
    ]
