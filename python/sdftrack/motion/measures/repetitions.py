# SPDX-License-Identifier: MIT
"""Of the repetitions and holds: how alike paths are (dynamic time warping), and tremor.

Tremor is the power of the measured positions between 3 and 12 Hz, less that of their noise. It is computed from the
poses themselves: a smoother would take a tremor away that is not far above the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal.windows import dpss

from sdftrack._internal.validation import number, numbers, shown
from sdftrack.motion.trajectory import Trajectory

Array = NDArray[np.float64]
POINTS = 60  # of a resampled path
BAND = 0.15
MOST_PAIRS = 200


def dtw_distance(a: ArrayLike, b: ArrayLike, band: float = BAND) -> float:
    """Mean distance of two paths along the best alignment of their times, in their unit.

    Dynamic time warping (Sakoe and Chiba 1978, symmetric, their band) of points (n, d) and (m, d): the sum of the
    distances of the points that the alignment pairs, over the number of pairs.

    Parameters
    ----------
    a, b : (n, d), (m, d) array
    band : float
        Largest shift of time, as a part of the paths; at least one point of the shorter one.

    >>> dtw_distance([[0.0], [1], [2]], [[0.0], [0], [1], [2]], 1)
    0.0
    """
    x, y = numbers(a, "a"), numbers(b, "b")
    if x.ndim != 2 or y.ndim != 2 or x.shape[1] != y.shape[1] or not len(x) or not len(y):
        raise ValueError(f"a, b: expected points (n, d) and (m, d), got shapes {x.shape} and {y.shape}")
    if not 0 < number(band, "band") <= 1:
        raise ValueError(f"band: expected more than 0 and at most 1, got {band!r}")
    n, m = len(x), len(y)
    distance = np.linalg.norm(x[:, None] - y[None], axis=-1)
    i, j = np.ogrid[:n, :m]
    width = max(band, 1 / min(n, m))  # or no alignment of a short path with a long one would fit in the band
    distance[np.abs(i / max(n - 1, 1) - j / max(m - 1, 1)) > width] = np.inf
    best = np.full((n + 1, m + 1), np.inf)
    best[0, 0] = 0.0
    for k in range(n + m - 1):  # one diagonal i + j = k at a time: its cells depend on earlier ones alone
        r = np.arange(max(0, k - m + 1), min(n, k + 1))
        c = k - r
        before = np.minimum(np.minimum(best[r, c + 1], best[r + 1, c]), best[r, c])
        best[r + 1, c + 1] = before + distance[r, c]
    a_left, b_left, pairs = n, m, 0  # of the best alignment, walked back from its end
    while a_left and b_left:
        pairs += 1
        before = (a_left - 1, b_left - 1), (a_left - 1, b_left), (a_left, b_left - 1)
        a_left, b_left = min(before, key=lambda cell: best[cell])
    return float(best[n, m] / pairs)


def mean_dtw_distance(paths: Sequence[Array]) -> float:
    """Mean :func:`dtw_distance` over the pairs of paths (n, 3), each resampled to 60 points; NaN for fewer than two.

    Of more than 200 pairs every k-th is used.
    """
    even = []
    for path in paths:
        at = np.linspace(0, len(path) - 1, POINTS)
        even.append(np.column_stack([np.interp(at, np.arange(len(path)), column) for column in path.T]))
    pairs = [(i, j) for i in range(len(even)) for j in range(i)]
    chosen = pairs[:: max(1, -(-len(pairs) // MOST_PAIRS))]
    return float(np.mean([dtw_distance(even[i], even[j]) for i, j in chosen])) if chosen else float("nan")


BAND_HZ = (3.0, 12.0)
TAPERS = 5
MIN_S = 1.0
MOST_M = 1e6


@dataclass(frozen=True)
class Tremor:
    """Tremor of a held object.

    Attributes
    ----------
    rms_m, low_m, high_m : float
        Root mean square of the displacement in the band, all axes together, noise taken off; 95 % interval.
    total_m : float
        With the noise.
    floor_m : float
        What a resting object would show: the root mean square of the noise in the band.
    frequency_hz : float
        Of the largest power in the band; NaN where the tremor is not determined.
    band_hz : (float, float)
        3 to 12 Hz, or to 90 % of half of the frame rate if that is lower.
    determined : bool
        The lower end of the interval is above 0 and the interval narrower than the value.
    """

    rms_m: float
    low_m: float
    high_m: float
    total_m: float
    floor_m: float
    frequency_hz: float
    band_hz: tuple[float, float]
    determined: bool


def tremor_of(trajectory: Trajectory, start_s: float, end_s: float, *, noise_m: float) -> Tremor | None:
    """The tremor in a hold.

    Parameters
    ----------
    trajectory : Trajectory
    start_s, end_s : float
        A stretch in which the object is held, s.
    noise_m : float
        Standard deviation of a measured position, all three axes together, m: of the covariances, scaled by the
        smoother's `noise_scales`.

    Returns
    -------
    Tremor or None
        None if the stretch is shorter than 1 s, has a gap or a frame rate below 8.5 Hz.

    Notes
    -----
    Multitaper spectrum (five Slepian tapers, Thomson 1982) of each axis after removal of a cubic. White noise of
    variance s^2 at a rate f has the power s^2 (f2 - f1) / (f / 2) in the band, which is subtracted. The variance of the
    rest is that of signal times noise and of noise times noise, bin by bin. Tapers make a bin's power more certain, but
    bins alike: the sum over the band is as uncertain as that of one taper.
    """
    if not 0 <= number(noise_m, "noise_m") < MOST_M:
        raise ValueError(f"noise_m: expected metres from 0 to {MOST_M:g}, got {shown(noise_m)}")
    inside = (trajectory.times_s >= start_s) & (trajectory.times_s <= end_s)
    t, x = trajectory.times_s[inside], trajectory.poses[inside, :3, 3]
    if len(t) < 16 or t[-1] - t[0] < MIN_S or not trajectory.usable[inside].all():
        return None
    step = float(np.median(np.diff(t)))
    if np.diff(t).max() > 1.5 * step:
        return None
    rate, low, high = 1 / step, BAND_HZ[0], min(BAND_HZ[1], 0.45 / step)
    if high <= low * 1.25:
        return None
    frequencies, spectra = _spectra(t, x, rate)
    band = (frequencies >= low) & (frequencies < high)
    df = frequencies[1]
    noise = noise_m**2 / (rate / 2)  # density, all axes together
    total = spectra[:, band].sum(axis=0)
    power, floor = float(total.sum() * df), float(noise * df * band.sum())
    signal = np.maximum(total - noise, 0)
    # Neighbouring bins of padded tapers are not independent: a bin counts for df times the duration.
    independent = min(1.0, df * (t[-1] - t[0] + step))
    spread = (2 * signal * noise / 3 + noise**2 / 3).sum() * df**2 / independent
    sd = float(np.sqrt(spread + (0.05 * floor) ** 2))
    rest = power - floor
    bounds = [float(np.sqrt(max(rest + k * 1.96 * sd, 0.0))) for k in (-1, 0, 1)]
    determined = bounds[0] > 0 and bounds[2] - bounds[0] < bounds[1]
    peak = float(frequencies[band][np.argmax(total)]) if determined else float("nan")
    return Tremor(
        bounds[1], bounds[0], bounds[2], float(np.sqrt(power)), float(np.sqrt(floor)), peak, (low, high), determined,
    )  # fmt: skip


def _spectra(t: Array, x: Array, rate: float) -> tuple[Array, Array]:
    """Frequencies, and one-sided power densities (3, F) of the axes."""
    u = np.linspace(-1, 1, len(t))
    fit = np.polynomial.legendre.legvander(u, 3)
    x = x - fit @ np.linalg.lstsq(fit, x, rcond=None)[0]
    tapers = dpss(len(t), (TAPERS + 1) / 2, TAPERS)
    transformed = np.fft.rfft(tapers[:, :, None] * x, axis=1)
    density = 2 * (np.abs(transformed) ** 2).mean(axis=0).T / rate
    return np.asarray(np.fft.rfftfreq(len(t), 1 / rate), np.float64), np.asarray(density, np.float64)
