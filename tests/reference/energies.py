# SPDX-License-Identifier: MIT
"""What a pose costs, in plain numpy: the twin of cpp/energies, one pixel after the other.

A pixel with ray r (z = 1) and depth z is the point ``p_cam = z r``. A field gives phi there, with its derivative by
the point and by the unknowns; the residual is a length along the ray; the penalty turns it into cost, slope and
curvature. Unknowns: ``T_obj_cam <- T(v, w) T_obj_cam``, then log scale, or fx, fy, cx, cy.
Derivation: docs/math/depth_tracker.md.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from reference.sdf import sample

Array = NDArray[Any]

GRAZING_SLOPE = 0.17  # d phi / d z along a ray at 80 degrees from the normal
FALLBACK_SLOPE = 0.3  # least slope that a pixel without a hit is divided by
HIT_TOLERANCE_M = 5e-4
HIT_LEAD_M = 0.003  # the search starts this far in front of the measurement
HIT_REACH_M = 0.05  # and begins again where it gets farther than this from the measurement
CONVERGED_M = 1e-5
NEWTON_STEPS = 8
POSTERIOR_FLOOR = 1e-3


class NormalEquations(NamedTuple):
    """cost + gradient . d + d^T hessian d / 2."""

    cost: float
    gradient: Array
    hessian: Array


class FieldRow(NamedTuple):
    """phi (m), d phi / d p_cam (3,), d phi / d unknowns (P,)."""

    phi: float
    grad_cam: Array
    J: Array


class Field(Protocol):
    """phi at a point of the camera's frame, with its derivatives."""

    def row(self, p_cam: Array) -> FieldRow: ...


@dataclass(frozen=True)
class SingleObject:
    """One object. J = (g, p x g): a step (v, w) moves the object point p by v + w x p (thesis Eq. 3.17)."""

    values: Array
    voxel_size: float
    origin: Array
    T_obj_cam: Array

    def row(self, p_cam: Array) -> FieldRow:
        R, t = self.T_obj_cam[:3, :3], self.T_obj_cam[:3, 3]
        p = R @ p_cam + t
        phi, g = sample(self.values, self.voxel_size, self.origin, p)
        return FieldRow(phi, R.T @ g, np.concatenate([g, np.cross(p, g)]))


@dataclass(frozen=True)
class ScaledObject:
    """One object of unknown size s = exp(log_scale): phi(p) = s phi_unit(p / s), so d phi / d log s = phi - p . g."""

    values: Array
    voxel_size: float
    origin: Array
    T_obj_cam: Array
    log_scale: float

    def row(self, p_cam: Array) -> FieldRow:
        R, t, s = self.T_obj_cam[:3, :3], self.T_obj_cam[:3, 3], np.exp(self.log_scale)
        p = R @ p_cam + t
        phi, g = sample(self.values, self.voxel_size, self.origin, p / s)
        return FieldRow(s * phi, R.T @ g, np.concatenate([g, np.cross(p, g), [s * phi - p @ g]]))


@dataclass(frozen=True)
class SoftMin:
    """Union of objects: phi = -log(sum exp(-a phi_k)) / a, its derivatives weighed by exp(-a phi_k) / sum.

    Thesis Eqs. 5.14 to 5.21, where Eq. 5.20 has a factor -1 / a too many.
    """

    objects: tuple[SingleObject, ...]
    sharpness_per_m: float

    def memberships(self, phis: Array) -> Array:
        weights: Array = np.exp(self.sharpness_per_m * (phis.min() - phis))
        return weights / weights.sum()

    def row(self, p_cam: Array) -> FieldRow:
        rows = [o.row(p_cam) for o in self.objects]
        phis, a = np.array([r.phi for r in rows]), self.sharpness_per_m
        w = self.memberships(phis)
        phi = phis.min() - np.log(np.exp(a * (phis.min() - phis)).sum()) / a
        grad: Array = sum(wk * r.grad_cam for wk, r in zip(w, rows, strict=True))
        return FieldRow(float(phi), grad, np.concatenate([wk * r.J for wk, r in zip(w, rows, strict=True)]))


@dataclass(frozen=True)
class WithIntrinsics:
    """Any field, plus columns for K = (fx, fy, cx, cy): p_cam = z ((u - cx) / fx, (v - cy) / fy, 1) moves with them."""

    field: Field
    K: Array

    def row(self, p_cam: Array) -> FieldRow:
        phi, g, J = self.field.row(p_cam)
        fx, fy = self.K[:2]
        x, y, z = p_cam
        return FieldRow(
            phi, g, np.concatenate([J, [-g[0] * x / fx, -g[1] * y / fy, -g[0] * z / fx, -g[1] * z / fy]])
        )


class Curve(NamedTuple):
    """Cost, its slope by the residual, and the curvature that the normal equations see (>= 0)."""

    cost: float
    slope: float
    curvature: float


@dataclass(frozen=True)
class DepthLogistic:
    """-log((1 - e) sech^2(r / 2s) + e): the logistic density (thesis Eq. 3.11) over a share e of outliers.

    ``curvature="irls"``: slope / r, the parabola that touches the cost; ``"printed"``: slope^2 (thesis Eq. 3.18).
    """

    scale_m: float
    outlier_floor: float = 0.0
    curvature: str = "irls"
    floor_behind: float | None = None  # e of measurements behind the surface (r < 0), where it is another

    def floor_of(self, residual: float) -> float:
        return self.outlier_floor if self.floor_behind is None or residual >= 0 else self.floor_behind

    def __call__(self, residual: float, noise_scale: float = 1.0) -> Curve:
        s, e = self.scale_m * noise_scale, self.floor_of(residual)
        u = residual / (2 * s)
        sech2 = 1 / np.cosh(u) ** 2
        likelihood = (1 - e) * sech2 + e
        inlier = (1 - e) * sech2 / likelihood
        slope = inlier * np.tanh(u) / s
        irls = slope / residual if abs(u) > 1e-3 else inlier / (2 * s * s)
        return Curve(
            float(-np.log(likelihood)), float(slope), float(irls if self.curvature == "irls" else slope**2)
        )

    def second_derivative(self, residual: float, noise_scale: float = 1.0) -> float:
        """d^2 cost / d r^2: negative where the cost redescends."""
        s, e = self.scale_m * noise_scale, self.floor_of(residual)
        tanh, sech2 = np.tanh(residual / (2 * s)), 1 / np.cosh(residual / (2 * s)) ** 2
        likelihood = (1 - e) * sech2 + e
        inlier = (1 - e) * sech2 / likelihood
        return float(inlier * (sech2 / 2 - e / likelihood * tanh**2) / s**2)


CLEAR_ODDS = 16.0


@dataclass(frozen=True)
class ColorOdds:
    """The depth penalty with each pixel's own share of outliers, by the posterior P_f of its colour.

    e_i / (1 - e_i) = e / (1 - e) max(1, min(q, (q / 16)^3)), q = ((1 - P_f) / (1 - prior)) / (P_f / prior):
    DepthLogistic where q < 16.
    """

    scale_m: float
    outlier_floor: float
    prior: float = 0.7

    def __call__(self, residual: float, noise_scale: float, foreground: float) -> Curve:
        s = self.scale_m * noise_scale
        q = ((1 - foreground) / (1 - self.prior)) / (foreground / self.prior)
        odds = self.outlier_floor / (1 - self.outlier_floor) * max(1.0, min(q, (q / CLEAR_ODDS) ** 3))
        return DepthLogistic(s, odds / (1 + odds))(residual)


@dataclass(frozen=True)
class ColorPrinted:
    """-log L, L = P_f d_on + P_b H_out (thesis Eq. 4.12, 4.13, 4.18) with posteriors and a small floor.

    d_on = sech^2(r / 2s); H_out = 1 - d_on in front of the surface (r >= 0), 0 behind it.
    """

    scale_m: float

    def __call__(self, residual: float, noise_scale: float, foreground: float) -> Curve:
        s = self.scale_m * noise_scale
        u = residual / (2 * s)
        on = 1 / np.cosh(u) ** 2
        d_on = -on * np.tanh(u) / s
        outside = (1 - foreground) if residual >= 0 else 0.0
        L = foreground * on + outside * (1 - on) + POSTERIOR_FLOOR
        weight = np.tanh(u) / (s * residual) if abs(u) > 1e-3 else 1 / (2 * s * s)
        return Curve(
            float(-np.log(L)),
            float(-(foreground - outside) * d_on / L),
            float(foreground * on / L * weight),
        )


class Hit(NamedTuple):
    """Where a ray meets the model: depth, and of the last sample the slope along the ray, J and phi."""

    z: float
    slope: float
    J: Array
    phi: float


def find_hit(field: Field, ray: Array, depth: float, steps: int = NEWTON_STEPS) -> Hit:
    """Newton's iteration for phi(z ray) = 0; the slope is at most -GRAZING_SLOPE.

    Starts slightly in front of the measurement, because from behind the middle of a thin wall it would miss the front.
    """
    z = depth - HIT_LEAD_M
    for _ in range(steps):
        phi, g, J = field.row(z * ray)
        slope = min(float(g @ ray), -GRAZING_SLOPE)
        z -= phi / slope
        if abs(phi) < CONVERGED_M:
            break
    if not abs(z - depth) < HIT_REACH_M:  # lost its way
        z = depth - HIT_LEAD_M
    return Hit(z, slope, J, phi)


def meets(field: Field, ray: Array, depth: float) -> bool:
    """Whether a pixel's ray hits the model: phi vanishes along it, and not at a grazing angle."""
    hit = find_hit(field, ray, depth)
    return abs(hit.phi) < HIT_TOLERANCE_M and hit.slope < -GRAZING_SLOPE


def fallback_gain(field: Field, ray: Array, depth: float) -> float:
    """1 / slope of phi along the ray at the measured point, bounded."""
    return 1 / max(abs(float(field.row(depth * ray).grad_cam @ ray)), FALLBACK_SLOPE)


def classify(field: Field, rays: Array, depths: Array, residual: str) -> Array:
    """Every pixel's class as a gain: 0, its ray meets the model; else what phi at the measured point is times.

    1 for the residual "point" (as printed, Eq. 3.11), 1 / slope for "slope" and for the misses of "ray_hit".
    """
    if residual == "point":
        return np.ones(len(rays))
    pixels = list(zip(rays, depths, strict=True))
    gains = np.array([fallback_gain(field, r, z) for r, z in pixels])
    if residual == "slope":
        return gains
    return np.where([meets(field, r, z) for r, z in pixels], 0.0, gains)


def read(field: Field, ray: Array, depth: float, gain: float) -> tuple[float, Array]:
    """Residual (m) of one pixel and its derivative by the unknowns.

    A hit's residual is its depth minus the measured depth; on the ray phi(z) = 0 stays true, so
    d z / d unknown = -(d phi / d unknown) / (d phi / d z).
    """
    if gain == 0:
        hit = find_hit(field, ray, depth)
        return hit.z - depth, -hit.J / hit.slope
    phi, _, J = field.row(depth * ray)
    return gain * phi, gain * J


def linearize(
    field: Field,
    rays: Array,
    depths: Array,
    gains: Array,
    penalty: DepthLogistic | ColorOdds | ColorPrinted,
    noise_scale: Array | None = None,
    foreground: Array | None = None,
) -> NormalEquations:
    """Cost, gradient and Hessian: the sum over pixels (rays (N, 3) with z = 1, depths (N,) m, gains (N,)).

    `foreground` (N,): the posteriors, for a penalty that asks for them.
    """
    colors: list[tuple[float, ...]] = [()] * len(depths)
    if foreground is not None:
        colors = [(float(p),) for p in foreground]
    evaluate: Any = penalty  # with a posterior, or without
    noise = np.ones(len(depths)) if noise_scale is None else noise_scale
    cost, gradient, hessian = 0.0, np.zeros(1), np.zeros((1, 1))
    for ray, depth, gain, n, color in zip(rays, depths, gains, noise, colors, strict=True):
        residual, J = read(field, ray, float(depth), float(gain))
        curve = evaluate(residual, float(n), *color)
        cost += curve.cost
        gradient = gradient + curve.slope * J
        hessian = hessian + curve.curvature * np.outer(J, J)
    return NormalEquations(cost, gradient, hessian)
