# SPDX-License-Identifier: MIT
"""A receptive field as a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, repr=False, eq=False)
class LWPRField:
    """One receptive field of one output, in the units of the data.

    Attributes
    ----------
    output : int
        Index of the output that the field belongs to.
    center : (n_in,) float64
    D : (n_in, n_in) float64
        Metric: the activation of x is ``exp(-0.5 (x - center) @ D @ (x - center))``.
    slope, value : (n_in,) float64, float
        Prediction of the field: ``value + slope @ (x - center)``.
    n_data : int
        Number of samples that activated it.
    n_projections, n_trusted : int
        Number of projections, and number of those with enough samples (2 n_in) for predictions.
    trustworthy : bool
        Whether it is used in predictions.
    mse : (n_projections,) float64
        Mean squared residual after each projection.
    loo_mse : float
        Leave-one-out mean squared residual after the last trusted projection; NaN without one.
    weight : float
        Sum of the activations, with forgetting.
    forgetting : float
        Current forgetting factor lambda.
    """

    output: int
    center: NDArray[np.float64]
    D: NDArray[np.float64]
    slope: NDArray[np.float64]
    value: float
    n_data: int
    n_projections: int
    n_trusted: int
    mse: NDArray[np.float64]
    loo_mse: float
    weight: float
    forgetting: float

    @property
    def trustworthy(self) -> bool:
        return self.n_trusted > 0

    def __repr__(self) -> str:
        place = np.array2string(self.center, precision=3, threshold=4)
        return f"LWPRField(output={self.output}, center={place}, n_data={self.n_data})"


def field_from_core(
    raw: dict[str, Any], output: int, norm_in: NDArray[np.float64], norm_out: float
) -> LWPRField:
    """Convert a field of the core, in scaled units, to the units of the data."""
    M = raw["M"] / norm_in
    arrays = {
        "center": raw["center"] * norm_in,
        "D": M.T @ M,
        "slope": raw["slope"] / norm_in * norm_out,
        "mse": raw["mse"] * norm_out**2,
    }
    for array in arrays.values():
        array.setflags(write=False)
    return LWPRField(
        output=output,
        value=raw["value"] * norm_out,
        loo_mse=raw["loo_mse"] * norm_out**2,
        **arrays,
        **{k: raw[k] for k in ("n_data", "n_projections", "n_trusted", "weight", "forgetting")},
    )
