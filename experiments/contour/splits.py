# SPDX-License-Identifier: MIT
"""Figures 6.3, 6.9 and 6.10: silhouettes from their first harmonics, and for each split of ten harmonics into inputs
and outputs what is recovered of hidden silhouettes, and which are found to be hidden.

The thesis' four videos (a running cat, a jumping woman, a walking man, a hand) are not available. They are replaced by
synthetic gaits with as many frames; where the data have the part `davis`, the manual masks of two of its sequences are
added. All frames are training data, as printed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from experiments.contour.shape_protocol import (
    SHARES,
    SIZE,
    Answer,
    Case,
    asked,
    cases,
    davis_masks,
    detection,
    gaits,
    learnt,
)
from experiments.data import has
from experiments.pictures import COLORS, Line, Panel, curves, images
from experiments.progress import step
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour.dct import harmonics, silhouette
from sdftrack.contour.memory import ShapeMemory
from sdftrack.metrics import iou

Mask: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[np.float64]
HARMONICS = 10
SPLITS = (1, 2, 3, 4, 5, 6, 7, 8, 9)  # how many of them, the highest, are inputs
VIDEOS = ("cows", "camel")  # of davis: those that are in sight nearly all the time
NOTE = "the thesis' videos are not available: synthetic gaits with as many frames"
NUMBERS, ENOUGH, EVERY = (3, 6, 9, 12, 15, 18, 21, 24, 27), 15, 10  # harmonics; enough, as printed; frames
BEST_PRINTED, ALIKE = (2, 3), 0.005  # inputs; overlaps that differ by less are called equal
FACTORS = np.geomspace(0.01, 100, 161)  # t / e
NEAR_BEST = 0.03  # F1 at t = e below the curve's best, at most: "near"
SHORT = {"frames": 20}


def sets(data: Path, frames: int | None) -> tuple[dict[str, Mask], str]:
    """Aligned silhouettes by name, and a sentence that says what they are."""
    out = gaits(frames)
    if not has("davis", data):
        return out, f"{NOTE}; no davis masks here (SDFTRACK_DATA)"
    out |= {name: davis_masks(data / "davis", name)[:frames] for name in VIDEOS}
    return out, f"{NOTE}, and the masks of two davis sequences ({', '.join(VIDEOS)})"


def split_name(inputs: int) -> str:
    """ "8-10 -> 1-7" for three inputs."""
    first = HARMONICS - inputs + 1
    high = f"{first}-{HARMONICS}" if inputs > 1 else f"{HARMONICS}"
    low = f"1-{first - 1}" if first > 2 else "1"
    return f"{high} -> {low}"


def _ask_all(masks: Mask, what: list[Case]) -> dict[str, tuple[ShapeMemory, list[Answer]]]:
    """The answers of the printed rule for every split, and of the default rule, after learning all masks."""
    out = {}
    for inputs in SPLITS:
        settle = min(20, len(masks))
        memory = learnt(masks, rule="printed", n_harmonics=HARMONICS, n_inputs=inputs, settle=settle)
        out[split_name(inputs)] = memory, asked(memory, what)
    memory = learnt(masks, capacity=512)
    out["memory"] = memory, asked(memory, what)
    return out


def by_share(answers: list[Answer], value: Callable[[Answer], float]) -> list[float]:
    """The mean of `value(answer)` at each share hidden, in their order."""
    shares = sorted({a.share for a in answers})
    return [float(np.mean([value(a) for a in answers if a.share == s])) for s in shares]


@experiment(
    "thesis.6.3",
    uses=["davis"],
    chosen_on="nothing was chosen here",
    reported_on="four gaits, cows and camel",
    short=SHORT,
)
def cut(*, data: Path, frames: int | None = None) -> Table:
    """Figure 6.3: silhouettes from their first harmonics.

    Each tenth frame of the sets of Figure 6.9 is cut to its first harmonics and its zero level drawn. Printed: pictures
    only; large gains from 3 to 15 harmonics, small ones from 15 to 27; 10 to 15 are used.

    Parameters
    ----------
    frames
        of each set, at most
    """
    used, note = sets(data, frames)
    rows: list[dict[str, Any]] = []
    for i, (name, masks) in enumerate(used.items()):
        step(i, len(used), name)
        rows.append({"set": name})
        rows[-1] |= {str(n): float(np.mean([iou(_cut(m, n), m) for m in masks[::EVERY]])) for n in NUMBERS}
    mean = {str(n): float(np.mean([row[str(n)] for row in rows])) for n in NUMBERS}
    gains = [mean[str(b)] - mean[str(a)] for a, b in ((NUMBERS[0], ENOUGH), (ENOUGH, NUMBERS[-1]))]
    said = f"gain from 3 to 15 harmonics {gains[0]:.3f}, from 15 to 27 {gains[1]:.3f}; printed: large, then small"
    return Table.of(
        f"Figure 6.3, overlap of silhouettes cut to their first harmonics; {note}",
        {"set": "set", **{str(n): f"{n}:.3f" for n in NUMBERS}},
        [*rows, {"set": "mean", **mean}],
        notes=[said],
        picture=lambda: _cut_picture({name: masks[len(masks) // 3] for name, masks in used.items()}),
    )


def _cut(mask: Mask, n: int) -> Mask:
    return np.asarray(silhouette(harmonics(mask, n), SIZE))


def _cut_picture(shown: dict[str, Mask]) -> Any:
    return images(
        {
            name: [("silhouette", mask), *((f"{n}", _cut(mask, n)) for n in NUMBERS)]
            for name, mask in shown.items()
        },
        side=1.15,
    )


@experiment(
    "thesis.6.9",
    uses=["davis"],
    chosen_on="nothing was chosen here",
    reported_on="four gaits, cows and camel; seed 0",
    short=SHORT,
)
def recovered(*, data: Path, frames: int | None = None) -> Table:
    """Figure 6.9: hidden silhouettes recovered, by how many harmonics are the inputs.

    A random rectangle hides 10 to 80 % of each frame; each split is recovered whatever the judgement. Printed: harmonic
    10 alone already works; 8-10 -> 1-7 or 9-10 -> 1-8 are best in all four sets; more inputs get worse.

    Parameters
    ----------
    frames
        of each set, at most
    """
    used, note = sets(data, frames)
    found: dict[str, dict[str, list[float]]] = {}
    for i, (name, masks) in enumerate(used.items()):
        step(i, len(used), name)
        what = cases(masks, SHARES, "rectangle", 0)
        ways = {way: by_share(a, lambda x: x.completed) for way, (_, a) in _ask_all(masks, what).items()}
        seen = [float(np.mean([iou(c.seen, c.whole) for c in what if c.share == s])) for s in SHARES]
        found[name] = {**ways, "no recovery": seen}
    rows: list[dict[str, Any]] = [
        {"way": way, **{name: float(np.mean(ways[way])) for name, ways in found.items()}}
        for way in next(iter(found.values()))
    ]
    splits: dict[str, dict[int, float]] = {
        name: {n: rows[i][name] for i, n in enumerate(SPLITS)} for name in found
    }
    best = {name: max(mean, key=mean.__getitem__) for name, mean in splits.items()}
    as_printed = [
        name for name, m in splits.items() if max(m[n] for n in BEST_PRINTED) >= m[best[name]] - ALIKE
    ]
    rows.append({"way": "best split", **{name: split_name(n) for name, n in best.items()}})
    return Table.of(
        f"Figure 6.9, mean overlap over seven sizes of rectangles, 10 to 80 % hidden; {note}",
        {"way": "way", **{name: f"{name}:.3f" for name in found}},
        rows,
        notes=[f"8-10 or 9-10 within {ALIKE} of the best split in: {', '.join(as_printed) or 'none'}"],
        numbers=found,
        picture=lambda: _recovered_picture(found),
    )


def _recovered_picture(found: dict[str, dict[str, list[float]]]) -> Any:
    ours: dict[str, dict[str, Any]] = {
        "memory": {"color": "black", "linewidth": 2},
        "no recovery": {"color": "0.5", "linestyle": ":"},
    }
    panels: list[Panel] = []
    for name, ways in found.items():
        lines = [
            Line(SHARES, overlap, way, ours.get(way) or _style(i))
            for i, (way, overlap) in enumerate(ways.items())
        ]
        axes = {"title": name, "xlabel": "share hidden", "ylabel": "overlap with the truth"}
        panels.append(Panel(lines, axes, None if panels else {"fontsize": 7, "ncols": 2}))
    half = (len(panels) + 1) // 2
    return curves([panels[:half], panels[half:]], (4.4 * half, 7.2), sharey=True)


def _style(i: int) -> dict[str, Any]:
    return {"color": COLORS[i % len(COLORS)], "linestyle": "--" if i >= len(COLORS) else "-"}


@experiment(
    "thesis.6.10",
    uses=["davis"],
    chosen_on="nothing was chosen here",
    reported_on="four gaits, cows and camel; seed 0",
    short=SHORT,
)
def detected(*, data: Path, frames: int | None = None) -> Table:
    """Figure 6.10: hidden silhouettes detected: precision and recall.

    The frames of Figure 6.9 with 10 to 80 % hidden, and the whole ones. The threshold t in |x_pred - x_obs|^2 >= 2 t^2
    varies from 0.01 to 100 times the error e of training; "novel" counts as not occluded; mean over the sets. Printed:
    9-10 -> 1-8 is best; t = e lies near the best point; more inputs get worse.

    Parameters
    ----------
    frames
        of each set, at most
    """
    used, note = sets(data, frames)
    found: dict[str, list[tuple[list[Answer], float]]] = {}
    for i, (name, masks) in enumerate(used.items()):
        step(i, len(used), name)
        what = cases(masks, (0.0, *SHARES), "rectangle", 0)
        for way, (memory, answers) in _ask_all(masks, what).items():
            found.setdefault(way, []).append((answers, memory.threshold))
    rows = [_detection(way, per_set) for way, per_set in found.items()]
    best = max((r for r in rows if r["way"] != "memory"), key=lambda r: float(r["average_precision"]))["way"]
    printed = f"printed: {split_name(2)} best, t = e near the best point, more inputs worse"
    columns = {"way": "way", "average precision": "average_precision:.3f", "F1 at t = e": "f1:.3f"}
    return Table.of(
        f"Figure 6.10, mean over {len(used)} sets: {note}",
        {**columns, "best F1": "best_f1:.3f", "near": "near", "called novel": "novel:.3f"},
        rows,
        notes=[f"best split: {best}; {printed}"],
        picture=lambda: _detected_picture(rows),
    )


def precision_recall(answers: list[Answer], threshold: float) -> tuple[Array, Array]:
    """Precision and recall of "occluded" at FACTORS times the threshold; precision 1 where nothing is called so."""
    score = np.array([-1.0 if a.judgement == "novel" else a.error for a in answers])
    hidden = np.array([a.share > 0 for a in answers])
    called = score[None, :] >= FACTORS[:, None] * threshold
    right = (called & hidden).sum(axis=1)
    count = called.sum(axis=1)
    return np.where(count > 0, right / np.maximum(count, 1), 1.0), right / hidden.sum()


def _detection(way: str, per_set: list[tuple[list[Answer], float]]) -> dict[str, Any]:
    p, r = (np.mean([x[k] for x in (precision_recall(a, t) for a, t in per_set)], axis=0) for k in (0, 1))
    f1 = 2 * p * r / np.maximum(p + r, 1e-12)
    here = int(np.argmin(np.abs(np.log(FACTORS))))
    return {
        "way": way, "precision": p.tolist(), "recall": r.tolist(), "here": here,
        "average_precision": float(np.mean([detection(a).average_precision for a, _ in per_set])),
        "f1": float(f1[here]), "best_f1": float(f1.max()),
        "near": bool(f1[here] >= f1.max() - NEAR_BEST),
        "novel": float(np.mean([x.judgement == "novel" for a, _ in per_set for x in a])),
    }  # fmt: skip


def _detected_picture(rows: list[dict[str, Any]]) -> Any:
    lines = []
    for i, row in enumerate(rows):
        style = {"color": "black", "linewidth": 2} if row["way"] == "memory" else _style(i)
        p, r, here = row["precision"], row["recall"], row["here"]
        star = {"marker": "*", "color": style["color"], "markersize": 11}
        lines += [Line(r, p, row["way"], style), Line([r[here]], [p[here]], style=star)]
    title = "hidden silhouettes called occluded; * at t = e"
    axes = {"xlabel": "recall", "ylabel": "precision", "title": title}
    return curves([[Panel(lines, axes, {"ncols": 2})]], (7.5, 5.2))
