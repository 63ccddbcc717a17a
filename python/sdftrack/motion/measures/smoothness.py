# SPDX-License-Identifier: MIT
"""Smoothness: spectral arc length (SPARC) and log dimensionless jerk (LDLJ).

Both as Balasubramanian, Melendez-Calderon, Roby-Brami and Burdet define them: On the analysis of movement smoothness,
Journal of NeuroEngineering and Rehabilitation 12:112, 2015, doi 10.1186/s12984-015-0090-9.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.validation import number, numbers, shown
from sdftrack.motion.definitions import Context, measure
from sdftrack.motion.measures.movement import movement_of
from sdftrack.motion.posterior import MotionSamples

Array = NDArray[np.float64]
LEAST_HZ, MOST_HZ = 1e-9, 1e9
CUTOFF_HZ, THRESHOLD, PADDING = 10.0, 0.05, 4  # of the spectrum; doublings of its length


def sparc(speeds: ArrayLike, rate_hz: float) -> Array:
    """Spectral arc length of speed profiles: minus the length of the normalised spectrum's curve.

    SPARC = - integral from 0 to w_c of sqrt((1 / w_c)^2 + (d V / d w)^2) dw, with V = |V(w)| / V(0) the magnitude
    of the Fourier transform and w_c the last frequency up to 10 Hz at which V is 0.05 or more: what is beyond is taken
    for noise. Near -1.4 for a minimum-jerk movement, more negative for movements that are less smooth.

    Parameters
    ----------
    speeds : (..., n) array
        Norms of the velocity at regular times, from onset to offset.
    rate_hz : float
        Samples per second.

    Returns
    -------
    (...,) array
        NaN where the speed is 0 or not finite.

    >>> t = np.arange(0, 1, 0.01)
    >>> round(float(sparc(t**2 * (1 - t) ** 2, 100.0)), 2)
    -1.41
    """
    v, rate = numbers(speeds, "speeds"), _rate(rate_hz)
    if v.ndim < 1 or v.shape[-1] < 2:
        raise ValueError(f"speeds: expected shape (..., n) with n of 2 or more, got {v.shape}")
    if (v < 0).any():
        raise ValueError("speeds: expected norms of velocities, got a negative number")
    size = 2 ** (math.ceil(math.log2(v.shape[-1])) + PADDING)
    step = rate / size
    kept = int(min(CUTOFF_HZ, rate / 2) / step + 1e-9) + 1
    spectrum = np.abs(np.fft.rfft(v, size, axis=-1)[..., :kept])
    with np.errstate(divide="ignore", invalid="ignore"):
        spectrum /= spectrum[..., :1]
        last = kept - 1 - (spectrum >= THRESHOLD)[..., ::-1].argmax(axis=-1)  # spectrum[0] is 1
        steps = np.sqrt((1 / last[..., None]) ** 2 + np.diff(spectrum, axis=-1) ** 2)
        length = np.where(np.arange(kept - 1) < last[..., None], steps, 0).sum(axis=-1)
    defined = np.isfinite(v).all(axis=-1) & (v > 0).any(axis=-1) & (last > 0)
    return np.where(defined, -length, np.nan)


def log_dimensionless_jerk(velocities: ArrayLike, rate_hz: float, within: ArrayLike | None = None) -> Array:
    """Log dimensionless jerk: - ln(T^3 / v_peak^2 * integral of |d^2 v / dt^2|^2 dt).

    Larger (less negative) for smoother movements; - ln 204.8 = -5.32 for a minimum-jerk movement sampled finely.

    Parameters
    ----------
    velocities : (..., n, d) array
        At regular times.
    rate_hz : float
        Samples per second.
    within : (..., n) bool array, optional
        The samples of the movement, one run of them; all by default. T is their number times the time between them,
        v_peak the largest norm among them, and the jerk their second difference.

    Returns
    -------
    (...,) array
        NaN where fewer than three samples move or the jerk is 0.
    """
    rate = _rate(rate_hz)
    # Samples of a posterior are stored like their transpose, which is then not copied.
    v = (
        numbers(velocities.T, "velocities").T
        if isinstance(velocities, np.ndarray)
        else numbers(velocities, "velocities")
    )
    if v.ndim < 2 or v.shape[-2] < 1:
        raise ValueError(f"velocities: expected shape (..., n, d), got {v.shape}")
    inside = np.ones(v.shape[:-1], dtype=bool) if within is None else np.asarray(within, dtype=bool)
    if inside.shape != v.shape[:-1]:
        raise ValueError(f"within: expected shape {v.shape[:-1]}, as velocities, got {inside.shape}")
    jerk = np.diff(v, 2, axis=-2) * rate**2
    known = inside[..., 2:] & inside[..., 1:-1] & inside[..., :-2]
    integral = np.where(known, (jerk**2).sum(axis=-1), 0).sum(axis=-1) / rate
    peak = np.where(inside, np.linalg.norm(v, axis=-1), 0).max(axis=-1)
    duration = inside.sum(axis=-1) / rate
    with np.errstate(divide="ignore", invalid="ignore"):
        value = -np.log(duration**3 / peak**2 * integral)
    return np.where(np.isfinite(value), value, np.nan)


def _rate(rate_hz: float) -> float:
    rate = number(rate_hz, "rate_hz")
    if not LEAST_HZ < rate < MOST_HZ:
        raise ValueError(
            f"rate_hz: expected samples per second from {LEAST_HZ:g} to {MOST_HZ:g}, got {shown(rate_hz)}"
        )
    return rate


@measure("sparc")
def _sparc(samples: MotionSamples, context: Context) -> Array:
    return sparc(samples.speeds_mps * movement_of(samples).within, samples.rate_hz)


@measure("log_dimensionless_jerk")
def _log_dimensionless_jerk(samples: MotionSamples, context: Context) -> Array:
    return log_dimensionless_jerk(samples.velocities_mps, samples.rate_hz, movement_of(samples).within)
