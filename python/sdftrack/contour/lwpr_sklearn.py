# SPDX-License-Identifier: MIT
"""The estimator interface of scikit-learn, without requiring scikit-learn."""

from __future__ import annotations

import inspect
import sys
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack._internal.validation import numbers


class SklearnParts:
    """fit, score and parameters; a base of `sdftrack.LWPR`, which has update and predict."""

    _model: Any = None
    _first: Any = None  # samples from which settings follow

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Reset the model, then learn X (N, n_in) and y (N,) or (N, n_out) in order; errors as `update`."""
        rows = numbers(X, "X")
        if rows.ndim != 2:
            raise ValueError(
                f"X: expected (N, n_in), got {rows.shape}; Reshape your data: X.reshape(-1, 1) has one input, "
                "X.reshape(1, -1) is one sample"
            )
        if len(rows) == 0:
            raise ValueError(f"X: expected at least one sample, got 0 sample(s) (shape={rows.shape})")
        self._learn_anew(rows, y)
        return self

    def partial_fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """The same as `update`."""
        return self.update(X, y)  # type: ignore[attr-defined,no-any-return]

    def score(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> float:
        """R^2, averaged over the outputs, with weights (N,) of samples: 1 is perfect, 0 as good as a constant."""
        said = np.asarray(self.predict(X))  # type: ignore[attr-defined]
        true = numbers(y, "y")
        if true.shape != said.shape:
            raise ValueError(f"y: expected {said.shape}, got {true.shape}")
        if not np.isfinite(true).all():
            raise ValueError("y: expected finite numbers, got NaN or inf; omit such samples")
        if not len(true):
            raise ValueError("X: expected at least one sample to compare with, got 0")
        w = np.ones(len(true)) if sample_weight is None else numbers(sample_weight, "sample_weight")
        if w.shape != (len(true),):
            raise ValueError(f"sample_weight: expected ({len(true)},), got {w.shape}")
        if not (np.isfinite(w).all() and (w >= 0).all() and w.sum() > 0):
            raise ValueError("sample_weight: expected finite numbers of at least 0, not all 0, got others")
        mean = np.average(true, axis=0, weights=w)
        left, whole = w @ (true - said) ** 2, w @ (true - mean) ** 2
        # A constant output: 1 where it is met, 0 where not.
        constant = np.where(left > 0, 0.0, 1.0)
        return float(np.mean(np.where(whole > 0, 1 - left / np.where(whole > 0, whole, 1), constant)))

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The parameters by name, as given."""
        return {name: getattr(self, name) for name in self._parameter_names()}

    def set_params(self, **parameters: Any) -> Self:
        """Change parameters. The learned state is kept: changes take effect at the next `fit`.

        Raises TypeError, ValueError: no such parameter, or a value out of range; nothing is changed.
        """
        before = self.get_params()
        try:
            refuse_unknown(parameters, before)
        except TypeError as error:  # scikit-learn expects another class
            raise ValueError(str(error)) from None
        try:
            for name, value in parameters.items():
                setattr(self, name, value)
            self._check_parameters()
        except (TypeError, ValueError):
            for name, value in before.items():
                setattr(self, name, value)
            raise
        if parameters:
            self._first = None  # else the new ones would take effect while the first samples come in
        return self

    @property
    def n_features_in_(self) -> int:
        """Number of inputs, under scikit-learn's name; undefined before the first data."""
        if self._model is None:
            raise AttributeError("n_features_in_: nothing has been learned yet")
        return int(self._model.n_in)

    def __sklearn_is_fitted__(self) -> bool:
        return self._model is not None

    def __sklearn_tags__(self) -> Any:
        from sklearn.utils import InputTags, RegressorTags, Tags, TargetTags  # only scikit-learn asks

        return Tags(
            estimator_type="regressor",
            target_tags=TargetTags(required=True, multi_output=True),
            regressor_tags=RegressorTags(),
            input_tags=InputTags(),
        )

    # scikit-learn before 1.6 looks here.
    _estimator_type = "regressor"

    def _check_parameters(self) -> None:
        raise NotImplementedError

    def _learn_anew(self, X: Any, y: Any) -> None:
        raise NotImplementedError

    @classmethod
    def _parameter_names(cls) -> list[str]:
        return [name for name in inspect.signature(cls.__init__).parameters if name != "self"]

    @staticmethod
    def _not_fitted(message: str) -> ValueError:
        """A ValueError; if scikit-learn is loaded, its NotFittedError."""
        module = sys.modules.get("sklearn.exceptions")
        kind: type[ValueError] = ValueError if module is None else module.NotFittedError
        return kind(message)
