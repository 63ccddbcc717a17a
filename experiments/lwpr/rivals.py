# SPDX-License-Identifier: MIT
"""Regression by local models, sample by sample and in one call, beside the regressors of scikit-learn."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.lwpr.functions import BESIDE_RIVALS, Case
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour import LWPR

Array = NDArray[np.float64]
PLACES, FIRST_SEED = 3000, 100


class SampleBySample:
    """Learns each sample by a call of its own."""

    def __init__(self) -> None:
        self._model = LWPR(threads=1)
        self.predict = self._model.predict

    def fit(self, x: Array, y: Array) -> None:
        for one, value in zip(x, y, strict=True):
            self._model.update(one, value)


def rivals() -> dict[str, Any]:
    """Name and maker, with scikit-learn's settings where nothing is said; inputs and outputs are standardised."""
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.ensemble import HistGradientBoostingRegressor, RandomForestRegressor
    from sklearn.kernel_ridge import KernelRidge
    from sklearn.multioutput import MultiOutputRegressor
    from sklearn.neighbors import KNeighborsRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    def scaled(model: Any) -> Any:
        pipeline = make_pipeline(StandardScaler(), model)
        return TransformedTargetRegressor(pipeline, transformer=StandardScaler())

    return {
        "LWPR, sample by sample": SampleBySample,
        "LWPR, one call": lambda: LWPR(threads=1),
        "10 nearest neighbours": lambda: scaled(KNeighborsRegressor(10, weights="distance")),
        "kernel ridge, RBF": lambda: scaled(KernelRidge(alpha=0.1, kernel="rbf")),
        "random forest": lambda: scaled(RandomForestRegressor(random_state=0)),
        "boosted trees": lambda: scaled(MultiOutputRegressor(HistGradientBoostingRegressor(random_state=0))),
        "network of 100 units": lambda: scaled(MLPRegressor(random_state=0)),
    }


def compared(case: Case, make: Any, seeds: range, samples: int) -> dict[str, float]:
    """Means over draws: nMSE at places without noise, its worst draw, processor time per sample and place."""
    rows = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        x = case.places(rng, samples)
        y = case.value(x)
        y = y + rng.normal(0, case.noise, y.shape)
        ask = case.places(rng, PLACES)
        truth = case.value(ask)
        model = make()
        ticks = [time.process_time()]
        model.fit(x, y)
        ticks.append(time.process_time())
        mean = np.asarray(model.predict(ask)).reshape(truth.shape)
        ticks.append(time.process_time())
        learning, asking = np.diff(ticks)
        nmse = float(np.mean(((mean - truth) ** 2).mean(axis=0) / truth.var(axis=0)))
        rows.append([nmse, 1e6 * learning / samples, 1e6 * asking / PLACES])
    nmse, learn_us, predict_us = np.mean(rows, axis=0).tolist()
    return {
        "nmse": nmse, "worst": float(np.max(rows, axis=0)[0]), "learn_us": learn_us, "predict_us": predict_us,
    }  # fmt: skip


@experiment(
    "lwpr_rivals",
    needs=["package:sklearn"],
    chosen_on="the functions of lwpr_defaults; of the rivals nothing but standardised inputs and alpha=0.1",
    reported_on="seeds 100 and 101, which played no part; the seven-joint arm played none",
    short={"seeds": 1, "samples": 200},
)
def lwpr_rivals(*, seeds: int = 2, samples: int = 4000) -> Table:
    """Regression by local models beside scikit-learn's regressors: functions of two to 21 inputs, one run.

    Parameters
    ----------
    seeds
        draws of the samples
    samples
        that are learned
    """
    cells, kept = [], {}
    for name, case in BESIDE_RIVALS.items():
        for who, make in rivals().items():
            row = compared(case, make, range(FIRST_SEED, FIRST_SEED + seeds), samples)
            kept[f"{name}, {who}"] = row
            cells.append([
                f"{name}: {who}", f"{row['nmse']:.4f}", f"{row['worst']:.4f}", f"{row['learn_us']:.1f}",
                f"{row['predict_us']:.2f}",
            ])  # fmt: skip
    head = ["function and regressor", "nMSE", "worst draw", "learn us", "predict us"]
    return Table("Beside scikit-learn", head, cells, [], kept)
