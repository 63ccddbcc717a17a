# SPDX-License-Identifier: MIT
"""The picture of docs/contour.md, made of synthesis alone.

python -m docs.images.contour docs/images/contour.png
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sdftrack as st
from experiments.synth.blob import blob_video
from sdftrack.contour.drawing import draw_outline

video = blob_video(frames=60, post=True)
y, x = np.nonzero(video.masks[0])
box = (x.min(), y.min(), np.ptp(x) + 1, np.ptp(y) + 1)
tracker = st.contour.ContourTracker()
tracker.start(video.images[0], box=box)
results = [tracker.track(image) for image in video.images[1:]]

axes = plt.subplots(1, 4, figsize=(12, 2.4), layout="constrained")[1]
axes[0].imshow(video.images[0])
axes[0].add_patch(plt.Rectangle(box[:2], box[2], box[3], fill=False, color="white", lw=1.5))
axes[0].set_title("a box in the first frame", fontsize=10)
for ax, k in zip(axes[1:3], (20, 58), strict=True):
    ax.imshow(draw_outline(video.images[k + 1], results[k].mask))
    overlap = st.metrics.iou(results[k].mask, video.masks[k + 1])
    ax.set_title(f"frame {k + 1}, IoU {overlap:.2f}", fontsize=10)
shown = axes[3].imshow(results[-1].phi, cmap="RdBu", vmin=-12, vmax=12)
axes[3].contour(results[-1].phi, [0], colors="black", linewidths=1)
axes[3].set_title("phi on the object's grid, cells", fontsize=10)
plt.colorbar(shown, ax=axes[3], shrink=0.8)
for ax in axes:
    ax.set_axis_off()
plt.savefig(Path(sys.argv[1]), dpi=100)
