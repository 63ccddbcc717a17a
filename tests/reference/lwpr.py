# SPDX-License-Identifier: MIT
"""Locally weighted projection regression in numpy, one sample at a time: docs/math/lwpr.md, whose equation
numbers stand beside the formulas.

Vijayakumar, D'Souza and Schaal, Incremental online learning in high dimensions, Neural Computation 17 (2005);
equations 6.5 to 6.15 of the thesis. `Unit` is one output; `sdftrack.LWPR` has one for each.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SS_FLOOR = 1e-10  # of the sum of squared projections: nothing is divided by 0
FIRST_U = 1e-10  # length of a projection at first: the first sample turns it
MAX_LEVERAGE = 0.9  # beyond it a sample alone decides the regression, and leaving it out means nothing
MAX_STEP = 0.1  # of M_ii, that an entry of row i of M may move in a step
METRIC_AFTER = 20  # samples per input, after which the metric is learnt: steps go with 1 / sum of weights
JUDGE_AFTER = 10  # samples per input, after which the newest projection is judged
MAX_LOG_RATE = 50.0  # of a learnt rate: exp must stay finite


@dataclass(frozen=True)
class Options:
    """See `sdftrack.LWPR`; the names are the same."""

    w_gen: float = 0.2
    w_prune: float = 0.95
    w_cutoff: float = 0.01
    init_D: Array = field(default_factory=lambda: 25.0 * np.eye(1))
    diagonal: bool = False
    update_D: bool = True
    init_alpha: float = 50.0
    meta: bool = False
    meta_rate: float = 1.0
    penalty: float = 1e-8
    add_threshold: float = 0.5
    init_lambda: float = 0.999
    final_lambda: float = 0.99999
    tau_lambda: float = 0.9999


class Field:
    """A receptive field: where it is, how far it reaches, and its regression by projections."""

    def __init__(self, center: Array, options: Options) -> None:
        n = len(center)
        self.options = options
        self.center = np.array(center, np.float64)
        self.M = np.asarray(np.linalg.cholesky(options.init_D).T, np.float64)  # upper triangular, D = M^T M
        self.R = min(2, n)
        self.lam = options.init_lambda
        self.n_data, self.W = 0, 0.0
        self.a0, self.beta0 = np.zeros(n), 0.0
        self.u = FIRST_U * np.eye(n)
        self.SS = np.full(n, SS_FLOOR)
        self.SR, self.beta, self.MSE, self.Wr = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
        self.SZ, self.p = np.zeros((n, n)), np.zeros((n, n))
        self.n_r = np.zeros(n, int)
        # Of the leave-one-out cost: weights, squared errors, H, the matrix R, leverages.
        self.WJ, self.E, self.H, self.Rm, self.SSp = 0.0, 0.0, np.zeros(n), np.zeros((n, n)), 0.0
        self.alpha = np.full((n, n), options.init_alpha)
        self.log_alpha, self.h_meta = np.log(self.alpha), np.zeros((n, n))

    def activation(self, x: Array) -> float:
        """Eq. 1 (6.5)."""
        m = self.M @ (x - self.center)
        w = float(np.exp(-0.5 * m @ m))
        return w if w >= self.options.w_cutoff else 0.0

    @property
    def trusted(self) -> int:
        """How many projections have seen enough for their slopes to be used."""
        return int(np.sum(self.n_r[: self.R] > 2 * len(self.center)))

    def learn(self, x: Array, y: float, w: float) -> None:
        s, res = self._regress(x, y, w)
        if self.trusted > 0:
            self._judge(x, s, res, w)
        o = self.options
        self.lam = o.tau_lambda * self.lam + (1 - o.tau_lambda) * o.final_lambda
        self._add_projection()

    def _regress(self, x: Array, y: float, w: float) -> tuple[Array, Array]:
        """Eqs. 2 to 4 (6.6 to 6.11). The projections, and the residual after r of them."""
        lam = self.lam
        self.n_data += 1
        W = lam * self.W + w
        self.a0 = (lam * self.W * self.a0 + w * x) / W
        self.beta0 = (lam * self.W * self.beta0 + w * y) / W
        self.W = W
        z = x - self.a0
        s, res = np.zeros(len(x)), np.full(len(x) + 1, y - self.beta0)
        for r in range(self.R):
            length = np.linalg.norm(self.u[r])
            s[r] = z @ self.u[r] / length if length > 0 else 0.0
            self.SS[r] = max(lam * self.SS[r] + w * s[r] ** 2, SS_FLOOR)
            self.SR[r] = lam * self.SR[r] + w * s[r] * res[r]
            self.SZ[r] = lam * self.SZ[r] + w * s[r] * z
            self.u[r] = lam * self.u[r] + w * res[r] * z
            self.beta[r] = self.SR[r] / self.SS[r]
            self.p[r] = self.SZ[r] / self.SS[r]
            z = z - s[r] * self.p[r]
            res[r + 1] = res[r] - s[r] * self.beta[r]
            self.MSE[r] = lam * self.MSE[r] + w * res[r + 1] ** 2
            self.Wr[r] = lam * self.Wr[r] + w
            self.n_r[r] += 1
        return s, res

    def _judge(self, x: Array, s: Array, res: Array, w: float) -> None:
        """The traces of the leave-one-out cost and a step of the metric (eqs. 6 to 9)."""
        t, lam = self.trusted, self.lam
        s, e = s[:t], res[t]
        Ps = s / self.SS[:t]
        h = min(float(w * s @ Ps), MAX_LEVERAGE)
        e_cv = e / (1 - h)
        self.WJ = lam * self.WJ + w
        self.E = lam * self.E + w * e_cv**2
        self.H[:t] = lam * self.H[:t] + w * e_cv / (1 - h) * s
        self.Rm[:t, :t] = lam * self.Rm[:t, :t] + w**2 * e_cv**2 / (1 - h) * np.outer(s, s)
        self.SSp = lam * self.SSp + w * h
        if self.options.update_D and self.n_data >= METRIC_AFTER * len(x):
            slope = loo_slope(e, h, Ps, self.E, self.WJ, self.H[:t], self.Rm[:t, :t])
            curve = (2 * e * e_cv * float(s @ Ps) - 2 * slope) / self.WJ
            self._step(x, w, slope, curve)

    def _step(self, x: Array, w: float, slope: float, curve: float) -> None:
        o, n = self.options, len(x)
        used = np.eye(n) if o.diagonal else np.triu(np.ones((n, n)))
        gradient = used * metric_gradient(self.M, x - self.center, w, slope, o.penalty, self.WJ)
        if o.meta:
            self._adapt_rates(x - self.center, w, slope, curve, gradient)
        most = MAX_STEP * np.diag(self.M)[:, None]
        self.M = self.M + np.clip(-self.alpha * gradient, -most, most)

    def _adapt_rates(self, d: Array, w: float, slope: float, curve: float, gradient: Array) -> None:
        """Learning rates that learn (eq. 10): Sutton's incremental delta-bar-delta with second derivatives."""
        o, M = self.options, self.M
        self.log_alpha = self.log_alpha - o.meta_rate * gradient * self.h_meta
        self.log_alpha = np.clip(self.log_alpha, -MAX_LOG_RATE, MAX_LOG_RATE)
        self.alpha = np.exp(self.log_alpha)
        Md, D = M @ d, M.T @ M
        dw = -w * np.outer(Md, d)
        ddw = w * (Md[:, None] ** 2 - 1) * d[None, :] ** 2
        ddJ2 = 4 * o.penalty / len(d) * (np.diag(D)[None, :] + M**2 + np.diag(M @ M.T)[:, None])
        dd = curve * dw**2 + slope * ddw + w / self.WJ * ddJ2
        self.h_meta = self.h_meta * np.clip(1 - self.alpha * dd, 0, 1) - self.alpha * gradient

    def _add_projection(self) -> None:
        """One more where the last one has paid (6.11 and what follows it)."""
        n, R = len(self.center), self.R
        if R < 2 or n <= R or self.n_r[R - 1] <= JUDGE_AFTER * n:
            return
        if self.MSE[R - 1] / self.Wr[R - 1] < self.options.add_threshold * self.MSE[R - 2] / self.Wr[R - 2]:
            self.R = R + 1

    def predict(self, x: Array) -> tuple[float, float]:
        """What the field says, and s^T P s of x (eq. 5)."""
        z, y, leverage = x - self.a0, self.beta0, 0.0
        for r in range(self.trusted):
            length = np.linalg.norm(self.u[r])
            s = z @ self.u[r] / length if length > 0 else 0.0
            y += s * self.beta[r]
            leverage += s * s / self.SS[r]
            z = z - s * self.p[r]
        return float(y), float(leverage)

    def variance(self) -> float:
        """Of the noise, from the residuals after the projections that are used."""
        t = self.trusted
        return float(self.MSE[t - 1] / max(self.Wr[t - 1] - self.SSp, (1 - MAX_LEVERAGE) * self.Wr[t - 1]))


def loo_slope(e: float, h: float, Ps: Array, E: float, W: float, H: Array, R: Array) -> float:
    """dJ1 / dw of the leave-one-out cost by the weight of the sample (eq. 7)."""
    e_cv = e / (1 - h)
    own = e_cv**2 * (1 + h) / (1 - h) - 2 * e * float(Ps @ H) - 2 * float(Ps @ R @ Ps)
    return own / W - E / W**2


def metric_gradient(M: Array, d: Array, w: float, slope: float, penalty: float, W: float) -> Array:
    """Of the penalised cost by M (eq. 8), for a sample at d from the centre; the upper triangle counts."""
    out: Array = -slope * w * np.outer(M @ d, d) + w / W * 4 * penalty / len(d) * M @ (M.T @ M)
    return out


class Unit:
    """One output.

    >>> unit = Unit(2, Options(init_D=25 * np.eye(2)))
    >>> unit.update(np.array([0.1, 0.2]), 1.0)
    """

    def __init__(self, n_in: int, options: Options) -> None:
        self.n_in, self.options = n_in, options
        self.fields: list[Field] = []
        self.n_seen, self.mean_y = 0, 0.0

    def update(self, x: Array, y: float) -> None:
        """Table 6.2 of the thesis."""
        self.n_seen += 1
        self.mean_y += (y - self.mean_y) / self.n_seen
        w = np.array([f.activation(x) for f in self.fields])
        for k in np.flatnonzero(w):
            self.fields[k].learn(x, y, w[k])
        if len(w) == 0 or w.max() < self.options.w_gen:
            new = Field(x, self.options)
            new.learn(x, y, 1.0)
            self.fields.append(new)
        elif len(w) > 1:
            self._prune(w)

    def _prune(self, w: Array) -> None:
        """Of two that both cover the sample, the one with the larger error goes; else the younger one."""
        first, second = np.argsort(-w, kind="stable")[:2]
        if w[second] <= self.options.w_prune:
            return
        a, b = sorted((int(first), int(second)))
        fa, fb = self.fields[a], self.fields[b]
        if fa.trusted and fb.trusted:
            gone = a if fa.MSE[fa.trusted - 1] * fb.W > fb.MSE[fb.trusted - 1] * fa.W else b
        else:
            gone = a if fb.trusted else b
        self.fields[gone] = self.fields[-1]
        self.fields.pop()

    def predict(self, x: Array) -> tuple[float, float]:
        """Mean and sd (eqs. 11 to 13)."""
        w = np.array([f.activation(x) for f in self.fields])
        ready = np.array([f.trusted > 0 for f in self.fields])
        if not np.any(w[ready] > 0):
            if not np.any(w > 0):
                return self.mean_y, np.inf
            young = [f.beta0 for f in self.fields]
            return float(w @ np.array(young) / w.sum()), np.inf
        w = np.where(ready, w, 0.0)
        said = [f.predict(x) for f in self.fields]
        means = np.array([m for m, _ in said])
        mean = float(w @ means / w.sum())
        between = float(w @ (means - mean) ** 2)
        within = sum(
            w[k] * f.variance() * (1 + w[k] * said[k][1]) for k, f in enumerate(self.fields) if w[k] > 0
        )
        return mean, float(np.sqrt(between + within) / w.sum())
