# SPDX-License-Identifier: MIT
"""Table A.2: full processing times of superpixels for three sizes of image.

Set-up: a made picture (`synth.region_picture`) at 320 x 240, 640 x 480 and 1280 x 960, 256 pixels a segment (1,200 at
640 x 480), compactness 10, 5 iterations, connectivity included. Picture, segments, compactness and iterations are not
printed in the thesis; these are ours. Its "SLIC" is the authors' program on one core of an i7-2600, its gSLIC ran on
a GTX 460; "CPU SLIC" here is scikit-image's.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.thesis import Context
from experiments.thesis.measures.call_times import PER_SEGMENT_PX, times_ms
from sdftrack.device import resolve_device
from sdftrack.evaluation.tables import text_table

__all__ = ["COMPACTNESS", "ITERATIONS", "SIZES", "run"]

SIZES = ((320, 240), (640, 480), (1280, 960))
COMPACTNESS, ITERATIONS = 10.0, 5
SECONDS, QUICK_SECONDS = 1.5, 0.1  # of each figure
PRINTED = {"printed gSLIC": (9, 21, 86), "printed SLIC": (88, 354, 1522)}


def run(context: Context) -> dict[str, Any]:
    """Make the table: figure.png, table.txt, and the numbers."""
    from skimage.segmentation import slic as cpu_slic

    import sdftrack as st
    from experiments.synth.region_picture import region_picture
    from sdftrack._internal.files import write_text

    device, threads = context.options.get("device", "auto"), context.options.get("threads", 0)
    resolve_device(device)  # a GPU that is asked for and missing is an error
    seconds = SECONDS if context.frames is None else QUICK_SECONDS
    ways: dict[str, Any] = {
        "one core": {"threads": 1, "device": "cpu"},
        "all cores": {"threads": threads, "device": "cpu"},
    }
    if st.cuda_available():
        ways["GPU"] = {"device": "cuda"}
    rows: dict[str, list[float]] = {name: [] for name in [*ways, "scikit-image"]}
    for k, (width, height) in enumerate(SIZES):
        image, n = region_picture(height, width)[0], width * height // PER_SEGMENT_PX
        for name, way in ways.items():
            rows[name].append(_time(st.superpixels.slic, image, n, seconds, way))
        rows["scikit-image"].append(_time(cpu_slic, image, n, 0.0, {}))
        context.step(k + 1, len(SIZES), f"{width} x {height}")
    head = ["best time, ms", *(f"{w} x {h}" for w, h in SIZES)]
    cells = [[name, *(f"{t:.2f}" for t in times)] for name, times in rows.items()]
    cells += [[name, *(f"{t}" for t in times)] for name, times in PRINTED.items()]
    ratio = np.array(rows["scikit-image"]) / np.array(rows["all cores"])
    notes = [
        "faster than scikit-image: "
        + ", ".join(f"{r:.0f}" for r in ratio)
        + " times; printed: 10 to 20 times faster than SLIC"
    ]
    title = f"Table A.2, {PER_SEGMENT_PX} pixels a segment, {ITERATIONS} iterations"
    write_text(context.out / "table.txt", "\n".join([text_table(title, head, cells), *notes]) + "\n")
    _plot(context.out / "figure.png", rows)
    return {"title": title, "head": head, "rows": cells, "notes": notes, "times_ms": rows}


def _time(slic: Any, image: Any, n: int, seconds: float, options: dict[str, Any]) -> float:
    """Best time of a call, ms; at least 3 calls."""
    return times_ms(lambda: slic(image, n, COMPACTNESS, ITERATIONS, **options), seconds, 3)[0]


def _plot(path: Any, rows: dict[str, list[float]]) -> None:
    from sdftrack.viz.plots import figure, save_figure

    fig, ax = figure(size=(7.0, 4.5))
    pixels = [w * h for w, h in SIZES]
    for name, times in {**rows, **PRINTED}.items():
        ax.loglog(pixels, times, "o--" if name in PRINTED else "o-", label=name, linewidth=1.2)
    ax.set_xlabel("pixels")
    ax.set_ylabel("time (ms)")
    ax.legend(fontsize=8)
    save_figure(fig, path)
