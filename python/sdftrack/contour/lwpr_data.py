# SPDX-License-Identifier: MIT
"""The samples of an LWPR, settings that follow from them, its state in a file, and its receptive fields as records."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.saved_file import FileKind
from sdftrack._internal.validation import numbers

Array = NDArray[np.float64]
MANY_FROM, MANY = 256, 0.5  # samples, from which on this share of them as fields is too many


class Samples(NamedTuple):
    """x (N, n_in), y (N, n_out), and whether y was given without an output axis."""

    x: Array
    y: Array
    flat: bool


def inputs(x: ArrayLike, n_in: int | None, name: str = "x") -> tuple[Array, bool]:
    """Rows of inputs, and whether a single sample was given. (The core rejects non-finite values.)"""
    rows = _unmasked(x, name)
    single = rows.ndim == 1
    if single:
        rows = rows[None, :]
    n = "n_in" if n_in is None else n_in
    if rows.ndim != 2 or rows.shape[1] == 0 or (n_in is not None and rows.shape[1] != n_in):
        hint = "; for samples of one input use x[:, None]" if single and n_in == 1 else ""
        raise ValueError(
            f"{name}: expected ({n},) or (N, {n}), got {rows.shape[1:] if single else rows.shape}{hint}"
        )
    return rows, single


def samples(x: ArrayLike, y: ArrayLike, n_in: int | None, n_out: int | None) -> Samples:
    """Inputs with their outputs; see `sdftrack.LWPR.update` for the shapes."""
    rows, single = inputs(x, n_in)
    values = _unmasked(y, "y")
    if np.asarray(y).ndim == 0:
        values = values.reshape(())  # a number stays without an axis
    shape = values.shape
    flat = values.ndim == (0 if single else 1)
    if flat:
        values = values.reshape(-1, 1)
    elif single and values.ndim == 1:
        values = values[None, :]
    m: Any = "n_out" if n_out is None else n_out
    if values.ndim != 2 or values.shape[1] == 0 or (n_out is not None and values.shape[1] != n_out):
        expected = f"a number or ({m},)" if single else f"(N,) for one output, or (N, {m})"
        raise ValueError(
            f"y: expected {expected}, got {shape} beside x {rows.shape[1:] if single else rows.shape}"
        )
    if len(values) != len(rows):
        raise ValueError(f"y: expected as many samples as x, {len(rows)}, got {len(values)}")
    return Samples(rows, values, flat)


def _unmasked(values: ArrayLike, name: str) -> Array:
    """Check that no value is masked: masked values are not data."""
    if np.ma.isMaskedArray(values) and np.ma.is_masked(values):
        raise ValueError(
            f"{name}: expected no masked values, got {int(np.ma.count_masked(values))}; omit their samples"
        )
    return numbers(values, name)


def check_norm(norm: Any, name: str) -> None:
    """TypeError or ValueError naming the parameter, if it cannot be used as a divisor."""
    if norm is None or (isinstance(norm, str) and norm == "auto"):
        return
    if isinstance(norm, str):
        raise ValueError(f'{name}: expected None, numbers above 0 or "auto", got {norm!r}')
    given = numbers(norm, name)
    if given.ndim > 1 or not np.all(np.isfinite(given) & (given > 0)):
        raise ValueError(f'{name}: expected None, numbers above 0 or "auto", got {norm!r}')


def norms(norm: Any, data: Array, name: str) -> Array:
    """Divisors of the data: (columns,) float64, from a parameter of `sdftrack.LWPR`."""
    columns = data.shape[1]
    if norm is None:
        return np.ones(columns)
    if isinstance(norm, str):
        if len(data) < 2:
            raise ValueError(
                f'{name}: "auto" takes standard deviations from the first data, which needs at least 2 samples, '
                f"got {len(data)}; start with more, or give {name} as numbers"
            )
        _finite(data, "x" if name == "norm_in" else "y")
        sd = data.std(axis=0)
        return np.where(sd > 0, sd, 1.0)
    given = np.asarray(norm, np.float64)
    if given.shape not in ((), (columns,)):
        raise ValueError(f"{name}: expected a number or ({columns},), got {given.shape}")
    return np.broadcast_to(given, (columns,)).astype(np.float64)


def _finite(values: Array, name: str) -> None:
    good = np.isfinite(values).all(axis=1)
    if not good.all():
        k = int(np.argmin(good))
        raise ValueError(
            f"{name}: expected finite numbers, got NaN or inf in sample {k}; omit such samples "
            "(the model is unchanged)"
        )


def warn_of_many_fields(before: int, now: int, field_counts: Callable[[], list[int]]) -> None:
    """Warn of fields as many as samples; looked at once each time that the number of samples has doubled."""
    if now < MANY_FROM or (before >= MANY_FROM and before.bit_length() == now.bit_length()):
        return
    most = max(field_counts())
    if most > MANY * now:
        warnings.warn(
            f"LWPR: {most} receptive fields for {now} samples: hardly a field learns from more than its own sample, so "
            'predictions are poor; use a smaller init_D, or init_D="auto" (fewer inputs, if that is what is used)',
            UserWarning,
            stacklevel=3,
        )


# -- Settings of an LWPR that follow from its first samples


AUTO = ("w_cutoff", "init_D", "update_D")  # options that may be "auto"
GIVEN = {"w_cutoff": 0.01, "init_D": 25.0, "update_D": True}  # in its place, with an init_D of one's own
FIRST = 1 << 15  # samples, after which settings are fixed
# Part of the data that a field covers, for 4,000 samples; with more of them fields may be smaller, and a stream is
# taken for at least 1,000.
SHARE, SAMPLES, FEWEST = 0.015, 4000, 1000
LOOKED_AT = 300  # samples, of which all pairs are
# Far from a field's centre lie more samples the more inputs there are: they weigh less there.
CUTOFF, LEAST_INPUTS, MOST_CUTOFF = 0.01, 3, 0.05
D_RANGE = (1e-6, 1e8)


class FirstSamples:
    """The samples so far, in the order in which they came; the memory for them grows by doubling."""

    def __init__(self, first: Samples) -> None:
        self._x, self._y, self.flat = first.x.copy(), first.y.copy(), first.flat
        self._count = len(first.x)

    def __len__(self) -> int:
        return self._count

    def add(self, more: Samples) -> None:
        """Keep more samples, behind the others."""
        count = self._count + len(more.x)
        if count > len(self._x):
            self._x, self._y = (
                np.concatenate([kept[: self._count], np.empty((2 * count - self._count, kept.shape[1]))])
                for kept in (self._x, self._y)
            )
        self._x[self._count : count], self._y[self._count : count] = more.x, more.y
        self._count = count

    def first(self, count: int) -> Samples:
        """The first of them, as views."""
        return Samples(self._x[: min(count, self._count)], self._y[: min(count, self._count)], self.flat)


def settled_by(count: int) -> int:
    """How many of the first samples give the settings: a power of 2, so that the sizes of calls do not matter."""
    return 1 << (min(count, FIRST).bit_length() - 1)


class Fitted(NamedTuple):
    """Options by name, and the divisors of the inputs."""

    options: dict[str, Any]
    norm_in: Array


def is_auto(value: Any) -> bool:
    """Whether it is "auto" (an array is not)."""
    return isinstance(value, str) and value == "auto"


def without_auto(options: dict[str, Any]) -> dict[str, Any]:
    """The options with the values of `GIVEN` in place of "auto"."""
    return {name: GIVEN[name] if name in GIVEN and is_auto(v) else v for name, v in options.items()}


def fitted(options: dict[str, Any], norm_in: Any, x: Array) -> Fitted:
    """What "auto" stands for after the first samples `x`; options by name, as given."""
    if not is_auto(options["init_D"]):
        return Fitted(without_auto(options), norms(norm_in, x, "norm_in"))
    if norm_in is None or is_auto(norm_in):
        with np.errstate(over="ignore", invalid="ignore"):
            sd = x.std(axis=0)
        norm = np.where(np.isfinite(sd) & (sd > 0), sd, 1.0)
    else:
        norm = norms(norm_in, x, "norm_in")
    out = dict(options)
    with np.errstate(over="ignore", invalid="ignore"):
        # The settings are for up to twice as many samples: for those in between.
        out["init_D"] = metric(x / norm, share(3 * len(x) // 2))
    if is_auto(out["w_cutoff"]):
        cutoff = min(CUTOFF * max(x.shape[1] - LEAST_INPUTS, 1), MOST_CUTOFF)
        out["w_cutoff"] = min(cutoff, out["w_gen"] / 2)
    if is_auto(out["update_D"]):
        out["update_D"] = False
    if not out["update_D"]:
        out["diagonal"] = True  # it stays a number times the identity: the same fields in less time
    return Fitted(out, norm)


def share(samples: int) -> float:
    """The mean activation of a sample in a field around another one."""
    return float(SHARE * (SAMPLES / max(samples, FEWEST)) ** 0.25)


def metric(x: Array, mean_activation: float) -> float:
    """The D for which exp(-D |x_i - x_j|^2 / 2) has this mean over pairs of samples (N, n) that differ."""
    some = x[np.linspace(0, len(x) - 1, min(len(x), LOOKED_AT)).astype(int)]
    squares = np.sum(some**2, axis=1)
    distance2 = (squares[:, None] + squares - 2 * some @ some.T)[np.triu_indices(len(some), 1)]
    distance2 = distance2[np.isfinite(distance2) & (distance2 > 1e-9)]
    if not len(distance2):
        return float(GIVEN["init_D"])
    low, high = np.log(D_RANGE)
    for _ in range(30):
        middle = (low + high) / 2
        if np.exp(-0.5 * np.exp(middle) * distance2).mean() > mean_activation:
            low = middle
        else:
            high = middle
    return float(f"{np.exp(low):.3g}")


# -- The state of an LWPR as the content of its file


KIND = FileKind("sdftrack.LWPR", 1, "LWPR.save")


def content_of(state: dict[str, Any]) -> dict[str, Any]:
    """Content of a file, from ``LWPR.__getstate__``; lists of numbers, which may be a whole metric, as arrays."""
    parameters = {
        name: np.array(value) if isinstance(value, list) else value
        for name, value in plain(state["parameters"]).items()
    }
    return {**state, "parameters": parameters}


def state_from(content: dict[str, Any]) -> dict[str, Any]:
    """What ``LWPR.__setstate__`` takes, from the content of a file."""
    return {**content, "parameters": plain(content["parameters"])}


def plain(value: Any) -> Any:
    """Convert numpy numbers and arrays, also inside lists and dictionaries, to plain Python types for JSON."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, dict):
        return {name: plain(v) for name, v in value.items()}
    return value


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
