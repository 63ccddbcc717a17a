# SPDX-License-Identifier: MIT
"""The experiments of thesis chapter 6.4: silhouettes, things before them, memories asked, overlaps and judgements."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from experiments.contour.shape_baselines import BASELINES
from experiments.synth.covers import hide
from experiments.synth.gait import gait
from sdftrack import _core
from sdftrack.contour.dct import block_of, harmonic_numbers, series, signed_distances
from sdftrack.contour.memory import ShapeMemory
from sdftrack.metrics import iou

__all__ = [
    "DAVIS", "FRAMES", "SHARES", "Answer", "Case", "Detection", "asked", "baseline", "cases", "completion",
    "davis_masks", "detection", "gaits", "halves", "learnt", "middle_alone",
]  # fmt: skip

Mask: TypeAlias = NDArray[np.bool_]
Said: TypeAlias = tuple[Mask, Mask, float, str]  # completed, accepted mask, error, judgement
Asked: TypeAlias = Callable[[Mask], Said]

SIZE = 64
FRAMES = {"cat": 398, "jumper": 410, "walker": 411, "hand": 408}  # as many as the thesis' four videos have
DAVIS = ("cows", "camel", "libby", "bmx-trees")
SHARES = (0.10, 0.22, 0.33, 0.45, 0.57, 0.68, 0.80)  # seven sizes from 10 to 80 % hidden


@dataclass(frozen=True)
class Case:
    """A silhouette and what is seen of it; `share` is the part that is hidden."""

    whole: Mask
    seen: Mask
    share: float


@dataclass(frozen=True)
class Answer:
    """What one memory made of a case: overlap of the completed and of the accepted mask, error, judgement, time."""

    share: float
    completed: float
    accepted: float
    error: float
    judgement: str
    seconds: float


@dataclass(frozen=True)
class Detection:
    """Precision and recall over all thresholds; `f1` and `at` are those of the judgements."""

    average_precision: float
    f1: float
    best: float
    recall: NDArray[np.float64]
    precision: NDArray[np.float64]
    at: tuple[float, float]


def gaits(frames: int | None = None, seed: int = 0) -> dict[str, Mask]:
    """The four synthetic sets, in place of the thesis' videos; `frames`: at most so many of each."""
    return {k: gait(k, n if frames is None else min(n, frames), seed, SIZE) for k, n in FRAMES.items()}


def davis_masks(folder: Path, name: str) -> Mask:
    """(n, SIZE, SIZE): the hand-made masks of one sequence, each aligned by itself."""
    import cv2

    from sdftrack.contour.dct import align

    files = sorted((folder / name / "mask").glob("*.png"))
    if not files:
        raise FileNotFoundError(f"{folder / name / 'mask'}: no masks here; expected NNNNNN.png")
    return np.array([align(np.asarray(cv2.imread(str(f), cv2.IMREAD_GRAYSCALE)), SIZE)[0] for f in files])


def halves(masks: Mask, every: int = 1) -> tuple[Mask, Mask]:
    """The first half to learn, every so many-th of the second half to be asked about."""
    return masks[: len(masks) // 2], masks[len(masks) // 2 :: every]


def cases(masks: Iterable[Mask], shares: Iterable[float], by: str, seed: int = 0) -> list[Case]:
    """Each mask with each share hidden at a random place; a share of 0 is the mask itself."""
    rng = np.random.default_rng(seed)
    wanted = list(shares)
    out = []
    for mask in masks:
        for share in wanted:
            seen = hide(mask, share, by, rng)
            if seen.any():
                out.append(Case(mask, seen, share))
    return out


def middle_alone(mask: Mask, share: float = 1.0) -> Case:
    """Only a disc inside is seen, which meets the outline nowhere; `share` of the largest such disc."""
    phi = signed_distances(mask)
    y, x = np.unravel_index(int(phi.argmin()), phi.shape)
    rows, columns = np.indices(mask.shape)
    seen = np.hypot(columns - x, rows - y) < -share * phi.min() - (0.5 if share == 1 else 0.0)
    return Case(mask, seen, 1 - float(seen.sum() / mask.sum()))


def learnt(masks: Iterable[Mask], **options: Any) -> ShapeMemory:
    """A memory that has learnt the masks in their order."""
    memory = ShapeMemory(**options)
    for mask in masks:
        memory.learn(mask)
    return memory


def asked(memory: ShapeMemory, what: list[Case]) -> list[Answer]:
    """A memory's answers."""

    def ask(seen: Mask) -> Said:
        said = memory.assess(seen)
        return said.completed, said.mask, said.error, said.judgement

    return _answers(ask, what)


def completion(
    name: str, masks: Mask, n_harmonics: int = 10, n_inputs: int = 3
) -> Callable[[Mask], tuple[Mask, float]]:
    """What a baseline that has learnt the masks makes of a silhouette: the mask that the harmonics give, and how far
    its coefficients are from the observed ones."""
    codes = np.array([block_of(m, n_harmonics, "max") for m in masks])
    model = BASELINES[name](codes, harmonic_numbers(n_harmonics) > n_harmonics - n_inputs)

    def complete(seen: Mask) -> tuple[Mask, float]:
        c = block_of(seen, n_harmonics, "max")
        whole = model.complete(c)
        return series(whole, (SIZE, SIZE)) > 0, float(np.linalg.norm(whole - c))

    return complete


def baseline(name: str, masks: Mask, what: list[Case], keep_seen: bool = False) -> list[Answer]:
    """A baseline's answers.

    `keep_seen`: what is seen stays, and only thick parts beyond it are added, as `ShapeMemory` does.
    """
    complete = completion(name, masks)

    def ask(seen: Mask) -> Said:
        expected, error = complete(seen)
        completed = _core.contour_with_hidden(seen, expected) if keep_seen else expected
        return completed, completed, error, "occluded"

    return _answers(ask, what)


def detection(answers: list[Answer]) -> Detection:
    """Precision-recall by the error, where "novel" counts as not occluded however large it is; F1 of the judgements."""
    score = np.array([-1.0 if a.judgement == "novel" else a.error for a in answers])
    hidden = np.array([a.share > 0 for a in answers])
    order = np.argsort(-score, kind="stable")
    called, right = score[order] >= 0, hidden[order]
    tp = np.cumsum(right & called)
    precision = tp / np.arange(1, len(right) + 1)
    recall = tp / hidden.sum()
    ends = np.append(np.diff(score[order]) != 0, True) & called  # equal errors are called together
    p, r = precision[ends], recall[ends]
    average = float(np.sum(np.diff(np.append(0, r)) * p))
    f = 2 * p * r / np.maximum(p + r, 1e-12)
    now = np.array([a.judgement == "occluded" for a in answers])
    p_now = (now & hidden).sum() / max(1, now.sum())
    r_now = (now & hidden).sum() / hidden.sum()
    f_now = 2 * p_now * r_now / max(1e-12, p_now + r_now)
    return Detection(average, float(f_now), float(f.max(initial=0)), r, p, (float(r_now), float(p_now)))


def _answers(ask: Asked, what: list[Case]) -> list[Answer]:
    out = []
    for case in what:
        start = time.perf_counter()
        completed, accepted, error, judgement = ask(case.seen)
        seconds = time.perf_counter() - start
        out.append(
            Answer(
                case.share, iou(completed, case.whole), iou(accepted, case.whole), error, judgement, seconds
            )
        )
    return out
