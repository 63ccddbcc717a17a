# SPDX-License-Identifier: MIT
"""Unknowns, priors and the optimiser in plain numpy: the twin of cpp/optim."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def hat(v: Array) -> Array:
    """[v]x, so that ``hat(v) @ p`` is the cross product of v and p."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def rotation_from_mrp(r: Array) -> Array:
    """Rotation of the Modified Rodrigues Parameters r = tan(angle / 4) axis (thesis Eq. 3.5, corrected)."""
    s, K = float(r @ r), hat(r)
    return np.eye(3) + (8 * K @ K + 4 * (1 - s) * K) / (1 + s) ** 2


def mrp_from_rotation(R: Array) -> Array:
    """MRP of a rotation of less than 180 degrees: r = q / (1 + q0), from the unit quaternion (q0, q)."""
    q0 = np.sqrt(max(0.0, 1 + np.trace(R))) / 2
    q = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * q0)
    return q / (1 + q0)


def increment(v_m: Array, w_rad: Array) -> Array:
    """T(v, w), 4x4: the step of the optimiser, ``T_obj_cam <- T(v, w) T_obj_cam``, with MRP r = w / 4."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_from_mrp(np.asarray(w_rad) / 4), v_m
    return T


@dataclass(frozen=True)
class State:
    """A point in the space of unknowns: the pose, and where wanted the log of the size or (fx, fy, cx, cy)."""

    T_obj_cam: Array
    log_scale: float | None = None
    K: Array | None = None


def retract(x: State, delta: Array) -> State:
    """`x` moved by (v, w [, log scale | fx, fy, cx, cy])."""
    moved = dataclasses.replace(x, T_obj_cam=increment(delta[:3], delta[3:6]) @ x.T_obj_cam)
    if x.log_scale is not None:
        moved = dataclasses.replace(moved, log_scale=x.log_scale + float(delta[6]))
    if x.K is not None:
        moved = dataclasses.replace(moved, K=x.K + delta[-4:])
    return moved


class NormalEquations(NamedTuple):
    """cost + gradient . d + d^T hessian d / 2."""

    cost: float
    gradient: Array
    hessian: Array


class Step(NamedTuple):
    """One trial: the cost at the state that was kept, the damping used, whether the trial was kept."""

    cost: float
    damping: float
    accepted: bool


@dataclass(frozen=True)
class PosePrior:
    """E = |v|^2 / (2 sigma_m^2) + |w|^2 / (2 sigma_rad^2), (v, w) the increment from the prior pose to x."""

    T_obj_cam: Array
    sigma_m: float
    sigma_rad: float

    def error(self, x: State) -> Array:
        D = x.T_obj_cam @ np.linalg.inv(self.T_obj_cam)
        return np.concatenate([D[:3, 3], 4 * mrp_from_rotation(D[:3, :3])])

    def cost(self, x: State) -> float:
        e = self.error(x)
        return float(e[:3] @ e[:3] / (2 * self.sigma_m**2) + e[3:] @ e[3:] / (2 * self.sigma_rad**2))

    def linearize(self, x: State) -> NormalEquations:
        """A small turn w on the left moves t by w x t, the MRP by ((1 - |r|^2) w + 2 w x r + 2 (r . w) r) / 4."""
        e = self.error(x)
        r = e[3:] / 4
        J = np.eye(6)
        J[:3, 3:] = -hat(e[:3])
        J[3:, 3:] = (1 - r @ r) * np.eye(3) - 2 * hat(r) + 2 * np.outer(r, r)
        information = np.diag([self.sigma_m**-2] * 3 + [self.sigma_rad**-2] * 3)
        return NormalEquations(self.cost(x), J.T @ information @ e, J.T @ information @ J)


def minimize(
    cost: Callable[[State], float],
    linearize: Callable[[State], NormalEquations],
    x: State,
    *,
    max_steps: int = 20,
    damping: float = 1e-3,
    damping_up: float = 10.0,
    damping_down: float = 0.1,
    cost_gain: float = 0.0,
    sure_gain: float = 0.0,
    cost_relative: float = 1e-7,
    damping_max: float = 1e6,
    fixed: Array | None = None,
) -> tuple[State, list[Step], str]:
    """Levenberg-Marquardt: solve (H + damping diag H) d = -g, keep x + d where that lowers the cost.

    Damping shrinks after a kept step and grows after a refused one. A step that promises less than `sure_gain` is kept
    without a look, and is the last. `fixed` unknowns are taken out of the system.
    Returns the state, every trial, and why it stopped.
    """
    steps: list[Step] = []
    eq = linearize(x)
    free = np.arange(len(eq.gradient)) if fixed is None else np.nonzero(~np.asarray(fixed, bool))[0]
    for _ in range(max_steps):
        H = eq.hessian[np.ix_(free, free)]
        d = np.zeros(len(eq.gradient))
        d[free] = np.linalg.solve(H + damping * np.diag(np.diag(H)), -eq.gradient[free])
        promised = -float(eq.gradient @ d + d @ eq.hessian @ d / 2)
        if promised < cost_gain:
            return x, steps, "small_gain"
        trial = retract(x, d)
        if promised < sure_gain:
            return trial, [*steps, Step(eq.cost - promised, damping, True)], "small_gain"
        trial_cost = cost(trial)
        accepted, used = trial_cost < eq.cost, damping
        if accepted:
            gain = eq.cost - trial_cost
            little = gain < cost_relative * abs(eq.cost)
            x, eq, damping = trial, linearize(trial), damping * damping_down
        else:
            little, damping = False, damping * damping_up
        steps.append(Step(min(trial_cost, eq.cost), used, accepted))
        if little:
            return x, steps, "small_gain"
        if damping > damping_max:
            return x, steps, "damping_max"
    return x, steps, "max_steps"
