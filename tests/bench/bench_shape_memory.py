# SPDX-License-Identifier: MIT
"""One silhouette of 64 x 64 pixels: its harmonics, learnt, judged and recovered. Changing numbers breaks comparisons.

The walker, 250 frames learnt, another 20 with a bar before 40 % of them asked about in turn.
"""

import itertools
from collections.abc import Callable

from harness import benchmark

import sdftrack as st

KIND, LEARN, ASK, HIDDEN = "walker", 250, 20, 0.4


def asking(rule: str) -> Callable[[], object]:
    masks = st.synth.gait(KIND, LEARN + ASK)
    memory = st.contour.ShapeMemory(rule=rule)
    for mask in masks[:LEARN]:
        memory.learn(mask)
    seen = itertools.cycle([st.synth.hide(m, HIDDEN, "bar", k) for k, m in enumerate(masks[LEARN:])])
    return lambda: memory.assess(next(seen))


@benchmark("shape_memory/assess_remembered", unit="frame")
def assess_remembered() -> Callable[[], object]:
    return asking("remembered")


@benchmark("shape_memory/assess_printed", unit="frame")
def assess_printed() -> Callable[[], object]:
    return asking("printed")


@benchmark("shape_memory/learn_250", items=LEARN, unit="frame")
def learn() -> Callable[[], object]:
    masks = st.synth.gait(KIND, LEARN)

    def run() -> None:
        memory = st.contour.ShapeMemory()
        for mask in masks:
            memory.learn(mask)

    return run


@benchmark("shape_memory/harmonics", unit="frame")
def harmonics() -> Callable[[], object]:
    mask = st.synth.gait(KIND, 1)[0]
    return lambda: st.contour.harmonics(mask, 10)
