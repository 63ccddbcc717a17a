# SPDX-License-Identifier: MIT
"""Local regression, time of a sample on one thread. Changing these numbers breaks comparisons.

The functions, noises and settings of the experiment `lwpr`, 20,000 samples.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from harness import benchmark

import sdftrack as st
from experiments.lwpr import lwpr as cases
from sdftrack.synth.functions import cross_data, surface_data


def noisy(make: Any) -> tuple[Any, Any]:
    x, y = make(0, cases.SAMPLES)
    return x, y + np.random.default_rng(1000).normal(0, cases.NOISE, y.shape)


def updating(make: Any, options: dict[str, Any]) -> Callable[[], object]:
    x, y = noisy(make)
    return lambda: st.LWPR(threads=1, **options).update(x, y)


def predicting(make: Any, options: dict[str, Any]) -> Callable[[], object]:
    x, y = noisy(make)
    model = st.LWPR(threads=1, **options).update(x, y)
    return lambda: model.predict(x)


@benchmark("lwpr/update_cross", items=cases.SAMPLES, unit="sample")
def update_cross() -> Callable[[], object]:
    return updating(cross_data, cases.CROSS["metric learnt"])


@benchmark("lwpr/predict_cross", items=cases.SAMPLES, unit="sample")
def predict_cross() -> Callable[[], object]:
    return predicting(cross_data, cases.CROSS["metric learnt"])


@benchmark("lwpr/update_surface", items=cases.SAMPLES, unit="sample")
def update_surface() -> Callable[[], object]:
    return updating(surface_data, cases.SURFACE["diagonal metric learnt"])


@benchmark("lwpr/predict_surface", items=cases.SAMPLES, unit="sample")
def predict_surface() -> Callable[[], object]:
    return predicting(surface_data, cases.SURFACE["diagonal metric learnt"])
