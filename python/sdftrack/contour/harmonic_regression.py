# SPDX-License-Identifier: MIT
"""Regression of the low harmonics of a silhouette from its high ones by LWPR (thesis 6.3.4, Table 6.3)."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack.contour.dct import Order, harmonic_numbers

Array: TypeAlias = NDArray[np.float64]
MIN_SCALE = 0.1  # an input that hardly varied is not divided by less than this share of the inputs' rms


SET_BY_MEMORY = {
    "w_gen": "give ShapeMemory(w_gen=...) instead",
    "n_in": "it follows from n_inputs",
    "n_out": "it follows from n_harmonics",
}


def checked_lwpr(given: Any, rule: str) -> dict[str, Any]:
    """Options of LWPR as plain values; an error names one that is unknown, set by the memory, or of no use."""
    from sdftrack.contour.lwpr import LWPR
    from sdftrack.contour.lwpr_data import plain

    if not isinstance(given, dict):
        raise TypeError(f"lwpr: expected a dictionary of options of st.contour.LWPR, got {given!r}")
    known = [name for name in LWPR._parameter_names() if name not in SET_BY_MEMORY]
    for name in given:
        if name in SET_BY_MEMORY:
            raise TypeError(f"lwpr: {name!r} is set by the memory; {SET_BY_MEMORY[name]}")
    try:
        refuse_unknown(given, known)
    except TypeError as error:
        raise TypeError(f"lwpr: {error}") from None
    if given and rule != "printed":
        raise ValueError('lwpr: expected only with rule="printed"; the other rule has no regression')
    return {name: plain(value) for name, value in given.items()}


class PredictedHarmonics(NamedTuple):
    """The m harmonics of one silhouette, the low ones predicted from the high ones."""

    coefficients: Array
    std: Array  # of the prediction; 0 for the high ones
    error: float  # |predicted - observed| over the low ones
    active: float  # share of the regressions whose largest activation is above `w_gen`


class HarmonicRegression:
    """One LWPR unit for each low coefficient, all with the same inputs: the coefficients of the high harmonics.

    Inputs are divided by their standard deviations over the first `settle` samples, which are then learned at once; the
    scale remains fixed. The metric of a field is D = (reach / inputs) I: two silhouettes whose high harmonics differ by
    one standard deviation on average activate each other by exp(-reach / 2). A small reach yields few fields, down to a
    single one, which is a linear regression by partial least squares; a large one makes occluded details "novel".
    """

    def __init__(
        self, n_harmonics: int, n_inputs: int, order: Order, w_gen: float, reach: float, settle: int,
        options: dict[str, Any],
    ) -> None:  # fmt: skip
        from sdftrack.contour.lwpr import LWPR

        self.high = harmonic_numbers(n_harmonics, order) > n_harmonics - n_inputs
        self.w_gen, self.settle = w_gen, settle
        inputs = int(self.high.sum())
        self._waiting: list[Array] = []
        self.scale: Array | None = None
        # A full metric of 51 inputs for 49 outputs would be learnt from 10^5 numbers per field: diagonal.
        given = {"init_D": reach / inputs, "diagonal": True, "update_D": False, **options}
        self.model = LWPR(inputs, len(self.high) - inputs, w_gen=w_gen, **given)

    @property
    def ready(self) -> bool:
        """Whether enough silhouettes were learned to set the scale of the inputs."""
        return self.scale is not None

    def learn(self, c: Array) -> None:
        """Learn the coefficients of one whole silhouette."""
        if self.scale is not None:
            self.model.update(c[self.high] / self.scale, c[~self.high])
            return
        self._waiting.append(c)
        if len(self._waiting) < self.settle:
            return
        first = np.array(self._waiting)
        sd = first[:, self.high].std(axis=0)
        self.scale = np.maximum(sd, MIN_SCALE * np.sqrt(np.mean(sd**2)) + 1e-9)
        self.model.update(first[:, self.high] / self.scale, first[:, ~self.high])
        self._waiting = []

    def explain(self, c: Array) -> PredictedHarmonics:
        """Predict the low harmonics of one silhouette; `ready` must be true."""
        assert self.scale is not None
        x = c[self.high] / self.scale
        mean, sd = self.model.predict(x, confidence=True)
        out, std = c.copy(), np.zeros(len(c))
        out[~self.high] = mean
        std[~self.high] = sd
        active = float((self.model.activations(x) > self.w_gen).mean())
        return PredictedHarmonics(out, std, float(np.linalg.norm(mean - c[~self.high])), active)

    def training_error(self) -> float:
        """|e| of Table 6.3: root of the sum of squared training residuals of the low coefficients."""
        return float(np.linalg.norm(self.model.training_error))

    def state(self) -> dict[str, Any]:
        """The learned state, as arrays and bytes."""
        waiting = np.array(self._waiting).reshape(-1, len(self.high))
        scale = np.zeros(0) if self.scale is None else self.scale
        return {"waiting": waiting, "scale": scale, "lwpr": self.model.__getstate__()["core"]}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore what `state` returned."""
        self._waiting = list(state["waiting"])
        self.scale = state["scale"] if len(state["scale"]) else None
        now = self.model.__getstate__()
        self.model.__setstate__({**now, "core": state["lwpr"]})
