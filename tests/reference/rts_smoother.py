# SPDX-License-Identifier: MIT
"""A Rauch-Tung-Striebel smoother of one coordinate, step by step, for comparison."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def smooth_coordinate(
    times_s: Array, values: Array, variances: Array, intensity: float
) -> tuple[Array, Array]:
    """Position, velocity and acceleration under white noise of `intensity` in the jerk.

    Kalman filter forwards, smoother backwards (Rauch and others 1965). The first state is unknown.

    Returns
    -------
    means : (n, 3) float64
    covariances : (n, 3, 3) float64
    """
    n = len(times_s)
    x, P = np.array([values[0], 0.0, 0.0]), np.diag([1e2, 1e4, 1e6])
    H = np.array([[1.0, 0.0, 0.0]])
    filtered, predicted, steps = [], [], []
    for k in range(n):
        F, Q = np.eye(3), np.zeros((3, 3))
        if k:
            F, Q = _model(times_s[k] - times_s[k - 1], intensity)
            x, P = F @ x, F @ P @ F.T + Q
        predicted.append((x, P))
        steps.append(F)
        S = H @ P @ H.T + variances[k]
        gain = P @ H.T / S
        x = x + (gain * (values[k] - x[0])).ravel()
        left = np.eye(3) - gain @ H
        P = left @ P @ left.T + gain @ gain.T * variances[k]  # Joseph's form, for accuracy
        filtered.append((x, P))
    means, covariances = [filtered[-1][0]], [filtered[-1][1]]
    for k in range(n - 2, -1, -1):
        (x, P), (ahead, P_ahead), F = filtered[k], predicted[k + 1], steps[k + 1]
        G = np.linalg.solve(P_ahead, F @ P).T
        means.append(x + G @ (means[-1] - ahead))
        covariances.append(P + G @ (covariances[-1] - P_ahead) @ G.T)
    return np.array(means[::-1]), np.array(covariances[::-1])


def _model(dt: float, intensity: float) -> tuple[Array, Array]:
    """Transition and noise over `dt`."""
    F = np.array([[1, dt, dt**2 / 2], [0, 1, dt], [0, 0, 1]])
    Q = intensity * np.array(
        [
            [dt**5 / 20, dt**4 / 8, dt**3 / 6],
            [dt**4 / 8, dt**3 / 3, dt**2 / 2],
            [dt**3 / 6, dt**2 / 2, dt],
        ]
    )
    return F, Q
