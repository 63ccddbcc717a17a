# SPDX-License-Identifier: MIT
"""Fits of noise and bias models to measurements from single images."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.calibration.depth_errors import WINDOW_PX, DepthErrors, rough_part

__all__ = ["SPAN", "NoiseSample", "fit_growth", "fit_noise", "neighbour_correlation", "noise_samples"]

Array = NDArray[np.float64]
BINS_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
STEP = 1.1  # of a bin of distances
ENOUGH = 400  # measurements of a bin
SPAN = 1.3  # largest over smallest distance, from which on growth with distance can be told
ROUNDS = 60
MIN_M = 1e-6


class NoiseSample(NamedTuple):
    """Noise sd (m) of measurements at one distance (m) and tan(incidence)."""

    depth: float
    tangent: float
    sd: float
    readings: int


def neighbour_correlation(rough: Array) -> float:
    """Correlation of neighbouring pixels; NaN if too few are known."""
    pairs = [(rough[:, 1:], rough[:, :-1]), (rough[1:], rough[:-1])]
    products, squares, count = 0.0, 0.0, 0
    for a, b in pairs:
        both = np.isfinite(a) & np.isfinite(b)
        products += float((a[both] * b[both]).sum())
        squares += float((a[both] ** 2 + b[both] ** 2).sum() / 2)
        count += int(both.sum())
    return products / squares if count >= ENOUGH and squares > 0 else math.nan


def noise_samples(errors: DepthErrors) -> list[NoiseSample]:
    """One sample per bin of distance and incidence with enough pixels of an image."""
    rough = rough_part(errors)
    known = np.isfinite(rough)
    if not known.any():
        return []
    r = neighbour_correlation(rough)
    # A window's mean takes part of the noise along: that of the pixels that share one error.
    shared = 1.0 if not r > 0.05 else 2 * math.pi * length_of(r) ** 2
    grown = 1 / math.sqrt(max(0.3, 1 - shared / WINDOW_PX**2))
    z, tangent, rough = errors.depth[known], errors.tangent[known], rough[known]
    depth_bin = np.floor(np.log(z) / math.log(STEP)).astype(int)
    angle_bin = np.digitize(np.degrees(np.arctan(tangent)), BINS_DEG)
    out = []
    for key in np.unique(100 * depth_bin + angle_bin):
        here = 100 * depth_bin + angle_bin == key
        if here.sum() < ENOUGH:
            continue
        sd = grown * float(np.sqrt(np.mean(rough[here] ** 2)))
        out.append(
            NoiseSample(float(np.median(z[here])), float(np.median(tangent[here])), sd, int(here.sum()))
        )
    return out


def length_of(neighbours: float) -> float:
    """The length (px) for which exp(-d^2 / (2 length^2)) equals `neighbours` at d = 1."""
    return math.sqrt(-1 / (2 * math.log(min(max(neighbours, 1e-9), 0.999))))


def fit_noise(samples: list[NoiseSample]) -> tuple[float, float, float]:
    """(noise_m, noise_per_m, noise_incidence), each >= 0: least squares of ln sd."""
    z, t, sd = (np.array([s[k] for s in samples]) for k in range(3))
    weight = np.sqrt(np.array([min(s.readings, 20000) for s in samples], np.float64))
    free = [True, z.max() > SPAN * z.min(), t.max() > 0.4 and np.ptp(t) > 0.3]
    x = np.log([np.median(sd) * 0.7, *([np.median(sd / z**2) * 0.3] * 1), np.median(sd / z) * 0.3])
    x[[k for k in range(3) if not free[k]]] = -50.0
    damping = 1e-2
    best = _misfit(x, z, t, sd, weight)
    for _ in range(ROUNDS):
        r = _residual(x, z, t, sd, weight)
        J = np.zeros((len(z), 3))
        for k in range(3):
            if free[k]:
                step = np.zeros(3)
                step[k] = 1e-5
                J[:, k] = (_residual(x + step, z, t, sd, weight) - r) / 1e-5
        H = J.T @ J
        d = np.linalg.lstsq(H + damping * np.diag(np.diag(H)) + 1e-9 * np.eye(3), -J.T @ r, rcond=None)[0]
        trial = np.clip(x + np.clip(d, -2, 2), -50, 2)
        now = _misfit(trial, z, t, sd, weight)
        if now < best:
            x, best, damping = trial, now, damping / 3
        else:
            damping *= 5
    values = np.where(np.exp(x) > MIN_M, np.exp(x), 0.0)
    return float(values[0]), float(values[1]), float(values[2])


def _residual(x: Array, z: Array, t: Array, sd: Array, weight: Array) -> Array:
    a, b, c = np.exp(x)
    residual: Array = weight * (np.log(np.hypot(a + b * z**2, c * z * t)) - np.log(sd))
    return residual


def _misfit(x: Array, z: Array, t: Array, sd: Array, weight: Array) -> float:
    return float((_residual(x, z, t, sd, weight) ** 2).sum())


def fit_growth(z: Array, value: Array, signed: bool) -> tuple[float, float]:
    """Robust fit of (constant, per Z^2) to values over distance; the growth is 0 if the range is too small.

    Unless `signed`, both are at least 0.
    """
    A = np.column_stack([np.ones(len(z)), z**2])
    if not z.max() > SPAN * z.min():
        return float(np.median(value)), 0.0
    x = np.linalg.lstsq(A, value, rcond=None)[0]
    for _ in range(10):
        r = np.abs(value - A @ x)
        w = 1 / np.maximum(r, max(1e-9, 0.3 * float(np.median(r))))
        x = np.linalg.lstsq(A * w[:, None] ** 0.5, value * w**0.5, rcond=None)[0]
    if not signed and x[0] < 0:
        return 0.0, max(0.0, float(np.median(value / z**2)))
    if not signed and x[1] < 0:
        return max(0.0, float(np.median(value))), 0.0
    return float(x[0]), float(x[1])
