# SPDX-License-Identifier: MIT
"""The thesis' rule of a shape memory: an LWPR unit for each low coefficient of the silhouette's DCT."""

from __future__ import annotations

from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack.contour.dct import Order, block_of, harmonic_numbers, series
from sdftrack.contour.result import Assessment, Judgement

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
MIN_KNOWN = 0.5  # of the regressions; less is "novel" (Table 6.3: more than half of the units)
MIN_JUDGED = 5  # silhouettes predicted before they were learned; the error of fewer is not known
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
    if given and rule == "remembered":
        raise ValueError(
            'lwpr: expected only with rule="printed" or "regressed"; the other has no regression'
        )
    return {name: plain(value) for name, value in given.items()}


class HarmonicRegression:
    """The printed rule: an LWPR unit for each low coefficient, whose inputs are those of the high harmonics."""

    # Inputs are divided by their standard deviations over the first `settle` samples, which are then learned at once;
    # the scale remains fixed. The metric of a field is D = (reach / inputs) I: two silhouettes whose high harmonics
    # differ by one standard deviation on average activate each other by exp(-reach / 2). A small reach yields few
    # fields, down to a single one, which is a linear regression by partial least squares; a large one makes occluded
    # details "novel".

    count = 0  # of silhouettes that are stored

    def __init__(self, options: _core.MemoryOptions, lwpr: dict[str, Any]) -> None:
        from sdftrack.contour.lwpr import LWPR

        self._options = o = options
        self._order = cast("Order", o.order)
        self._high = harmonic_numbers(o.n_harmonics, self._order) > o.n_harmonics - o.n_inputs
        inputs = int(self._high.sum())
        self.learnt = 0
        self._predicted, self._squares = 0, 0.0  # silhouettes before they were learned, and their errors
        self._waiting: list[Array] = []
        self._scale: Array | None = None
        # A full metric of 51 inputs for 49 outputs would be learnt from 10^5 numbers per field: diagonal.
        given = {"init_D": o.reach / inputs, "diagonal": True, "update_D": False, **lwpr}
        self._model = LWPR(inputs, len(self._high) - inputs, w_gen=o.w_gen, **given)

    def learn(self, on_grid: Mask) -> None:
        """Learn a whole silhouette."""
        c = block_of(on_grid, self._options.n_harmonics, self._order)
        if self._scale is None:
            self._waiting.append(c)
            if len(self._waiting) == self._options.settle:
                first = np.array(self._waiting)
                sd = first[:, self._high].std(axis=0)
                self._scale = np.maximum(sd, MIN_SCALE * np.sqrt(np.mean(sd**2)) + 1e-9)
                self._model.update(first[:, self._high] / self._scale, first[:, ~self._high])
                self._waiting = []
        else:
            x = c[self._high] / self._scale
            if self._options.rule == "regressed":
                self._predicted += 1
                self._squares += float(np.sum((self._model.predict(x) - c[~self._high]) ** 2))
            self._model.update(x, c[~self._high])
        self.learnt += 1

    def assess(self, given: Mask, on_grid: Mask) -> Assessment:
        """The low harmonics predicted from the high ones, and the judgement by Table 6.3."""
        c = block_of(on_grid, self._options.n_harmonics, self._order)
        std = np.zeros(len(c))
        if self._scale is None:
            return Assessment("novel", given, given, c, std, 0.0, np.inf, 0.0)
        x, observed = c[self._high] / self._scale, c[~self._high]
        mean, std[~self._high] = self._model.predict(x, confidence=True)
        c[~self._high] = mean
        error, threshold = float(np.linalg.norm(mean - observed)), self.threshold
        # The share of the regressions whose largest activation is above `w_gen`.
        active = float((self._model.activations(x) > self._options.w_gen).mean())
        completed = series(c, given.shape, self._order) > 0
        judgement: Judgement = "occluded" if error >= threshold else "unoccluded"
        if active < MIN_KNOWN or not completed.any():
            judgement = "novel"
        shown = completed if judgement == "occluded" else given
        return Assessment(judgement, shown, completed, c, std, error, threshold, active)

    @property
    def threshold(self) -> float:
        """sqrt(2) times |e| of Table 6.3: root of the sum of squared residuals of the low coefficients.

        Printed: of what has been learned. In a video the next silhouette is a new one, whose error is much larger:
        "regressed" takes those that each silhouette had before it was learned, as soon as there are `MIN_JUDGED`.
        """
        if self._scale is None:
            return np.inf
        if self._predicted >= MIN_JUDGED:
            return float(np.sqrt(2 * self._squares / self._predicted))
        return np.sqrt(2) * float(np.linalg.norm(self._model.training_error))

    def state(self) -> dict[str, Any]:
        """The learned state, as numbers, arrays and bytes."""
        waiting = np.array(self._waiting).reshape(-1, len(self._high))
        scale = np.zeros(0) if self._scale is None else self._scale
        core = self._model.__getstate__()["core"]
        counts = {"learnt": self.learnt, "calibrated": self._predicted, "squares": self._squares}
        return {**counts, "waiting": waiting, "scale": scale, "lwpr": core}

    def restore(self, learnt: int, predicted: int, state: dict[str, Any]) -> None:
        """Restore what `state` returned."""
        self.learnt, self._waiting = learnt, list(state["waiting"])
        self._predicted, self._squares = predicted, float(state["squares"])
        self._scale = state["scale"] if len(state["scale"]) else None
        self._model.__setstate__({**self._model.__getstate__(), "core": state["lwpr"]})
