# SPDX-License-Identifier: MIT
"""Locally weighted projection regression: incremental learning of a function without storing the samples."""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal import saved_file
from sdftrack._internal.unknown_option import refuses_unknown
from sdftrack._internal.validation import numbers, whole
from sdftrack.contour.lwpr_data import (
    AUTO,
    FIRST,
    KIND,
    FirstSamples,
    LWPRField,
    Samples,
    check_norm,
    content_of,
    field_from_core,
    fitted,
    inputs,
    is_auto,
    norms,
    plain,
    samples,
    settled_by,
    state_from,
    warn_of_many_fields,
    without_auto,
)
from sdftrack.contour.lwpr_sklearn import SklearnParts
from sdftrack.device import CPU, device_input, device_number

Array = NDArray[np.float64]
MAX_COUNT = 2**31  # of a count: what the core's int holds


@refuses_unknown
class LWPR(SklearnParts):
    """Online regression with many local linear models (Vijayakumar, D'Souza and Schaal 2005; thesis 6.3.2).

    Parameters
    ----------
    n_in, n_out : int, optional
        Number of inputs and outputs; None: taken from the first data.
    w_gen : float, 0 to 1
        A sample whose activation stays below this in every receptive field creates a new one. Larger: denser fields.
    w_prune : float, above w_gen to 1
        If a sample activates two fields above this, one of them is pruned.
    w_cutoff : float or "auto"
        Activations below this are treated as 0, in learning and in prediction. "auto": 0.01, or more for more than 4
        inputs where ``init_D`` is "auto" too.
    init_D : "auto", float, (n_in,) or (n_in, n_in) float
        Initial distance metric of a new field, for inputs divided by ``norm_in``: 25 is a standard deviation of 0.2.
        "auto": so that a field covers 1 to 2 % of the first samples (docs/lwpr.md); `repr` says the number.
    diagonal : bool
        Restrict the metric to a diagonal matrix: faster from about 5 inputs on, but limited to axis-aligned fields.
    update_D : bool or "auto"
        Learn the metric by gradient descent on the penalised leave-one-out error. "auto": where ``init_D`` is given.
    init_alpha, meta, meta_rate : float, bool, float
        Learning rate of the metric; whether the rates are adapted as well, and the meta learning rate.
    penalty : float
        gamma of eq. 6.13: regularisation that prevents fields from shrinking without limit.
    add_threshold : float, 0 to 1
        A projection is added if the last one left less than this share of the mean squared error.
    init_lambda, final_lambda, tau_lambda : float
        Initial and final forgetting factor of a field, and the annealing rate between them.
    norm_in, norm_out : None, float, array or "auto"
        Divisors of inputs and outputs. "auto": the standard deviations of the first data. None: 1, but "auto" for
        inputs where ``init_D`` is.
    threads : int
        Maximum number of threads; 0: all cores. The results do not depend on it.

    Raises
    ------
    TypeError, ValueError
        An option of the wrong type or out of range.

    Examples
    --------
    >>> import numpy as np, sdftrack as st
    >>> x = np.random.default_rng(0).uniform(-1, 1, (2000, 1))
    >>> model = st.LWPR().update(x, np.sin(3 * x[:, 0]))
    >>> mean, sd = model.predict([0.5], confidence=True)
    """

    n_in: int | None
    n_out: int | None
    init_D: ArrayLike
    norm_in: ArrayLike | None
    norm_out: ArrayLike | None
    threads: int
    # On the class: scikit-learn wants nothing but parameters from __init__.
    _model: _core.LwprModel | None = None
    _flat = False
    _first: FirstSamples | None = None  # while the settings follow from them

    def __init__(
        self,
        n_in: int | None = None,
        n_out: int | None = None,
        *,
        w_gen: float = 0.2,
        w_prune: float = 0.95,
        w_cutoff: float | Literal["auto"] = "auto",
        init_D: ArrayLike | Literal["auto"] = "auto",
        diagonal: bool = False,
        update_D: bool | Literal["auto"] = "auto",
        init_alpha: float = 50.0,
        meta: bool = False,
        meta_rate: float = 1.0,
        penalty: float = 1e-08,
        add_threshold: float = 0.5,
        init_lambda: float = 0.999,
        final_lambda: float = 0.99999,
        tau_lambda: float = 0.9999,
        norm_in: ArrayLike | Literal["auto"] | None = None,
        norm_out: ArrayLike | Literal["auto"] | None = None,
        threads: int = 0,
    ) -> None:
        given = dict(locals())
        for name in self._parameter_names():  # unchanged, as scikit-learn's clone wants them
            setattr(self, name, given[name])
        self._check_parameters()

    # Learning

    def update(self, x: ArrayLike, y: ArrayLike, *, device: str = "cpu") -> LWPR:
        """Learn one sample or several, in order.

        Parameters
        ----------
        x : (n_in,) or (N, n_in) float
        y : for (n_in,): a number or (n_out,); for (N, n_in): (N,) for one output, or (N, n_out)
        device : "cpu", "cuda", "cuda:N" or "auto"
            On a GPU, outputs are learned side by side, and the fields of each; samples remain in order, so that it is
            faster than the CPU only for many outputs. The fields stay on the GPU until something else than an update
            asks for them.

        Returns
        -------
        LWPR
            Itself.

        Raises
        ------
        ValueError
            A wrong shape, or a non-finite value; the model is unchanged.
        RuntimeError
            Another thread is using the model; there is no GPU for "cuda"; or CUDA failed: the model is then what it was
            when the CPU last saw it.
        """
        number = device_number(device)
        if self._model is None:
            self._learn_anew(x, y, number)
            return self
        data = samples(x, y, self.n_inputs, self.n_outputs)
        before = self.n_samples
        if self._first is None:
            self._model.update(data.x, data.y, self.threads, number)
        else:
            self._learn_first(self._first, data, number)
        if number == CPU:
            warn_of_many_fields(before, self.n_samples, self._model.field_counts)
        return self

    def predict(
        self, x: ArrayLike, confidence: bool = False, *, return_std: bool = False, device: str = "cpu"
    ) -> Any:
        """Predict the outputs for one input or several.

        Parameters
        ----------
        x : (n_in,) or (N, n_in) float
        confidence, return_std : bool
            Either: also return the standard deviation of the prediction (defined in docs/lwpr.md).
        device : "cpu", "cuda", "cuda:N" or "auto"
            The GPU does not support standard deviations.

        Returns
        -------
        mean, or (mean, sd) : float64
            A number or (n_out,) for (n_in,); (N,) or (N, n_out) for (N, n_in), as the outputs were given. If no field
            is active, the mean is that of all outputs so far, and the standard deviation is infinite. Of (N, n_in)
            float64 on the GPU that is used, (N, n_out) there for ``from_dlpack`` of torch, cupy or jax, without a copy.

        Raises
        ------
        ValueError
            Nothing learned yet, a wrong shape, or a non-finite value.
        RuntimeError
            Another thread is updating the model, or there is no GPU for "cuda".
        """
        model = self._learnt("predict")
        with_sd = bool(confidence or return_std)
        number = device_number(device)
        there = None if with_sd else device_input(x, "x", number)
        if there is not None and there.dtype == np.float64 and there.shape[1:] == (model.n_in,):
            return model.predict_there(there.address, there.stream, there.shape[0], number)
        rows, single = inputs(x, model.n_in)
        if number != CPU and with_sd:
            if device != "auto":
                raise ValueError(
                    'device: standard deviations are computed on the CPU; use device="cpu" for them'
                )
            number = CPU
        said = model.predict(rows, with_sd, self.threads, number)
        if with_sd:
            return self._shaped(said[0], single), self._shaped(said[1], single)
        return self._shaped(said, single)

    def activations(self, x: ArrayLike) -> Array:
        """The largest activation of each output's fields, a measure of how well x is covered.

        Parameters
        ----------
        x : (n_in,) or (N, n_in) float

        Returns
        -------
        (n_out,) or (N, n_out) float64
            0 to 1; 0 if all are below ``w_cutoff``.

        Raises
        ------
        ValueError, RuntimeError
            As in `predict`.
        """
        model = self._learnt("activations")
        rows, single = inputs(x, model.n_in)
        out: Array = model.activations(rows, self.threads)
        return out[0] if single else out

    # What it is

    @property
    def n_inputs(self) -> int | None:
        """Number of inputs, as given or from the first data; None if unknown."""
        return self.n_in if self._model is None else self._model.n_in

    @property
    def n_outputs(self) -> int | None:
        """Number of outputs, as given or from the first data; None if unknown."""
        return self.n_out if self._model is None else self._model.n_out

    @property
    def n_samples(self) -> int:
        """Number of samples learned."""
        return 0 if self._model is None else self._model.samples

    @property
    def n_fields(self) -> tuple[int, ...]:
        """Number of receptive fields of each output."""
        return () if self._model is None else tuple(self._model.field_counts())

    @property
    def fields(self) -> list[LWPRField]:
        """All receptive fields, grouped by output, as records."""
        if self._model is None:
            return []
        model, norm_in = self._model, np.array(self._model.norm_in)
        return [
            field_from_core(raw, output, norm_in, model.norm_out[output])
            for output in range(model.n_out)
            for raw in model.fields(output)
        ]

    @property
    def training_error(self) -> Array:
        """(n_out,) float64: the e of eq. 6.12, in the units of the outputs.

        The e of a field is the residual of a sample after the field's last projection, once the sample is learned. The
        result is the root mean square of e over samples and fields, weighted by activation and the fields' forgetting.
        """
        return np.array(self._learnt("training_error").training_error())

    # Files, copies

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to a file, completely or not at all. `LWPR.load` reads it."""
        saved_file.write(path, KIND, content_of(self.__getstate__()))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> LWPR:
        """Load a model written by `save`, bit by bit identical.

        Raises FileNotFoundError, ValueError: no such file; a file of another kind, truncated or damaged.
        """
        return saved_file.loaded(path, KIND, cls, state_from)

    def copy(self) -> LWPR:
        """Return an independent copy of the model."""
        out = type(self).__new__(type(self))
        out.__setstate__(self.__getstate__())
        return out

    def __getstate__(self) -> dict[str, Any]:
        core = b"" if self._model is None else self._model.to_bytes()
        state = {"parameters": self.get_params(), "flat": self._flat, "core": core}
        if self._first is not None:
            kept = self._first.first(len(self._first))
            state["first"] = {"x": kept.x, "y": kept.y}
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name in self._parameter_names():
            setattr(self, name, state["parameters"][name])
        self._flat = bool(state["flat"])
        self._model = _core.LwprModel.from_bytes(state["core"]) if state["core"] else None
        first = state.get("first")
        self._first = None if first is None else FirstSamples(Samples(first["x"], first["y"], self._flat))
        self._check_parameters()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LWPR):
            return NotImplemented
        return bool(plain(self.__getstate__()) == plain(other.__getstate__()))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        if self._model is None:
            return f"LWPR(n_in={self.n_in}, n_out={self.n_out}, nothing learned)"
        count = self.n_fields
        fields = str(count[0]) if len(count) == 1 else f"{min(count)} to {max(count)} an output"
        fit = ""
        if is_auto(self.init_D):
            fit = f', init_D="auto": {self._model.options.init_D[0]:g}'
        return f"LWPR(n_in={self.n_inputs}, n_out={self.n_outputs}, {self.n_samples} samples, fields: {fields}{fit})"

    # Inside

    def _check_parameters(self) -> None:
        for name in ("n_in", "n_out"):
            value = getattr(self, name)
            if value is not None:
                whole(value, name, 1, MAX_COUNT - 1, "None or a whole number of at least 1")
        whole(self.threads, "threads", 0, MAX_COUNT - 1, f"0 (all cores) to {MAX_COUNT - 1}")
        self._core_options(self._options())
        for name in ("norm_in", "norm_out"):
            check_norm(getattr(self, name), name)

    def _options(self) -> dict[str, Any]:
        """The options of the core, as given; TypeError for a text that is not "auto"."""
        fields = _core.LwprOptions.fields()
        for name in AUTO:
            value = getattr(self, name)
            if isinstance(value, str) and value != "auto":
                expected = fields[name].metadata["expected"]
                raise TypeError(f'{name}: expected {expected} or "auto", got {value!r}')
        return {name: getattr(self, name) for name in fields}

    def _core_options(self, values: dict[str, Any]) -> _core.LwprOptions:
        given = without_auto(values)
        return _core.LwprOptions(**{**given, "init_D": numbers(given["init_D"], "init_D").ravel().tolist()})

    def _learn_anew(self, x: ArrayLike, y: ArrayLike, device: int = CPU) -> None:
        before = self._model
        data = samples(x, y, self.n_in, self.n_out)
        if not len(data.x):
            return  # nothing to take inputs, outputs and scales from
        kept = FirstSamples(data) if is_auto(self.init_D) else None
        model = self._new_model(data if kept is None else kept.first(settled_by(len(kept))))
        model.update(data.x, data.y, self.threads, device)
        if self._model is not before:
            raise RuntimeError(
                "this LWPR is in use by another thread, which initialised it concurrently; take turns"
            )
        self._model, self._flat = model, data.flat
        self._first = kept if kept is not None and len(kept) < FIRST else None
        if device == CPU:
            warn_of_many_fields(0, len(data.x), model.field_counts)

    def _learn_first(self, kept: FirstSamples, data: Samples, device: int) -> None:
        """Keep the first samples; where their number has doubled, learn them anew with the settings that follow."""
        before = len(kept)
        if settled_by(before) == settled_by(before + len(data.x)):
            model = self._learnt("update")
            try:
                model.update(data.x, data.y, self.threads, device)
            finally:  # Ctrl-C may leave some unlearned
                learned = model.samples - before
                kept.add(Samples(data.x[:learned], data.y[:learned], data.flat))
            return
        now = FirstSamples(kept.first(before))  # the model is unchanged where learning is refused
        now.add(data)
        every = now.first(len(now))
        model = self._new_model(now.first(settled_by(len(now))))
        model.update(every.x, every.y, self.threads, device)
        self._model = model
        self._first = now if len(now) < FIRST else None

    def _new_model(self, data: Samples) -> _core.LwprModel:
        fit = fitted(self._options(), self.norm_in, data.x)
        norm_out = norms(self.norm_out, data.y, "norm_out")
        return _core.LwprModel(
            data.x.shape[1], data.y.shape[1], self._core_options(fit.options), fit.norm_in.tolist(),
            norm_out.tolist(),
        )  # fmt: skip

    def _learnt(self, what: str) -> _core.LwprModel:
        if self._model is None:
            raise self._not_fitted(f"LWPR.{what}: nothing has been learned yet; call update or fit first")
        return self._model

    def _shaped(self, values: Array, single: bool) -> Any:
        if self._flat:
            return float(values[0, 0]) if single else values[:, 0]
        return values[0] if single else values
