# SPDX-License-Identifier: MIT
"""Superpixels on photographs with human segmentations, and their time, beside scikit-image's.

``python -m sdftrack.eval.superpixels --data FOLDER`` prints, for each number of segments, boundary recall (2 px),
under-segmentation error (Neubert and Protzel) and achievable accuracy, each a mean over images of the mean over people;
scikit-image with its defaults, interpolated (linear in the logarithm) to the number of segments that ours returns. Then
the time of a call at three sizes: best, median, and of all processors together, with one thread and all, and for
scikit-image; and the memory of a call.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from collections.abc import Sequence as Seq
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.eval.tables import text_table

__all__ = ["curve", "main", "open_bsds", "times_ms"]

Array = NDArray[Any]
Way = Callable[[Array, int], Array]
SEGMENTS = (250, 400, 600, 900, 1300, 1900)
THEIRS = (150, 200, 400, 700, 1000, 1400, 2000, 2600)
SCORES = ("recall", "error", "accuracy")
SIZES = ((640, 480), (1920, 1080), (3840, 2160))
PER_SEGMENT_PX = 256  # 1,200 segments at 640 x 480
ITERATIONS = 5


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


def times_ms(run: Callable[[], object], seconds: float = 2.0, least: int = 5) -> tuple[float, float, float]:
    """Best and median time of a call, and the least time of all processors, which a busy machine moves least."""
    run()
    taken: list[float] = []
    work: list[float] = []
    while len(taken) < least or sum(taken) < 1e3 * seconds:
        began, before = time.perf_counter(), time.process_time()
        run()
        taken.append(1e3 * (time.perf_counter() - began))
        work.append(1e3 * (time.process_time() - before))
    return min(taken), float(np.median(taken)), min(work)


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


def _ways() -> dict[str, Callable[[Array, int], Callable[[], object]]]:
    import sdftrack as st

    def ours(threads: int) -> Callable[[Array, int], Callable[[], object]]:
        return lambda image, n: lambda: st.superpixels.slic(
            image, n, max_num_iter=ITERATIONS, threads=threads, device="cpu"
        )

    ways = {"one thread": ours(1), "all cores": ours(0)}
    if st.cuda_available():
        ways["GPU"] = lambda image, n: lambda: st.superpixels.slic(
            image, n, max_num_iter=ITERATIONS, device="cuda"
        )
    return ways


def _speed(quick: bool) -> dict[str, Any]:
    from skimage.segmentation import slic as theirs

    from sdftrack.synth.picture import picture

    rows: dict[str, Any] = {}
    cells = []
    for width, height in SIZES:
        image, n = picture(height, width)[0], width * height // PER_SEGMENT_PX
        made = {name: times_ms(way(image, n)) for name, way in _ways().items()}
        if width == SIZES[0][0] or not quick:
            made["scikit-image"] = times_ms(partial(theirs, image, n, max_num_iter=ITERATIONS), 0.0, 3)
        rows[f"{width}x{height}"] = made
        cells += [
            [f"{width} x {height}, {n}", name, *(f"{t:.2f}" for t in times)] for name, times in made.items()
        ]
    title = f"\nTime of a call, ms, {ITERATIONS} iterations of every pixel, connectivity included"
    print(text_table(title, ["image, segments", "", "best", "median", "processor"], cells))
    pixels = np.log([w * h for w, h in SIZES])
    slope = {k: float(np.polyfit(pixels, np.log([rows[s][k][2] for s in rows]), 1)[0]) for k in _ways()}
    print(
        "exponent of the processor's time in the number of pixels: "
        + ", ".join(f"{k} {v:.3f}" for k, v in slope.items())
    )
    memory = _memory(*picture(480, 640)[:1])
    print(f"memory of a call, 640 x 480: {memory:.1f} bytes a pixel, labels included")
    return {"times_ms": rows, "exponent": slope, "bytes_per_pixel": memory}


def _memory(image: Array) -> float:
    from sdftrack import _core

    work, options = _core.SlicWork(), _core.SlicOptions()
    options.n_segments = image.shape[0] * image.shape[1] // PER_SEGMENT_PX
    labels = work.run(image, options, None, None, False, 0, False)[0]
    return float((work.bytes + labels.nbytes) / labels.size)


def main(given: Seq[str] | None = None) -> int:
    """Print the tables."""
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.superpixels", description=__doc__.split("\n\n")[0]
    )
    p.add_argument(
        "--data", type=Path, default=os.environ.get("SDFTRACK_DATA"), help="folder bsds, or its parent"
    )
    p.add_argument("--no-speed", action="store_true", help="quality alone")
    p.add_argument("--quick", action="store_true", help="scikit-image's time at the smallest size alone")
    p.add_argument("--json", type=Path, help="write the numbers")
    a = p.parse_args(given)
    made: dict[str, Any] = {}
    if a.data is not None:
        made["quality"] = _quality(Path(a.data))
    if not a.no_speed:
        made["speed"] = _speed(a.quick)
    if a.json is not None:
        a.json.write_text(json.dumps(made, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
