# SPDX-License-Identifier: MIT
"""Settings of an LWPR that follow from its first samples."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.lwpr_data import norms

__all__ = ["AUTO", "FIRST", "Fitted", "fitted", "is_auto", "metric", "without_auto"]

Array = NDArray[np.float64]
AUTO = ("w_cutoff", "init_D", "update_D")  # options that may be "auto"
GIVEN = {"w_cutoff": 0.01, "init_D": 25.0, "update_D": True}  # in its place, with an init_D of one's own
FIRST = 256  # samples, after which settings are fixed
# Part of the data that a field covers, for 4,000 samples; with more of them fields may be smaller, and a stream is
# taken for at least 1,000.
SHARE, SAMPLES, FEWEST = 0.015, 4000, 1000
LOOKED_AT = 300  # samples, of which all pairs are
# Far from a field's centre lie more samples the more inputs there are: they weigh less there.
CUTOFF, LEAST_INPUTS, MOST_CUTOFF = 0.01, 3, 0.05
D_RANGE = (1e-6, 1e8)


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
        out["init_D"] = metric(x / norm, share(len(x)))
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
