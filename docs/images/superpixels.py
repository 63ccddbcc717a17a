# SPDX-License-Identifier: MIT
"""The picture of docs/superpixels.md: a made picture, cut finely, as squares, and coarsely.

python -m docs.images.superpixels docs/images/superpixels.png
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import sdftrack as st
from experiments.synth.region_picture import region_picture

image = region_picture(320, 480, regions=40, seed=2)[0]
labels = st.superpixels.slic(image, 300)
shown = [
    ("image", image),
    (f"{labels.max()} superpixels", st.superpixels.mark_boundaries(image, labels, (255, 255, 255))),
    (
        "compactness 60",
        st.superpixels.mark_boundaries(image, st.superpixels.slic(image, 300, 60), (255, 255, 255)),
    ),
    ("mean colours of 60", st.superpixels.mean_colors(image, st.superpixels.slic(image, 60))),
]
for ax, (title, picture_) in zip(
    plt.subplots(1, 4, figsize=(14, 2.8), layout="constrained")[1], shown, strict=True
):
    ax.imshow(picture_)
    ax.set_title(title, fontsize=10)
    ax.set_axis_off()
plt.savefig(Path(sys.argv[1]), dpi=90)
