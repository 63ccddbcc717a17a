# SPDX-License-Identifier: MIT
"""Section 4.6: time of the parts of a reconstruction at 200^3; and the curves of Figures 4.6, 4.7 and 4.8."""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.bodies import VOXELS
from experiments.pictures import Line, Panel, curves
from experiments.progress import step
from experiments.reconstruction.growing import reconstructor, scene_of
from experiments.reconstruction.rebuilt import rebuild
from experiments.registry import experiment
from experiments.table import Table

SIGMA_M, WARM = 0.001, 10
GUESS_FADES_VOXELS = 4.0  # sigma_G of Eq. 4.34
PARTS = {
    "tracking": ("track", "10 ms (100 Hz)"),
    "evidence and level set": ("fuse", "150-200 ms (100 steps), then 15-40 ms (10-20 steps), GTX 680"),
    "shape handed to the tracker": ("reshape", None),
    "all": ("all", None),
}
WAYS = {"": None, ", as printed": 8.0}  # what is added to a part's name; sigma_d, voxels
Array = NDArray[np.float64]


@experiment(
    "thesis.4.6", chosen_on="nothing: times", reported_on="the built-in duck, seed 0", short={"frames": 3}
)
def parts(*, frames: int = 60, mesh: Path | None = None, unit: str | None = None, threads: int = 0) -> Table:
    """Section 4.6: time of the parts of a reconstruction, and the curves of 4.6 to 4.8.

    The first frames of Figure 4.13 (b), 1 mm of noise, 640 x 480. Printed: tracking at about 100 Hz on a CPU; a step of
    the level set 1.5 to 2 ms on a GTX 680, about 100 steps on the first frame and 10 to 20 on each later one. Ours
    takes no steps: it adds a frame's evidence and brings the distances up to date where that has changed. "as printed"
    is the thesis' evolution and tracker here, on the CPU (``evolution="printed"``, 100 steps and then 15).

    Parameters
    ----------
    mesh
        instead of the built-in duck
    unit
        of the mesh
    """
    scene = scene_of(mesh, unit, frames, threads)
    seq = scene.frames(SIGMA_M)
    rows: list[dict[str, Any]] = []
    notes = []
    for way, sigma_d in WAYS.items():
        own = _times(reconstructor(scene, seq, sigma_d), seq, frames, way)
        rows += own
        track_hz, all_hz = (1e3 / own[k]["later_ms"] for k in (0, -1))
        notes.append(f"tracking{way} at {track_hz:.0f} Hz, tracking and reconstruction at {all_hz:.1f} Hz")
    columns = {"part": "part", "first frame, ms": "first_ms:.1f", "later, median ms": "later_ms:.1f"}
    return Table.of(
        f"Section 4.6, {frames} frames of {scene.body.name}, {VOXELS} voxels of {1e3 * scene.voxel_m:.2f} mm",
        {**columns, "processor ms": "cpu_ms:.1f", "printed": "printed"},
        rows,
        notes=notes,
        picture=_curves,
    )


def _times(star: Any, seq: Any, n: int, way: str) -> list[dict[str, Any]]:
    """One row for each part of a run."""
    spent: dict[str, list[float]] = defaultdict(list)

    def told(i: int, result: Any) -> None:
        for part, seconds in star._session.part_seconds.items():
            spent[part].append(seconds or math.nan)
        spent["all"].append(result.seconds)
        step(i + 1, n, f"frames{way}")

    live = rebuild(star, seq, None, n, told)
    return [
        {
            "part": name + way,
            "first_ms": 1e3 * spent[key][0] if math.isfinite(spent[key][0]) else None,
            "later_ms": _median_ms(spent[key]),
            "cpu_ms": _median_ms(list(live.cpu_seconds)) if key == "all" else None,
            "printed": printed,
        }
        for name, (key, printed) in PARTS.items()
    ]


def _median_ms(seconds: list[float]) -> float | None:
    later = np.array(seconds[min(WARM, len(seconds) - 1) :])
    return 1e3 * float(np.nanmedian(later)) if np.isfinite(later).any() else None


def evidence(d_voxels: Array, sigma_d: float, noise_voxels: float | None) -> Array:
    """Likelihood that a voxel `d_voxels` behind the measurement is inside: printed (no noise), or the smooth form."""
    fades = np.exp(-np.abs(d_voxels) / sigma_d)
    if noise_voxels is None:
        printed: Array = 0.5 * (np.sign(d_voxels) * fades + 1)
        return printed
    erf = np.array([math.erf(d / (math.sqrt(2) * noise_voxels)) for d in d_voxels])
    smooth: Array = 0.5 * (np.clip(fades * erf, -0.9, 0.9) + 1)
    return smooth


def _curves() -> Any:
    from sdftrack.reconstruction.options import ReconstructorOptions

    d = np.linspace(-40, 40, 801)
    near = [Line(d, evidence(d, s, None), f"printed, {s:g} voxels") for s in (4.0, 8.0, 20.0)]
    near.append(
        Line(d, evidence(d, 8.0, 1.0), "smooth, 8 voxels, noise 1", {"color": "k", "linestyle": "--"})
    )
    ours = ReconstructorOptions().prior * np.tanh(-d / GUESS_FADES_VOXELS)
    inside = 0.5 / (1 + np.exp(d / 4)) + 0.25  # thesis (4.34)
    guesses: dict[str, NDArray[Any]] = {
        "ours: log ratio of 0.4 at most": ours,
        "printed: a 0.5, sigma_G 4": np.log(inside / (1 - inside)),
    }
    guess = [Line(d, 1 / (1 + np.exp(-ratio)), label) for label, ratio in guesses.items()]
    outside = [Line(d, 1 / (1 + np.exp(-d / s)), f"sigma_H {s:g}") for s in (2.0, 4.0, 8.0)]
    titles = (
        ("4.6: a voxel behind its measurement is inside", "voxels behind the measurement"),
        ("4.7: first guess, inside", "voxels outside the guessed ball"),
        ("4.8: H, outside", "distance (voxels)"),
    )
    panels = [
        Panel(lines, {"title": title, "xlabel": label})
        for lines, (title, label) in zip((near, guess, outside), titles, strict=True)
    ]
    return curves([panels], (13.0, 3.8))
