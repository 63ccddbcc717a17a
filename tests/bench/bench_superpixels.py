# SPDX-License-Identifier: MIT
"""Superpixels of a made picture and of photographs, 256 pixels a segment, 5 iterations.

Changing these numbers breaks comparisons. Photographs: where SDFTRACK_DATA has them.
"""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from harness import benchmark

import sdftrack as st
from experiments.superpixels.times import PHOTOGRAPHS, photographs
from sdftrack.synth import region_picture


def cutting(width: int, height: int, **given: object) -> Callable[[], object]:
    image = region_picture(height, width)[0]
    return lambda: st.superpixels.slic(image, width * height // 256, device="cpu", **given)  # type: ignore[arg-type]


@benchmark("superpixels/640x480_one_thread", items=640 * 480, unit="pixel")
def one_thread() -> Callable[[], object]:
    return cutting(640, 480, threads=1)


@benchmark("superpixels/640x480_all_cores", items=640 * 480, unit="pixel")
def all_cores() -> Callable[[], object]:
    return cutting(640, 480)


@benchmark("superpixels/3840x2160_all_cores", items=3840 * 2160, unit="pixel")
def large() -> Callable[[], object]:
    return cutting(3840, 2160)


@benchmark("superpixels/640x480_thesis_distance", items=640 * 480, unit="pixel")
def thesis_distance() -> Callable[[], object]:
    return cutting(640, 480, threads=1, distance="thesis")


def photograph(name: str, threads: int) -> Callable[[], object]:
    image = photographs(Path(os.environ["SDFTRACK_DATA"]))[name]
    return lambda: st.superpixels.slic(image, 1200, threads=threads, device="cpu")


if (Path(os.environ.get("SDFTRACK_DATA", "")) / "bsds" / "images").is_dir():
    for name in PHOTOGRAPHS:
        for threads in (1, 2):
            benchmark(f"superpixels/{name}_{threads}_threads", items=640 * 480, unit="pixel")(
                partial(photograph, name, threads)
            )
