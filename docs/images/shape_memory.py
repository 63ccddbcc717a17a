# SPDX-License-Identifier: MIT
"""The picture of docs/shape_memory.md: harmonics of a silhouette, and hidden silhouettes recovered.

python -m docs.images.shape_memory docs/images/shape_memory.png
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sdftrack as st
from experiments.synth.covers import hide
from experiments.synth.gait import gait

LEARN, ASK = 200, 231
LEVELS = (3, 5, 10, 15, 27)
SHOWN = (
    ("cat", 0.4, "bar", 5),
    ("jumper", 0.4, "rectangle", 3),
    ("walker", 0.5, "rectangle", 1),
    ("hand", 0.4, "fence", 2),
)
SEEN, ADDED, CUT, OUT = (0.25, 0.25, 0.3), (0.82, 0.28, 0.35), (0.93, 0.80, 0.55), (0.96, 0.96, 0.96)


def painted(seen, mask, whole):
    """What is seen, what was added to it, and what of the truth is lacking."""
    image = np.full((*mask.shape, 3), OUT)
    image[whole & ~mask] = CUT
    image[mask] = ADDED
    image[mask & seen] = SEEN
    return image


figure, axes = plt.subplots(5, 6, figsize=(9.6, 8.6), layout="constrained")
whole = gait("cat", 1, seed=4)[0]
axes[0, 0].imshow(painted(whole, whole, whole))
axes[0, 0].set_title("silhouette", fontsize=9)
for ax, n in zip(axes[0, 1:], LEVELS, strict=True):
    cut = st.contour.silhouette(st.contour.harmonics(whole, n), 64)
    ax.imshow(painted(whole, cut, whole))
    ax.set_title(f"{n} harmonics", fontsize=9)

for row, (kind, share, by, seed) in zip(axes[1:], SHOWN, strict=True):
    masks = gait(kind, ASK + 1)
    memories = [st.contour.ShapeMemory(rule=rule) for rule in ("remembered", "printed")]
    for mask in masks[:LEARN]:
        for memory in memories:
            memory.learn(mask)
    whole = masks[ASK]
    seen = hide(whole, share, by, seed)
    for ax, mask in zip(row[:2], (whole, seen), strict=True):
        ax.imshow(painted(mask, mask, whole))
    row[0].set_title("the truth, not learnt", fontsize=9)
    row[1].set_title(f"{by}, {100 * share:.0f} % hidden", fontsize=9)
    for k, (memory, name) in enumerate(zip(memories, ("memory", "printed rule"), strict=True)):
        said = memory.assess(seen)
        row[2 + 2 * k].imshow(painted(seen, said.completed, whole))
        row[2 + 2 * k].set_title(f"{name}: {said.judgement}", fontsize=9)
        row[3 + 2 * k].imshow(said.completed ^ whole, cmap="Reds", vmin=0, vmax=1.3)
        row[3 + 2 * k].set_title(f"wrong; overlap {st.metrics.iou(said.completed, whole):.2f}", fontsize=9)
for ax in axes.ravel():
    ax.set_axis_off()
plt.savefig(Path(sys.argv[1]), dpi=100)
