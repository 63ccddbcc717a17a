# SPDX-License-Identifier: MIT
"""Superpixels on photographs with human segmentations, beside scikit-image's."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.data import has
from experiments.pictures import images as pictures_of
from experiments.registry import experiment
from experiments.superpixels import times
from experiments.table import Table

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


def _quality(folder: Path, images: int | None, segments: Seq[int]) -> Table:
    from skimage.segmentation import slic as theirs

    import sdftrack as st

    scenes = open_bsds(folder)[:images]
    ours = curve(scenes, lambda image, n: st.superpixels.slic(image, n), segments)
    other = curve(scenes, lambda image, n: theirs(image, n), THEIRS)
    rows: list[dict[str, Any]] = []
    cells = []
    for n, *scores in ours:
        beside = [float(np.interp(np.log(n), np.log(other[:, 0]), other[:, k])) for k in (1, 2, 3)]
        rows.append({"segments": float(n), "ours": [float(s) for s in scores], "scikit-image": beside})
        cells.append([f"{n:.0f}", *(f"{v:.4f}" for pair in zip(scores, beside, strict=True) for v in pair)])
    head = ["segments", *(name for score in SCORES for name in (score, f"{score}, scikit-image"))]
    best = [
        all(r["ours"][k] * s >= r["scikit-image"][k] * s for r in rows) for k, s in ((0, 1), (1, -1), (2, 1))
    ]
    named = zip(SCORES, best, strict=True)
    note = "at least as good at every size: " + ", ".join(f"{n} {'yes' if b else 'no'}" for n, b in named)
    return Table(f"{len(scenes)} images, defaults of both", head, cells, [note], rows)


@experiment(
    "superpixels",
    uses=["bsds"],
    chosen_on="the 20 photographs of bsds; speed on the made picture",
    reported_on="the same photographs and picture",
    short={"images": 1, "segments": (250,), "speed": False},
)
def superpixels(
    *,
    data: Path,
    images: int | None = None,
    segments: tuple[int, ...] = SEGMENTS,
    speed: bool = True,
    quick: bool = False,
) -> list[Table]:
    """Superpixels on photographs with human segmentations, and their time, beside scikit-image's.

    For each number of segments: boundary recall (2 px), under-segmentation error (Neubert and Protzel) and achievable
    accuracy, each a mean over images of the mean over people; scikit-image with its defaults, interpolated (linear in
    the logarithm) to the number of segments that ours returns. Then the time of a call on a made picture at three sizes
    and on five of the photographs: best, median, and of all processors together, with one thread and two, and for other
    programs that are installed; and the memory of a call.

    Parameters
    ----------
    images
        the first so many photographs; none: all
    segments
        numbers asked for, comma separated
    speed
        the times too
    quick
        other programs' time at the smallest size alone
    """
    there = has("bsds", data)
    tables = [_quality(data, images, segments)] if there else []
    return tables + (times.speed(data if there else None, quick) if speed else [])


PICTURED, ASKED = (2, 11), (100, 400, 1600)


@experiment("thesis.A.3", needs=["bsds"], chosen_on="two photographs that show much", reported_on="bsds")
def pictured(*, data: Path) -> Table:
    """Figure A.3: superpixels of photographs, by the number that is asked for.

    Photographs with human segmentations; "recall" is the share of their boundaries within 2 px of a boundary. Printed:
    a picture of another photograph; superpixels of about equal size.
    """
    import sdftrack as st

    rows, shown = [], {}
    scenes = open_bsds(data)
    for k in PICTURED:
        image, truths = scenes[k]
        shown[f"photograph {k}"] = [("", image)]
        for asked in ASKED:
            labels = st.superpixels.slic(image, asked)
            sizes = np.unique(labels, return_counts=True)[1]
            recall = float(np.mean([st.metrics.boundary_recall(labels, truth) for truth in truths]))
            spread = float(np.std(sizes) / np.mean(sizes))
            rows.append(
                {"of": f"photograph {k}, {asked}", "got": len(sizes), "recall": recall, "spread": spread}
            )
            shown[f"photograph {k}"].append((f"{len(sizes)}", st.superpixels.mark_boundaries(image, labels)))
    columns = {
        "of": "of",
        "superpixels": "got:d",
        "recall": "recall:.3f",
        "sd of the size / mean": "spread:.2f",
    }
    return Table.of("Figure A.3", columns, rows, picture=lambda: pictures_of(shown, 3.4))
