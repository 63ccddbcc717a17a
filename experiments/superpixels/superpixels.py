# SPDX-License-Identifier: MIT
"""Superpixels on photographs with human segmentations, and their time, beside scikit-image's.

``python -m sdftrack.eval.superpixels --data FOLDER`` prints, for each number of segments, boundary recall (2 px),
under-segmentation error (Neubert and Protzel) and achievable accuracy, each a mean over images of the mean over people;
scikit-image with its defaults, interpolated (linear in the logarithm) to the number of segments that ours returns. Then
the time of a call on a made picture at three sizes and on five of the photographs: best, median, and of all processors
together, with one thread and two, and for other programs that are installed; and the memory of a call.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.superpixels.times import speed
from sdftrack.evaluation.tables import text_table

__all__ = ["curve", "main", "open_bsds"]

Array = NDArray[Any]
Way = Callable[[Array, int], Array]
SEGMENTS = (250, 400, 600, 900, 1300, 1900)
THEIRS = (150, 200, 400, 700, 1000, 1400, 2000, 2600)
SCORES = ("recall", "error", "accuracy")


def open_bsds(folder: Path) -> list[tuple[Array, list[Array]]]:
    """Images and, for each, what people have drawn; ValueError where they are not there."""
    import cv2

    root = folder / "bsds" if (folder / "bsds").is_dir() else folder
    paths = sorted((root / "images").glob("*.jpg"))
    if not paths:
        raise ValueError(f"--data: expected a folder with images/*.jpg and groundTruth/*.png, got {root}")
    made = []
    for path in paths:
        truths = sorted((root / "groundTruth").glob(f"{path.stem}_*.png"))
        image = np.ascontiguousarray(np.asarray(cv2.imread(str(path)))[..., ::-1])
        made.append((image, [np.asarray(cv2.imread(str(t), cv2.IMREAD_UNCHANGED)) for t in truths]))
    return made


def curve(scenes: Seq[tuple[Array, list[Array]]], way: Way, segments: Seq[int]) -> Array:
    """(len(segments), 4): segments returned, recall, error, accuracy; means over the images."""
    from sdftrack import metrics

    kinds = (metrics.boundary_recall, metrics.undersegmentation, metrics.achievable_accuracy)
    rows = []
    for wanted in segments:
        scores = []
        for image, truths in scenes:
            labels = way(image, wanted)
            each = [[kind(labels, truth) for kind in kinds] for truth in truths]
            scores.append([len(np.unique(labels)), *np.mean(each, axis=0)])
        rows.append(np.mean(scores, axis=0))
    return np.array(rows)


def _quality(folder: Path) -> dict[str, Any]:
    from skimage.segmentation import slic as theirs

    import sdftrack as st

    scenes = open_bsds(folder)
    ours = curve(scenes, lambda image, n: st.superpixels.slic(image, n), SEGMENTS)
    other = curve(scenes, lambda image, n: theirs(image, n), THEIRS)
    rows: list[dict[str, Any]] = []
    cells = []
    for n, *scores in ours:
        beside = [float(np.interp(np.log(n), np.log(other[:, 0]), other[:, k])) for k in (1, 2, 3)]
        rows.append({"segments": float(n), "ours": [float(s) for s in scores], "scikit-image": beside})
        cells.append([f"{n:.0f}", *(f"{v:.4f}" for pair in zip(scores, beside, strict=True) for v in pair)])
    head = ["segments", *(name for score in SCORES for name in (score, "scikit-image"))]
    print(text_table(f"{len(scenes)} images, defaults of both", head, cells))
    best = [
        all(r["ours"][k] * s >= r["scikit-image"][k] * s for r in rows) for k, s in ((0, 1), (1, -1), (2, 1))
    ]
    print(
        "at least as good at every size: " + ", ".join(f"{n} {b}" for n, b in zip(SCORES, best, strict=True))
    )
    return {"rows": rows, "at_least_as_good": dict(zip(SCORES, best, strict=True))}


def main(given: Seq[str] | None = None) -> int:
    """Print the tables."""
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.superpixels", description=__doc__.split("\n\n")[0]
    )
    p.add_argument(
        "--data", type=Path, default=os.environ.get("SDFTRACK_DATA"), help="folder bsds, or its parent"
    )
    p.add_argument("--no-speed", action="store_true", help="quality alone")
    p.add_argument("--quick", action="store_true", help="other programs' time at the smallest size alone")
    p.add_argument("--json", type=Path, help="write the numbers")
    a = p.parse_args(given)
    made: dict[str, Any] = {}
    if a.data is not None:
        made["quality"] = _quality(Path(a.data))
    if not a.no_speed:
        made["speed"] = speed(Path(a.data) if a.data is not None else None, a.quick)
    if a.json is not None:
        a.json.write_text(json.dumps(made, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
