# SPDX-License-Identifier: MIT
"""Time and memory of superpixels, beside other programs where they are installed."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.region_picture import region_picture
from experiments.table import Table

Array = NDArray[Any]
Run = Callable[[], object]
SIZES = ((640, 480), (1920, 1080), (3840, 2160))
ITERATIONS = 5
PER_SEGMENT_PX = 256  # 1,200 segments at 640 x 480
# Fixed: the first, all leaves, has the most regions of the 20, the last the fewest.
PHOTOGRAPHS = {
    "leaves": "140055", "trees": "76002", "water": "43083", "bear": "100075", "giraffes": "253036",
}  # fmt: skip


def times_ms(run: Run, seconds: float = 2.0, least: int = 5) -> tuple[float, float, float]:
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


def photographs(folder: Path) -> dict[str, Array]:
    """Five photographs of BSDS500, (480, 640, 3), enlarged by cubic splines; ValueError where they are not there."""
    import cv2

    root = folder / "bsds" if (folder / "bsds").is_dir() else folder
    made = {}
    for name, stem in PHOTOGRAPHS.items():
        read = cv2.imread(str(root / "images" / f"{stem}.jpg"))
        if read is None:
            raise ValueError(f"photographs: expected {root / 'images' / stem}.jpg, which is not there")
        large = cv2.resize(read, SIZES[0], interpolation=cv2.INTER_CUBIC)
        made[name] = np.ascontiguousarray(large[..., ::-1])
    return made


def memory(image: Array) -> float:
    """Bytes a pixel of a call beyond the image, labels among them."""
    from sdftrack import _core

    work, options = _core.SlicWork(), _core.SlicOptions()
    options.n_segments = image.shape[0] * image.shape[1] // PER_SEGMENT_PX
    labels = work.run(image, options, None, None, False, 0, -1)[0]
    return float((work.bytes + labels.nbytes) / labels.size)


def _ours() -> dict[str, Callable[[Array, int], Run]]:
    import sdftrack as st

    def with_threads(threads: int) -> Callable[[Array, int], Run]:
        return lambda image, n: lambda: st.superpixels.slic(
            image, n, max_num_iter=ITERATIONS, threads=threads, device="cpu"
        )

    ways = {"one thread": with_threads(1), "two threads": with_threads(2)}
    if st.cuda_available():
        ways["GPU"] = lambda image, n: lambda: st.superpixels.slic(
            image, n, max_num_iter=ITERATIONS, device="cuda"
        )
    return ways


def _others(image: Array, n: int) -> dict[str, Run]:
    """What is installed: scikit-image always; OpenCV's contributed SLIC and fast-slic where they can be imported."""
    import cv2
    from skimage.segmentation import slic

    found: dict[str, Run] = {"scikit-image": partial(slic, image, n, max_num_iter=ITERATIONS)}
    contrib: Any = getattr(cv2, "ximgproc", None)
    if contrib is not None:
        side = round(float(np.sqrt(image.shape[0] * image.shape[1] / n)))

        def opencv() -> object:
            lab = cv2.cvtColor(image, cv2.COLOR_RGB2Lab)
            cut = contrib.createSuperpixelSLIC(lab, contrib.SLIC, side, 10.0)
            cut.iterate(ITERATIONS)
            cut.enforceLabelConnectivity(25)
            return cut.getLabels()

        found["OpenCV contrib"] = opencv
    try:
        fast_slic = importlib.import_module("fast_slic.avx2").SlicAvx2
    except ImportError:
        return found
    cut = fast_slic(
        num_components=n, compactness=10, num_threads=1
    )  # looks at a third of the rows in a round
    found["fast-slic"] = lambda: cut.iterate(image, max_iter=ITERATIONS)
    return found


def speed(data: Path | None, quick: bool) -> list[Table]:
    """Times of the made picture at three sizes and of the photographs, how they grow, and the memory of a call."""
    pictures = {f"made {w} x {h}": region_picture(h, w)[0] for w, h in SIZES}
    if data is not None:
        pictures.update(photographs(data))
    small = pictures[f"made {SIZES[0][0]} x {SIZES[0][1]}"]
    rows: dict[str, Any] = {}
    cells = []
    for picture_name, image in pictures.items():
        n = image.shape[0] * image.shape[1] // PER_SEGMENT_PX
        made = {name: times_ms(way(image, n)) for name, way in _ours().items()}
        if not quick or image is small:
            made.update({name: times_ms(run, 0.0, 3) for name, run in _others(image, n).items()})
        rows[picture_name] = made
        cells += [
            [f"{picture_name}, {n}, {name}", *(f"{t:.2f}" for t in times)] for name, times in made.items()
        ]
    title = f"Time of a call, ms, {ITERATIONS} iterations of every pixel, connectivity included"
    head = ["picture, segments, way", "best", "median", "processor"]
    return [Table(title, head, cells, numbers=rows), _exponents(rows), _memories(pictures)]


def _exponents(rows: dict[str, Any]) -> Table:
    slope = {}
    for what, sizes in (("all sizes", SIZES), ("the two large ones", SIZES[1:])):
        pixels = np.log([w * h for w, h in sizes])
        for k in _ours():
            spent = [rows[f"made {w} x {h}"][k][2] for w, h in sizes]
            slope[f"{k}, {what}"] = float(np.polyfit(pixels, np.log(spent), 1)[0])
    cells = [[name, f"{value:.3f}"] for name, value in slope.items()]
    return Table(
        "Exponent of the processor's time in the number of pixels", ["way, sizes", "exponent"], cells
    )


def _memories(pictures: dict[str, Array]) -> Table:
    width, height = SIZES[0]
    all_of = {k: v for k, v in pictures.items() if v.shape[:2] == (height, width)}
    all_of["noise"] = np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)
    cells = [[name, f"{memory(image):.1f}"] for name, image in all_of.items()]
    return Table(
        f"Memory of a call, {width} x {height}, labels included", ["picture", "bytes a pixel"], cells
    )
