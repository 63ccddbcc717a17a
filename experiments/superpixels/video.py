# SPDX-License-Identifier: MIT
"""Superpixels of a video, against those of every image by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

import sdftrack as st
from experiments.contour.contour import SEQUENCES, open_davis
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.metrics import boundary_recall, undersegmentation

WARM_UP = 3  # images before the first that counts
WAYS = ("video", "2 rounds", "5 rounds")


def row(folder: Path, name: str, segments: int, frames: int | None = None) -> list[str]:
    """Of one sequence: recall, error and segments of the three ways."""
    video = st.superpixels.Video(segments)
    scene = open_davis(folder, name, frames)
    scores = []
    for k, (image, mask) in enumerate(zip(scene.images, scene.masks, strict=True)):
        warm = video.next(image)
        if k < WARM_UP or k % 2 or not mask.any():
            continue
        cold = [st.superpixels.slic(image, segments, max_num_iter=rounds) for rounds in (2, 5)]
        truth = mask.astype(np.int32)
        ways = (warm, *cold)
        scores.append(
            [[boundary_recall(w, truth), undersegmentation(w, truth), float(w.max())] for w in ways]
        )
    recall, error, count = np.mean(scores, axis=0).T
    shown = [f"{v:.3f}" for v in recall] + [f"{v:.4f}" for v in error] + [f"{v:.0f}" for v in count]
    return [name, *shown]


@experiment(
    "superpixel_video",
    needs=["davis"],
    chosen_on="cows, camel, libby, bmx-trees (rounds of a warm start)",
    reported_on="the same four sequences",
    short={"only": ("cows",), "frames": 6, "segments": 100},
)
def superpixel_video(
    *,
    data: Path,
    only: tuple[Literal["cows", "camel", "libby", "bmx-trees"], ...] = SEQUENCES,
    segments: int = 400,
    frames: int | None = None,
) -> Table:
    """Superpixels of videos: two rounds from the last image's centres beside two and five from the grid.

    For each sequence of ``davis`` how much of the true outline is found, the under-segmentation error and the number of
    segments, means over every other image.

    Parameters
    ----------
    segments
        asked for
    frames
        of each sequence, at most
    """
    head = ["sequence", *(f"{what}: {way}" for what in ("recall", "error", "segments") for way in WAYS)]
    rows = [row(data / "davis", name, segments, frames) for name in only]
    return Table(f"{segments} segments asked", head, rows)
