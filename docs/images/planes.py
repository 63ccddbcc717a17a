# SPDX-License-Identifier: MIT
"""The picture of docs/planes.md: a made scene or, where SDFTRACK_DATA has the part osd, a recorded one.

PYTHONPATH=. python docs/images/planes.py docs/images/planes.png
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import sdftrack as st
from experiments.data import root
from experiments.planes.ground import middle_of_table, scene_of, stages

scene = scene_of(root())
at = middle_of_table(scene)
mask, (n, d) = st.remove_plane(scene.frame, scene.camera, start_px=at)
(_, patch), (_, extended), _ = stages(scene, at, {"rigid": mask})["rigid"]
height_mm = 1e3 * (scene.camera.back_project(scene.frame.depth) @ n + d)

axes = plt.subplots(1, 3, figsize=(11, 3.1), layout="constrained")[1]
axes[0].imshow(patch)
axes[0].set_title("a patch on the table", fontsize=10)
axes[1].imshow(extended)
axes[1].set_title("extended: what lies on the plane", fontsize=10)
shown = axes[2].imshow(np.where(mask, height_mm, np.nan), cmap="viridis", vmin=0)
axes[2].set_title("what is left, mm over the plane", fontsize=10)
plt.colorbar(shown, ax=axes[2], shrink=0.8)
for ax in axes:
    ax.set_axis_off()
plt.savefig(Path(sys.argv[1]), dpi=100)
