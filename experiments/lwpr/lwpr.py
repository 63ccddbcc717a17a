# SPDX-License-Identifier: MIT
"""Regression by local models: known functions learnt from noisy samples."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.registry import experiment
from experiments.synth.functions import cross, cross_data, surface_data
from experiments.table import Table
from sdftrack.contour import LWPR

Array = NDArray[np.float64]
NOISE = 0.1  # sd of the samples' noise
SAMPLES = 20_000
WITHIN = 1.96  # standard deviations: 95 % of a normal distribution

# Changing these numbers breaks comparisons.
CROSS: dict[str, dict[str, Any]] = {
    "metric learnt": {"init_D": 300, "w_cutoff": 0.1, "init_alpha": 200, "penalty": 1e-9},
    "metric fixed": {"init_D": 300, "w_cutoff": 0.1, "update_D": False},
    "coarse, learnt": {"init_D": 100, "w_cutoff": 0.1, "init_alpha": 500, "penalty": 1e-9},
    "coarse, fixed": {"init_D": 100, "w_cutoff": 0.1, "update_D": False},
    "fine, fixed": {"init_D": 800, "w_cutoff": 0.1, "update_D": False},
}
SURFACE: dict[str, dict[str, Any]] = {
    "diagonal metric learnt": {"init_D": 20, "diagonal": True, "w_cutoff": 0.02, "init_alpha": 200},
    "full metric learnt": {"init_D": 20, "w_cutoff": 0.02, "init_alpha": 200, "penalty": 0},
    "metric fixed": {"init_D": 20, "w_cutoff": 0.02, "diagonal": True, "update_D": False},
}


def measure(
    make: Any, places: Array, truth: Array, options: dict[str, Any], seed: int, repeats: int
) -> dict[str, Any]:
    """Learn `SAMPLES` noisy samples of `make`, judge at `places`; times are the least of `repeats`."""
    x, y = make(seed, SAMPLES)
    y = y + np.random.default_rng(seed + 1000).normal(0, NOISE, y.shape)
    update_s, predict_s = [], []
    for _ in range(repeats):
        model = LWPR(threads=1, **options)
        start = time.process_time()
        model.update(x, y)
        update_s.append(time.process_time() - start)
        start = time.process_time()
        model.predict(x)
        predict_s.append(time.process_time() - start)
    mean, sd = model.predict(places, confidence=True)
    error = (mean - truth) ** 2
    return {
        "nmse": (error.mean(axis=0) / truth.var(axis=0)).tolist(),
        "fields": float(np.mean(model.n_fields)),
        "within": 100 * float(np.mean(np.sqrt(error) < WITHIN * sd)),
        "update_us": 1e6 * min(update_s) / SAMPLES,
        "predict_us": 1e6 * min(predict_s) / SAMPLES,
    }


def _table(
    title: str,
    cases: dict[str, dict[str, Any]],
    make: Any,
    places: Array,
    truth: Array,
    seeds: int,
    repeats: int,
) -> Table:
    rows: dict[str, Any] = {}
    cells = []
    for name, options in cases.items():
        runs = [measure(make, places, truth, options, seed, repeats) for seed in range(seeds)]
        nmse = np.array([run["nmse"] for run in runs])
        row = {
            "options": options, "nmse_mean": float(nmse.mean()), "nmse_worst_run": float(nmse.mean(axis=1).max()),
            "nmse_worst_output": float(nmse.mean(axis=0).max()),
            "fields": float(np.mean([run["fields"] for run in runs])),
            "within_percent": float(np.mean([run["within"] for run in runs])),
            "update_us": min(run["update_us"] for run in runs),
            "predict_us": min(run["predict_us"] for run in runs),
        }  # fmt: skip
        rows[name] = row
        cells.append([
            name, f"{row['nmse_mean']:.4f}", f"{row['nmse_worst_run']:.4f}", f"{row['nmse_worst_output']:.4f}",
            f"{row['fields']:.0f}", f"{row['within_percent']:.0f} %", f"{row['update_us']:.2f}",
            f"{row['predict_us']:.2f}",
        ])  # fmt: skip
    head = [
        "settings", "nMSE", "worst run", "worst output", "fields", "in 1.96 sd", "update us", "predict us",
    ]  # fmt: skip
    notes = [
        f"  {name}: {', '.join(f'{k}={v}' for k, v in options.items())}" for name, options in cases.items()
    ]
    return Table(title, head, cells, notes, rows)


@experiment(
    "lwpr",
    chosen_on="the cross, seeds 0 to 4 (metrics and penalties of each row)",
    reported_on="the cross and the surface, seeds 0 to 4: the same draws",
    short={"seeds": 1, "repeats": 1},
)
def lwpr(*, seeds: int = 5, repeats: int = 10) -> list[Table]:
    """Regression by local models: how well two known functions are learnt from noisy samples, and how fast.

    The cross (2 inputs, 1 output) and a curved surface of two dimensions in ten (10 inputs, 5 outputs): the mean
    squared error on places without noise as a share of the variance of the function (nMSE), the fields, the share of
    places whose truth lies within 1.96 of the stated standard deviations, and the processor's time of a sample on one
    core.

    Parameters
    ----------
    seeds
        draws of the samples
    repeats
        of the timing; the least counts
    """
    line = np.linspace(-1, 1, 41)
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    places, truth = surface_data(10_000, 4000)
    drawn = f"{SAMPLES} samples, noise {NOISE}, {seeds} draws"
    return [
        _table(f"Cross, {drawn}, 41 x 41 places", CROSS, cross_data, grid, cross(grid), seeds, repeats),
        _table(
            f"10 -> 5 on a surface of 2 dimensions, {drawn}, 4000 places",
            SURFACE, surface_data, places, truth, seeds, repeats,
        ),
    ]  # fmt: skip
