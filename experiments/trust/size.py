# SPDX-License-Identifier: MIT
"""An object of another size than its model: named, with an interval that contains it, or not."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import sdftrack as st
from experiments.common.protocol import load_mesh, load_sdf, say
from experiments.registry import experiment
from experiments.table import Table, cells

TEST = ("lm_cat", "lm_duck", "lm_ape", "lm_can")
SCALES = (0.9, 0.95, 0.97, 1.0, 1.03, 1.05, 1.1, 1.2)
SEEDS = (21, 22, 23)  # chosen on seed 11
FRAMES, VOXELS, NOISE_M = 30, 90, 0.001
FREE_SCALES = (0.6, 0.9, 1.0, 1.2, 2.0)
NOISES: dict[str, Any] = {"white 1 mm": NOISE_M, "kinect": "kinect", "stereo": "stereo"}
INTERVAL = re.compile(r"([\d.]+) % (larger|smaller) than the model \(([\d.]+) to ([\d.]+)\)")
COLUMNS = {
    "true size": "name",
    "runs": "runs",
    "ok %": "ok:.1f",
    "weak %": "weak:.1f",
    "lost %": "lost:.1f",
    "named": "named",
    "interval holds": "holds",
    "median off mm": "off_mm:.2f",
    "ok beyond 5 sd %": "beyond:.1f",
}

FREE_COLUMNS = {
    "noise": "noise",
    "true scale": "scale",
    "runs": "runs",
    "ok %": "ok:.1f",
    "interval holds": "holds",
    "median off %": "off:.2f",
    "largest off %": "most:.2f",
    "position off mm": "off_mm:.2f",
    "ok beyond 5 sd %": "beyond:.1f",
}


@experiment(
    "trust.size",
    needs=["meshes"],
    chosen_on="lm_driller, bunny, spot, seed 11",
    reported_on="lm_cat, lm_duck, lm_ape, lm_can, seeds 21 to 23",
    short={"only": ("lm_duck",), "seeds": SEEDS[:1], "frames": 6},
)
def other_sizes(
    *,
    data: Path,
    only: tuple[str, ...] = TEST,
    seeds: tuple[int, ...] = SEEDS,
    frames: int = FRAMES,
    threads: int = 1,
    cache: Path | None = None,
) -> Table:
    """Status of an object of 0.9 to 1.2 times the size of its model, by depth alone with white noise of 1 mm.

    Parameters
    ----------
    seeds
        of the path and the noise; each mesh at each size is one run
    frames
        of a run
    """
    models = {name: load_mesh(data, name) for name in only}
    sdfs = {name: load_sdf(mesh, name, VOXELS, cache) for name, mesh in models.items()}
    rows: dict[str, Any] = {}
    for scale in SCALES:
        runs = [
            _run(models[name], sdfs[name], scale, seed, frames, threads) for name in only for seed in seeds
        ]
        key = f"{scale:.2f}"
        rows[key] = {
            "runs": len(runs),
            **{s: 100 * float(np.mean([run[s] for run in runs])) for s in ("ok", "weak", "lost")},
            "named": sum(bool(run["interval"]) for run in runs),
            "holds": sum(_holds(run["interval"], scale) for run in runs),
            "off_mm": float(np.nanmedian([run["off_mm"] for run in runs])),
            "beyond": 100 * float(np.mean([run["beyond"] for run in runs])),
        }
        say("  ".join(cells(COLUMNS, {"name": key, **rows[key]})))
    return Table.of("Another size than the model's", COLUMNS, rows)


def _run(mesh: Any, sdf: Any, scale: float, seed: int, frames: int, threads: int) -> dict[str, Any]:
    sequence = _enlarged(mesh, scale, frames, NOISE_M, seed, color=False)
    tracker = st.Tracker(sdf, sequence.camera, mode="depth", threads=threads)
    counts, off_mm, beyond, interval = dict.fromkeys(("ok", "weak", "lost"), 0), [], 0, None
    for result, off in _followed(tracker, sequence, poses=[sequence.ground_truth[0][0]]):
        counts[str(result.status[0].value)] += 1
        interval = INTERVAL.search(result.reason[0]) or interval
        off_mm.append(1e3 * float(np.linalg.norm(off)))
        beyond += _is_ok_beyond_5_sd(result, off)
    return {
        **{name: count / frames for name, count in counts.items()},
        "off_mm": float(np.nanmedian(off_mm)),
        "beyond": beyond / frames,
        "interval": interval,
    }


def _enlarged(mesh: Any, scale: float, frames: int, noise: Any, seed: int, color: bool = True) -> Any:
    """A sequence of the mesh at this scale."""
    walk = st.synth.random_walk(step_m=0.004, step_rad=0.03)
    seen = st.Mesh(scale * mesh.vertices, mesh.faces)
    return st.synth.sequence(
        seen, frames, trajectory=walk, noise=noise, clutter="objects", seed=seed, color=color
    )


def _followed(tracker: Any, sequence: Any, **start: Any) -> Iterator[tuple[Any, Any]]:
    """The result of each frame, and the error of its position (m)."""
    for i, frame in enumerate(sequence):
        result = tracker.track(frame) if i else tracker.start(frame, **start)
        yield result, result.pose[:3, 3] - sequence.ground_truth[i][0][:3, 3]


def _is_ok_beyond_5_sd(result: Any, off: Any) -> bool:
    return bool(result.ok and off @ np.linalg.solve(result.covariance[:3, :3], off) > 3 * 5**2)


def _holds(interval: re.Match[str] | None, scale: float) -> bool:
    """Whether the last interval that was stated contains the true size."""
    if interval is None:
        return False
    sign = 1 if interval[2] == "larger" else -1
    return float(interval[3]) <= 100 * sign * (scale - 1) <= float(interval[4])


@experiment(
    "trust.free_scale",
    needs=["meshes"],
    chosen_on="lm_driller, bunny, seed 11",
    reported_on="lm_cat, lm_duck, lm_ape, lm_can, seed 21",
    short={"only": ("lm_duck",), "scales": (1.2,), "frames": 4},
)
def free_scales(
    *,
    data: Path,
    only: tuple[str, ...] = TEST,
    scales: tuple[float, ...] = FREE_SCALES,
    frames: int = FRAMES,
    threads: int = 1,
    cache: Path | None = None,
) -> Table:
    """Scale of an object of which only the form is known, after a start from its mask, by depth and colour.

    Parameters
    ----------
    frames
        of a run; the scale is that after the last one
    """
    models = {name: load_mesh(data, name) for name in only}
    sdfs = {name: load_sdf(mesh, name, VOXELS, cache) for name, mesh in models.items()}
    rows: dict[str, Any] = {}
    for label, noise in NOISES.items():
        for scale in scales:
            runs = [_free_run(models[name], sdfs[name], scale, noise, frames, threads) for name in only]
            off = [100 * abs(run["scale"] / scale - 1) for run in runs]
            key = f"{label} {scale:.2f}"
            rows[key] = {
                "noise": label,
                "scale": f"{scale:.2f}",
                "runs": len(runs),
                "holds": sum(run["holds"] for run in runs),
                "off": float(np.median(off)),
                "most": max(off),
                **{k: float(np.mean([run[k] for run in runs])) for k in ("ok", "off_mm", "beyond")},
            }
            say("  ".join(cells(FREE_COLUMNS, rows[key])))
    return Table.of("A scale that is free", FREE_COLUMNS, rows)


def _free_run(mesh: Any, sdf: Any, scale: float, noise: Any, frames: int, threads: int) -> dict[str, Any]:
    sequence = _enlarged(mesh, scale, frames, noise, SEEDS[0])
    tracker = st.Tracker(sdf, sequence.camera, threads=threads, scale="free")
    ok, off_m, beyond = 0, [], 0
    for result, off in _followed(tracker, sequence, masks=sequence.masks(0)[0]):
        ok += result.ok
        off_m.append(float(np.linalg.norm(off)))
        beyond += _is_ok_beyond_5_sd(result, off)
    found = tracker.scales[0]
    assert found is not None
    return {
        "scale": found.scale,
        "holds": found.interval95[0] <= scale <= found.interval95[1],
        "ok": 100 * ok / frames,
        "off_mm": 1e3 * float(np.nanmedian(off_m)),
        "beyond": 100 * beyond / frames,
    }
