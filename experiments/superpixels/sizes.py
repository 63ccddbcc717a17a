# SPDX-License-Identifier: MIT
"""Tables A.2 and A.3: times of superpixels for three sizes of image, whole and by parts."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np

import sdftrack as st
from experiments.options import NO_SETTINGS, Settings
from experiments.pictures import Line, Panel, curves
from experiments.progress import step
from experiments.registry import experiment
from experiments.superpixels.times import ITERATIONS, PER_SEGMENT_PX, times_ms
from experiments.synth.region_picture import region_picture
from experiments.table import Table
from sdftrack.device import CPU, resolve_device

SIZES = ((320, 240), (640, 480), (1280, 960))
NAMES = [f"{w} x {h}" for w, h in SIZES]
COMPACTNESS = 10.0
SEGMENTS = [w * h // PER_SEGMENT_PX for w, h in SIZES]
A_2 = {"printed gSLIC": (9, 21, 86), "printed SLIC": (88, 354, 1522)}
A_3 = {"printed k-means": (6.5, 13, 53), "printed connectivity": (2.5, 8, 33)}
TITLE = f"{PER_SEGMENT_PX} pixels a segment, {ITERATIONS} iterations"


@experiment(
    "thesis.table.A.2",
    chosen_on="nothing: times",
    reported_on="a made picture",
    short={"seconds": 0.1},
)
def sizes(*, seconds: float = 1.5, threads: int = 0) -> Table:
    """Table A.2: times of superpixels at three sizes of image.

    A made picture (`synth.region_picture`), 256 pixels a segment (1,200 at 640 x 480), compactness 10, 5 iterations,
    connectivity included; picture, segments, compactness and iterations are not printed in the thesis. Its "SLIC" is
    the authors' program on one core of an i7-2600, its gSLIC ran on a GTX 460.

    Parameters
    ----------
    seconds
        of each number, which is the best of as many calls
    """
    from skimage.segmentation import slic as theirs

    ways: dict[str, Any] = {
        "one core": partial(st.superpixels.slic, threads=1, device="cpu"),
        "all cores": partial(st.superpixels.slic, threads=threads, device="cpu"),
        **({"GPU": partial(st.superpixels.slic, device="cuda")} if st.cuda_available() else {}),
        "scikit-image": theirs,
    }
    times: dict[str, list[float]] = {name: [] for name in ways}
    for k, (width, height) in enumerate(SIZES):
        image = region_picture(height, width)[0]
        for name, slic in ways.items():
            call = partial(slic, image, SEGMENTS[k], COMPACTNESS, ITERATIONS)
            times[name].append(times_ms(call, 0.0 if slic is theirs else seconds, 3)[0])
        step(k + 1, len(SIZES), NAMES[k])
    ratio = np.array(times["scikit-image"]) / np.array(times["all cores"])
    faster = ", ".join(f"{r:.0f}" for r in ratio)
    note = f"faster than scikit-image: {faster} times; printed: 10 to 20 times faster than SLIC"
    return _table(f"Table A.2, {TITLE}", "best time, ms", times, A_2, note)


@experiment(
    "thesis.table.A.3", chosen_on="nothing: times", reported_on="a made picture", short={"seconds": 0.1}
)
def parts(*, seconds: float = 1.5, options: Settings = NO_SETTINGS) -> Table:
    """Table A.3: times of their parts: k-means, connectivity.

    The set-up of Table A.2; one thread, least times of many calls, "k-means" with colours and centres. On a GPU it is a
    call without connectivity, and "connectivity" what a call with it takes more. In the thesis k-means ran on the GPU
    and connectivity, by recursion, on the CPU.

    Parameters
    ----------
    options
        device: cpu, cuda or auto
    seconds
        of each number, which is the best of as many calls
    """
    used = resolve_device(options.get("device", "auto"))
    times: dict[str, list[float]] = {f"k-means ({used})": [], f"connectivity ({used})": []}
    for k, (width, height) in enumerate(SIZES):
        image = region_picture(height, width)[0]
        for name, least in zip(times, _parts(image, SEGMENTS[k], used, seconds), strict=True):
            times[name].append(least)
        step(k + 1, len(SIZES), NAMES[k])
    note = "printed: k-means on a GPU, connectivity on the CPU by recursion"
    return _table(f"Table A.3, {TITLE}", "least time, ms", times, A_3, note)


def _parts(image: Any, n: int, device: str, seconds: float) -> tuple[float, float]:
    """Least times of k-means and of connectivity, ms."""
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


def _table(title: str, head: str, times: dict[str, list[float]], printed: dict[str, Any], note: str) -> Table:
    rows = [[name, *(f"{t:.2f}" for t in some)] for name, some in times.items()]
    rows += [[name, *(f"{t:g}" for t in some)] for name, some in printed.items()]
    return Table(
        title, [head, *NAMES], rows, [note], times, picture=lambda: _picture({**times, **printed}, printed)
    )


def _picture(times: dict[str, Any], printed: dict[str, Any]) -> Any:
    pixels = [w * h for w, h in SIZES]
    lines = [
        Line(pixels, some, name, {"marker": "o", "linestyle": "--" if name in printed else "-"})
        for name, some in times.items()
    ]
    log = {"xscale": "log", "yscale": "log", "xlabel": "pixels", "ylabel": "time (ms)"}
    return curves([[Panel(lines, log)]], (7.0, 4.5))
