# SPDX-License-Identifier: MIT
"""The picture of docs/shape_memory.md, "In a video", made of synthesis alone.

python -m docs.images.closed_loop docs/images/closed_loop.png
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sdftrack as st
from experiments.synth.gait_video import gait_video

SHOWN = (99, 108, 114, 120, 126, 132, 138, 148)
HALF = 66  # pixels around the middle of the figure

video = gait_video("jumper")
axes = plt.subplots(2, len(SHOWN), figsize=(12, 3.9), layout="constrained")[1]
for row, memory in zip(axes, (None, st.contour.ShapeMemory()), strict=True):
    tracker = st.contour.ContourTracker(memory=memory)
    tracker.start(video.images[0], mask=video.whole[0])
    results = [tracker.track(image) for image in video.images[1:]]
    for ax, k in zip(row, SHOWN, strict=True):
        y, x = np.nonzero(video.whole[k])
        ax.imshow(video.images[k])
        ax.contour(video.whole[k], [0.5], colors="white", linewidths=0.6)
        ax.contour(results[k - 1].mask, [0.5], colors="yellow", linewidths=1.4)
        ax.set_xlim((x.min() + x.max()) / 2 + np.array([-HALF, HALF]) * 0.75)
        ax.set_ylim((y.min() + y.max()) / 2 + np.array([HALF, -HALF]))
        overlap = st.metrics.iou(results[k - 1].mask, video.whole[k])
        said = results[k - 1].judgement or str(results[k - 1].status)
        ax.set_title(f"{k}: {said}, {overlap:.2f}", fontsize=8)
        ax.set_axis_off()
plt.savefig(Path(sys.argv[1]), dpi=70)
