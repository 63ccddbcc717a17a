# SPDX-License-Identifier: MIT
"""Section 4.6: time of the parts of a reconstruction at 200^3; and the curves of Figures 4.6, 4.7 and 4.8.

Set-up: the first frames of Figure 4.13 (b), 1 mm of noise, 640 x 480. Printed: tracking at about 100 Hz on a CPU; a
step of the level set 1.5 to 2 ms on a GTX 680, about 100 steps on the first frame and 10 to 20 on each later one. Ours
takes no steps: it adds a frame's evidence and brings the distances up to date where that has changed. "as printed" is
the thesis' evolution and tracker here, on the CPU (``evolution="printed"``, 100 steps and then 15).
"""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.growing import VOXELS, reconstructor, scene_of
from experiments.thesis.measures.rebuilt import rebuild
from sdftrack.evaluation.tables import text_table

__all__ = ["evidence", "run"]

FRAMES, SIGMA_M, WARM = 60, 0.001, 10
HEAD = ["part", "first frame, ms", "later, median ms", "processor ms", "printed"]
PARTS = {
    "tracking": ("track", "10 ms (100 Hz)"),
    "evidence and level set": ("fuse", "150-200 ms (100 steps), then 15-40 ms (10-20 steps), GTX 680"),
    "shape handed to the tracker": ("reshape", "-"),
    "all": ("all", "-"),
}
MEASURED = ("track", "fuse", "reshape")
WAYS = {"": None, ", as printed": 8.0}  # what is added to a part's name; sigma_d, voxels
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make it: figure.png (the curves), table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    scene = scene_of(context, FRAMES)
    n = len(scene.poses)
    seq = scene.frames(SIGMA_M)
    levels: list[dict[str, Any]] = []
    for way, sigma_d in WAYS.items():
        levels += _times(reconstructor(scene, seq, sigma_d), seq, n, way, context)
    cells = [
        [r["part"], _ms(r["first_ms"]), _ms(r["later_ms"]), _ms(r["cpu_ms"]), r["printed"]] for r in levels
    ]
    title = f"Section 4.6, {n} frames of {scene.name}, {VOXELS} voxels of {1e3 * scene.voxel_m:.2f} mm"
    notes = [
        f"tracking{way} at {1e3 / levels[k]['later_ms']:.0f} Hz, tracking and reconstruction at "
        f"{1e3 / levels[k + len(PARTS) - 1]['later_ms']:.1f} Hz"
        for way, k in zip(WAYS, range(0, len(levels), len(PARTS)), strict=True)
    ]
    write_text(context.out / "table.txt", "\n".join([text_table(title, HEAD, cells), *notes]) + "\n")
    _plot(context.out / "figure.png")
    return {"title": title, "head": HEAD, "rows": cells, "notes": notes, "levels": levels}


def _times(star: Any, seq: Any, n: int, way: str, context: Context) -> list[dict[str, Any]]:
    """One row for each part of a run."""
    spent: dict[Any, list[float]] = defaultdict(list)
    sums: dict[Any, float] = defaultdict(float)
    star._reshape = _timed(star._reshape, "reshape", sums)

    def told(i: int, result: Any) -> None:
        if i == 0:  # the tracker and the volume exist from now on
            star._volume.fuse = _timed(star._volume.fuse, "fuse", sums)
            star._tracker.track = _timed(star._tracker.track, "track", sums)
        for part in MEASURED:
            spent[part].append(sums.pop(part, math.nan))
            spent[part, "cpu"].append(sums.pop((part, "cpu"), math.nan))
        spent["all"].append(result.seconds)
        spent["all", "cpu"].append(sum(x for x in (spent[p, "cpu"][-1] for p in MEASURED) if x == x))
        context.step(i + 1, n, f"frames{way}")

    rebuild(star, seq, None, n, told)
    return [
        _level(name + way, spent[key], spent[key, "cpu"], printed) for name, (key, printed) in PARTS.items()
    ]


def _timed(call: Callable[..., Any], part: str, sums: dict[Any, float]) -> Callable[..., Any]:
    """The same function, its seconds added up, and those that all processors together have worked."""

    def timed(*args: Any, **more: Any) -> Any:
        begin, worked = time.perf_counter(), time.process_time()
        try:
            return call(*args, **more)
        finally:
            sums[part] += time.perf_counter() - begin
            sums[part, "cpu"] += time.process_time() - worked

    return timed


def _level(name: str, seconds: list[float], cpu: list[float], printed: str) -> dict[str, Any]:
    return {
        "part": name,
        "first_ms": 1e3 * seconds[0] if math.isfinite(seconds[0]) else None,
        "later_ms": _median_ms(seconds),
        "cpu_ms": _median_ms(cpu),
        "printed": printed,
    }


def _median_ms(seconds: list[float]) -> float | None:
    later = np.array(seconds[min(WARM, len(seconds) - 1) :])
    return 1e3 * float(np.nanmedian(later)) if np.isfinite(later).any() else None


def _ms(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"


def evidence(d_voxels: Array, sigma_d: float, noise_voxels: float | None) -> Array:
    """Likelihood that a voxel `d_voxels` behind the measurement is inside: printed (no noise), or the smooth form."""
    fades = np.exp(-np.abs(d_voxels) / sigma_d)
    if noise_voxels is None:
        printed: Array = 0.5 * (np.sign(d_voxels) * fades + 1)
        return printed
    erf = np.array([math.erf(d / (math.sqrt(2) * noise_voxels)) for d in d_voxels])
    smooth: Array = 0.5 * (np.clip(fades * erf, -0.9, 0.9) + 1)
    return smooth


def _plot(path: Any) -> None:
    from sdftrack.reconstruction.initialization import GUESS_FADES_VOXELS, printed_prior
    from sdftrack.reconstruction.options import ReconstructorOptions
    from sdftrack.viz.plots import figure, save_figure

    fig, axes = figure(1, 3, size=(13.0, 3.8))
    d = np.linspace(-40, 40, 801)
    for sigma_d in (4.0, 8.0, 20.0):
        axes[0].plot(d, evidence(d, sigma_d, None), label=f"printed, {sigma_d:g} voxels", linewidth=1.2)
    axes[0].plot(d, evidence(d, 8.0, 1.0), "k--", label="smooth, 8 voxels, noise 1", linewidth=1.2)
    axes[0].set(title="4.6: a voxel behind its measurement is inside", xlabel="voxels behind the measurement")
    guess = ReconstructorOptions().prior * np.tanh(-d / GUESS_FADES_VOXELS)
    axes[1].plot(d, 1 / (1 + np.exp(-guess)), label="ours: log ratio of 0.4 at most", linewidth=1.2)
    printed = printed_prior(d.astype(np.float32), 1.0)
    axes[1].plot(d, 1 / (1 + np.exp(-printed)), label="printed: a 0.5, sigma_G 4", linewidth=1.2)
    axes[1].set(title="4.7: first guess, inside", xlabel="voxels outside the guessed ball", ylim=(0, 1))
    for sigma_h in (2.0, 4.0, 8.0):
        axes[2].plot(d, 1 / (1 + np.exp(-d / sigma_h)), label=f"sigma_H {sigma_h:g}", linewidth=1.2)
    axes[2].set(title="4.8: H, outside", xlabel="distance (voxels)")
    for ax in axes:
        ax.legend(fontsize=8)
    save_figure(fig, path)
