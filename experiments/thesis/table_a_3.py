# SPDX-License-Identifier: MIT
"""Table A.3: the parts of the time of superpixels, k-means and connectivity, for three sizes of image.

Set-up: that of Table A.2; one thread, least times of many calls, "k-means" with colours and centres. On a GPU it is a
call without connectivity, and "connectivity" what a call with it takes more. In the thesis k-means ran on the GPU
and connectivity, by recursion, on the CPU.
"""

from __future__ import annotations

import time
from functools import partial
from typing import Any

from experiments.thesis import Context
from experiments.thesis.measures.call_times import PER_SEGMENT_PX, times_ms
from experiments.thesis.table_a_2 import COMPACTNESS, ITERATIONS, QUICK_SECONDS, SECONDS, SIZES
from sdftrack.device import CPU, resolve_device
from sdftrack.evaluation.tables import text_table

__all__ = ["run"]

PRINTED = {"k-means": (6.5, 13, 53), "connectivity": (2.5, 8, 33)}


def run(context: Context) -> dict[str, Any]:
    """Make the table: table.txt, and the numbers."""
    from experiments.synth.region_picture import region_picture
    from sdftrack._internal.files import write_text

    used = resolve_device(context.options.get("device", "auto"))
    seconds = SECONDS if context.frames is None else QUICK_SECONDS
    rows: dict[str, list[float]] = {"k-means": [], "connectivity": []}
    for k, (width, height) in enumerate(SIZES):
        image, n = region_picture(height, width)[0], width * height // PER_SEGMENT_PX
        for name, least in zip(rows, _parts(image, n, used, seconds), strict=True):
            rows[name].append(least)
        context.step(k + 1, len(SIZES), f"{width} x {height}")
    head = ["least time, ms", *(f"{w} x {h}" for w, h in SIZES)]
    cells = [[f"{name} ({used})", *(f"{t:.2f}" for t in times)] for name, times in rows.items()]
    cells += [[f"printed {name}", *(f"{t:g}" for t in times)] for name, times in PRINTED.items()]
    title = f"Table A.3, {PER_SEGMENT_PX} pixels a segment, {ITERATIONS} iterations"
    notes = ["printed: k-means on a GPU, connectivity on the CPU by recursion"]
    write_text(context.out / "table.txt", "\n".join([text_table(title, head, cells), *notes]) + "\n")
    return {"title": title, "head": head, "rows": cells, "notes": notes, "times_ms": rows}


def _parts(image: Any, n: int, device: str, seconds: float) -> tuple[float, float]:
    """Least times of k-means and of connectivity, ms."""
    import sdftrack as st
    from sdftrack import _core

    if device != "cpu":
        call_of = partial(st.superpixels.slic, image, n, COMPACTNESS, ITERATIONS, device=device)
        whole, part = (
            times_ms(partial(call_of, enforce_connectivity=connected), seconds)[0]
            for connected in (True, False)
        )
        return part, max(whole - part, 0.0)
    work, options = _core.SlicWork(), _core.SlicOptions()
    options.n_segments, options.compactness, options.max_iterations = n, COMPACTNESS, ITERATIONS
    kmeans: list[float] = []
    connecting: list[float] = []

    def call() -> None:
        began = time.perf_counter()
        connect_s = work.run(image, options, None, None, False, 1, CPU)[4]
        kmeans.append(1e3 * (time.perf_counter() - began - connect_s))
        connecting.append(1e3 * connect_s)

    times_ms(call, seconds)
    return min(kmeans), min(connecting)
