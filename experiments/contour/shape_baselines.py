# SPDX-License-Identifier: MIT
"""What a shape memory is compared with: the nearest training shape, and principal components, of harmonics.

They take the place of the thesis' GPLVM, a search in a learnt latent space that takes seconds a frame and is not built
here (experiments/contour/gplvm.py has one). Each is given coefficients (m,) of an observed silhouette and gives those
of the whole one.
"""

from __future__ import annotations

from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
KEPT_VARIANCE = 0.95
NOISE = 0.1  # of a high coefficient over its standard deviation, where components are fitted to it
ROUNDS = 5  # of the reweighted fit
OUTLIER = 2.0  # residuals in robust standard deviations, from which on a coefficient counts less


class Baseline(Protocol):
    """Made from (N, m) training coefficients and a mask of the high ones."""

    def __init__(self, codes: Array, high: NDArray[np.bool_]) -> None: ...

    def complete(self, c: Array) -> Array:
        """Coefficients of the whole silhouette."""


class NearestHigh:
    """The low harmonics of the training shape with the nearest high ones; the observed high ones."""

    def __init__(self, codes: Array, high: NDArray[np.bool_]) -> None:
        self.codes, self.high = codes, high

    def complete(self, c: Array) -> Array:
        k = np.argmin(((self.codes[:, self.high] - c[self.high]) ** 2).sum(axis=1))
        return np.where(self.high, c, self.codes[k])


class NearestAll:
    """The training shape that is nearest in all harmonics."""

    def __init__(self, codes: Array, high: NDArray[np.bool_]) -> None:
        self.codes = codes

    def complete(self, c: Array) -> Array:
        return self.codes[np.argmin(((self.codes - c) ** 2).sum(axis=1))]


class _Principal:
    """Mean and components that keep 95 % of the variance."""

    def __init__(self, codes: Array, high: NDArray[np.bool_]) -> None:
        self.high, self.mean = high, codes.mean(axis=0)
        _, s, Vt = np.linalg.svd(codes - self.mean, full_matrices=False)
        share = np.cumsum(s**2) / max(1e-12, float((s**2).sum()))
        self.rank = int(np.searchsorted(share, KEPT_VARIANCE)) + 1
        self.V = Vt[: self.rank].T  # (m, r)
        self.sd = np.maximum(s[: self.rank] / np.sqrt(len(codes)), 1e-9)


class PrincipalHigh(_Principal):
    """Components fitted to the high harmonics; the low ones are the mean's and the components'."""

    def complete(self, c: Array) -> Array:
        A = self.V[self.high] * self.sd
        noise = NOISE * np.sqrt(float((A**2).sum(axis=1).mean()))
        x = np.linalg.solve(A.T @ A + noise**2 * np.eye(self.rank), A.T @ (c - self.mean)[self.high])
        return np.where(self.high, c, self.mean + self.V @ (self.sd * x))


class PrincipalAll(_Principal):
    """The observed silhouette projected on the components, coefficients that do not fit counting less."""

    def complete(self, c: Array) -> Array:
        d, x = c - self.mean, np.zeros(self.rank)
        weights = np.ones(len(c))
        for _ in range(ROUNDS):
            A = self.V * weights[:, None]
            x = np.linalg.solve(self.V.T @ A + np.diag(1e-2 / self.sd**2), A.T @ d)
            off = np.abs(d - self.V @ x)
            weights = 1 / np.maximum(1, off / (OUTLIER * 1.4826 * np.median(off) + 1e-9))
        return np.asarray(self.mean + self.V @ x)


BASELINES: dict[str, type[Baseline]] = {
    "NN high": NearestHigh,
    "NN all": NearestAll,
    "PCA high": PrincipalHigh,
    "PCA all": PrincipalAll,
}
