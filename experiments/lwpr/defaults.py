# SPDX-License-Identifier: MIT
"""Regression by local models as it is called first: without settings."""

from __future__ import annotations

import time
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.lwpr.functions import CHOSEN_ON, REPORTED_ON, Case
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour import LWPR

Array = NDArray[np.float64]
PLACES, WITHIN = 3000, 1.96
FIRST_SEED = {"chosen": 1, "held out": 100}
OTHER_NUMBERS = {
    f"{name}, {count} samples": REPORTED_ON[name]._replace(samples=count, target=np.nan)
    for name in ("Friedman 1, 10 inputs", "two-link arm, 6 inputs")
    for count in (300, 1000, 12_000)
}
EARLIER: dict[str, Any] = {"init_D": 25.0}  # the rest follows: what LWPR() was
WAYS: dict[str, tuple[dict[str, Any], int]] = {
    "defaults": ({}, 1),
    "defaults, data 3 times": ({}, 3),
    "metric learnt": ({"update_D": True, "norm_out": "auto", "init_alpha": 1.0}, 1),
    "as before": (EARLIER, 1),
}


def runs(case: Case, options: dict[str, Any], passes: int, seeds: range) -> dict[str, float]:
    """Means over draws: nMSE at places without noise, its worst draw, fields, truth within 1.96 sd, time."""
    rows = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        x = case.places(rng, case.samples)
        y = case.value(x)
        y = y + rng.normal(0, case.noise, y.shape)
        ask = case.places(rng, PLACES)
        truth = case.value(ask)
        model = LWPR(threads=1, **options)
        start = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # as many fields as samples: in the table
            for _ in range(passes):
                model.update(x, y)
        seconds = time.process_time() - start
        mean, sd = model.predict(ask, confidence=True)
        nmse = float(np.mean(((mean - truth) ** 2).mean(axis=0) / truth.var(axis=0)))
        within = 100 * float(np.mean(np.abs(mean - truth) < WITHIN * sd))
        rows.append([nmse, nmse, float(np.mean(model.n_fields)), within, 1e6 * seconds / (passes * len(x))])
    all_rows = np.array(rows)
    means = dict(
        zip(("nmse", "worst", "fields", "within_percent", "update_us"), all_rows.mean(axis=0), strict=True)
    )
    return {**{k: float(v) for k, v in means.items()}, "worst": float(all_rows[:, 1].max())}


def _table(title: str, cases: dict[str, Case], seeds: range, ways: list[str]) -> Table:
    cells, kept = [], {}
    for name, case in cases.items():
        for way in ways:
            options, passes = WAYS[way]
            row = runs(case, options, passes, seeds)
            kept[f"{name}, {way}"] = row
            target = "" if np.isnan(case.target) else f"{case.target:g}"
            cells.append([
                name, way, f"{row['nmse']:.4f}", f"{row['worst']:.4f}", target, f"{row['fields']:.0f}",
                f"{row['within_percent']:.0f} %", f"{row['update_us']:.1f}",
            ])  # fmt: skip
    head = ["function", "settings", "nMSE", "worst draw", "wanted", "fields", "in 1.96 sd", "update us"]
    return Table(title, head, cells, [], kept)


@experiment(
    "lwpr_defaults",
    chosen_on="seeds 0 to 2 of all functions: the part of the data that a field covers, the cutoff, no learned metric",
    reported_on="held out: seeds 100 to 104 of the five functions with a wanted nMSE; beside it what was chosen on",
    short={"seeds": 1},
)
def lwpr_defaults(*, seeds: int = 5) -> list[Table]:
    """Regression by local models without any setting: functions of one to ten inputs.

    Parameters
    ----------
    seeds
        draws of the samples
    """
    held_out, chosen = (range(FIRST_SEED[k], FIRST_SEED[k] + seeds) for k in ("held out", "chosen"))
    return [
        _table("Held out", REPORTED_ON, held_out, ["defaults"]),
        _table(
            "Other settings on the same draws",
            REPORTED_ON,
            held_out,
            [way for way in WAYS if way != "defaults"],
        ),
        _table("Other numbers of samples", OTHER_NUMBERS, held_out[:2], ["defaults"]),
        _table("Chosen on", CHOSEN_ON, chosen[:2], ["defaults", "as before"]),
    ]
