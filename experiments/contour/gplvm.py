# SPDX-License-Identifier: MIT
"""A Gaussian process latent variable model of silhouettes' harmonics, and the search in it for a hidden silhouette.

After N. Lawrence, "Probabilistic non-linear principal component analysis with Gaussian process latent variable models",
JMLR 2005, and V. Prisacariu and I. Reid, "Nonlinear shape manifolds as shape priors in level set segmentation and
tracking", CVPR 2011: the harmonics of N silhouettes are smooth random functions of N points of two or three dimensions,
which are found together with the scales of the functions; a silhouette is segmented by moving a point such that the
function's mean there, as a picture, explains the pixels.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

MOST_STEPS = 400  # of the fit; later ones change the likelihood by less than a thousandth
JITTER = 1e-6
STEEPNESS = 4.0  # of the step from outside to inside; pictures of ten harmonics are about -1 and 1
FIRST_SCALES = np.log([1.0, 1.0, 0.05])  # variance, inverse squared length, variance of the noise


class GPLVM:
    """Latent points X (N, q) of codes (N, m), with the covariance v exp(-g |x - x'|^2 / 2) + noise.

    ``mean(x)`` gives codes of new points; the fit starts at the principal components.
    """

    def __init__(self, codes: Array, q: int = 2) -> None:
        self.center = codes.mean(axis=0)
        self.scale = max(1e-9, float(np.sqrt(((codes - self.center) ** 2).mean())))
        Y = (codes - self.center) / self.scale
        self._YY, self._m = Y @ Y.T, Y.shape[1]
        U, s, _ = np.linalg.svd(Y, full_matrices=False)
        start = np.zeros((len(Y), q))
        k = min(q, len(s))
        start[:, :k] = U[:, :k] * np.sqrt(len(Y))
        found = minimize(
            self._cost, np.append(start.ravel(), FIRST_SCALES), jac=True, method="L-BFGS-B",
            options={"maxiter": MOST_STEPS},
        )  # fmt: skip
        self.X = found.x[:-3].reshape(len(Y), q)
        self.variance, self.gamma, self.noise = np.exp(found.x[-3:])
        K = self._covariance(self.X) + (self.noise + JITTER) * np.eye(len(Y))
        self._weights = cho_solve(cho_factor(K, lower=True), Y)  # (N, m)

    def mean(self, x: Array) -> tuple[Array, Array]:
        """Code (m,) at a point x (q,), and its derivative (q, m)."""
        away = x - self.X
        k = self.variance * np.exp(-0.5 * self.gamma * (away**2).sum(axis=1))
        code = self.center + self.scale * (k @ self._weights)
        return code, self.scale * ((-self.gamma * k[:, None] * away).T @ self._weights)

    def means(self) -> Array:
        """(N, m) the codes at the latent points themselves."""
        return self.center + self.scale * (self._covariance(self.X) @ self._weights)

    def _covariance(self, X: Array) -> Array:
        squares = (X**2).sum(axis=1)
        far = squares[:, None] + squares - 2 * X @ X.T
        return np.asarray(self.variance * np.exp(-0.5 * self.gamma * np.maximum(far, 0)))

    def _cost(self, parameters: Array) -> tuple[float, Array]:
        """Negative log posterior of latent points, with the prior N(0, 1), and logarithms of the scales."""
        n = len(self._YY)
        X = parameters[:-3].reshape(n, -1)
        self.variance, self.gamma, self.noise = np.exp(np.clip(parameters[-3:], -12, 12))
        signal = self._covariance(X)
        K = signal + (self.noise + JITTER) * np.eye(n)
        factor = cho_factor(K, lower=True)
        inverse = cho_solve(factor, np.eye(n))
        fit = inverse @ self._YY
        cost = self._m * np.log(np.diag(factor[0])).sum() + 0.5 * np.trace(fit) + 0.5 * (X**2).sum()
        to_K = 0.5 * (self._m * inverse - fit @ inverse)
        both = to_K * signal
        to_X = -2 * self.gamma * (both.sum(axis=1)[:, None] * X - both @ X) + X
        squares = (X**2).sum(axis=1)
        far = np.maximum(squares[:, None] + squares - 2 * X @ X.T, 0)
        to_scales = [both.sum(), -0.5 * self.gamma * (both * far).sum(), self.noise * np.trace(to_K)]
        return float(cost), np.append(to_X.ravel(), to_scales)


class LatentSearch:
    """Completes silhouettes by the latent point whose picture explains the visible pixels best.

    Parameters
    ----------
    model : GPLVM
    pictures : (pixels, m)
        Pictures of unit codes: their sum is above 0 inside.
    seen_inside, seen_outside : float
        Probability that a pixel inside the whole silhouette is seen, and one outside.
    starts : int
        Searches, from the training shapes that explain it best; the best result is taken.
    """

    def __init__(
        self,
        model: GPLVM,
        pictures: Array,
        seen_inside: float = 0.5,
        seen_outside: float = 0.02,
        starts: int = 3,
    ) -> None:
        self.model, self._pictures, self._starts = model, pictures, starts
        self._inside = np.array(
            [1 - seen_inside, seen_inside]
        )  # likelihood of a pixel that is not seen, or is
        self._outside = np.array([1 - seen_outside, seen_outside])
        self._shapes = _inside(model.means() @ pictures.T).astype(np.float32)

    def complete(self, seen: Mask) -> Array:
        """Code of the whole silhouette."""
        pixels = seen.ravel().astype(int)
        inside, outside = self._inside[pixels], self._outside[pixels]
        fits = self._shapes @ np.log(inside / outside).astype(np.float32)
        found: list[Any] = [
            minimize(self._cost, self.model.X[k], (inside - outside, outside), jac=True, method="L-BFGS-B")
            for k in np.argsort(-fits, kind="stable")[: self._starts]
        ]
        return self.model.mean(min(found, key=lambda f: float(f.fun)).x)[0]

    def _cost(self, x: Array, more_inside: Array, outside: Array) -> tuple[float, Array]:
        """Negative log likelihood of the pixels (pixel-wise posteriors) and of x, and the derivative."""
        code, to_code = self.model.mean(x)
        inside = _inside(self._pictures @ code)
        likelihood = outside + inside * more_inside
        per_pixel = -more_inside / likelihood * inside * (1 - inside) * STEEPNESS
        cost = -np.log(likelihood).sum() + 0.5 * (x**2).sum()
        return float(cost), to_code @ (self._pictures.T @ per_pixel) + x


def _inside(picture: Array) -> Array:
    return np.asarray(1 / (1 + np.exp(-np.clip(STEEPNESS * picture, -40, 40))))
