# SPDX-License-Identifier: MIT
"""Common parts of Figures 6.9 to 6.11: partly occluded silhouettes, memories for every split of the harmonics.

The thesis' four videos (a running cat, a jumping woman, a walking man, a hand) are not available. They are replaced by
synthetic gaits with as many frames; if SDFTRACK_DATA names a folder with the part `davis`, the manual masks of two of
its sequences are added. All frames are training data, as printed.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.measures.shape_protocol import (
    Answer,
    Case,
    asked,
    davis_folder,
    davis_masks,
    gaits,
    learnt,
)
from sdftrack.contour.memory import ShapeMemory

__all__ = ["HARMONICS", "NOTE", "SPLITS", "ask_all", "by_share", "sets", "split_name"]

Mask: TypeAlias = NDArray[np.bool_]
HARMONICS = 10
SPLITS = (1, 2, 3, 4, 5, 6, 7, 8, 9)  # how many of them, the highest, are inputs
VIDEOS = ("cows", "camel")  # of davis: those that are in sight nearly all the time
NOTE = "the thesis' videos are not available: synthetic gaits with as many frames"


def sets(context: Context) -> tuple[dict[str, Mask], str]:
    """Aligned silhouettes by name, and a sentence that says what they are."""
    out = gaits(context.frames)
    folder = davis_folder()
    if folder is None:
        return out, f"{NOTE}; no davis masks here (SDFTRACK_DATA)"
    for name in VIDEOS:
        masks = davis_masks(folder, name)
        out[name] = masks if context.frames is None else masks[: context.frames]
    return out, f"{NOTE}, and the masks of two davis sequences ({', '.join(VIDEOS)})"


def split_name(inputs: int) -> str:
    """ "8-10 -> 1-7" for three inputs."""
    first = HARMONICS - inputs + 1
    high = f"{first}-{HARMONICS}" if inputs > 1 else f"{HARMONICS}"
    low = f"1-{first - 1}" if first > 2 else "1"
    return f"{high} -> {low}"


def ask_all(masks: Mask, what: list[Case]) -> dict[str, tuple[ShapeMemory, list[Answer]]]:
    """The answers of the printed rule for every split, and of the default rule, after learning all masks."""
    out = {}
    for inputs in SPLITS:
        settle = min(20, len(masks))
        memory = learnt(masks, rule="printed", n_harmonics=HARMONICS, n_inputs=inputs, settle=settle)
        out[split_name(inputs)] = memory, asked(memory, what)
    memory = learnt(masks, capacity=512)
    out["memory"] = memory, asked(memory, what)
    return out


def by_share(answers: list[Answer], value: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Shares hidden, and the mean of `value(answer)` at each."""
    shares = sorted({a.share for a in answers})
    means = [float(np.mean([value(a) for a in answers if a.share == s])) for s in shares]
    return np.array(shares), np.array(means)
