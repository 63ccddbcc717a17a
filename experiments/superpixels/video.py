# SPDX-License-Identifier: MIT
"""Superpixels of videos: two rounds from the last image's centres beside two and five from the grid.

``python -m sdftrack.eval.superpixel_video --data FOLDER`` prints for each sequence of ``davis`` how much of the true
outline is found, the under-segmentation error and the number of segments, means over every other image.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence as Seq
from pathlib import Path

import numpy as np

import sdftrack as st
from experiments.contour.contour import SEQUENCES, open_davis
from sdftrack.evaluation.tables import text_table
from sdftrack.metrics import boundary_recall, undersegmentation

__all__ = ["main", "row"]

WARM_UP = 3  # images before the first that counts
WAYS = ("video", "2 rounds", "5 rounds")


def row(folder: Path, name: str, segments: int) -> list[str]:
    """Of one sequence: recall, error and segments of the three ways."""
    video = st.superpixels.Video(segments)
    scene = open_davis(folder, name)
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


def main(given: Seq[str] | None = None) -> int:
    """Print the table."""
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.superpixel_video", description=__doc__.split("\n\n")[0]
    )
    p.add_argument(
        "--data", type=Path, default=os.environ.get("SDFTRACK_DATA"), help="folder davis, or its parent"
    )
    p.add_argument("--segments", type=int, default=400)
    a = p.parse_args(given)
    if a.data is None:
        p.error("--data: expected the folder davis, got none")
    head = ["sequence", *(f"{what}: {way}" for what in ("recall", "error", "segments") for way in WAYS)]
    root = Path(a.data)
    folder = root / "davis" if (root / "davis").is_dir() else root
    rows = [row(folder, name, a.segments) for name in SEQUENCES]
    print(text_table(f"{a.segments} segments asked", head, rows))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
