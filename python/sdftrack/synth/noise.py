# SPDX-License-Identifier: MIT
"""Depth sensor models: functions (depth, cosines, random numbers) -> depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]
Noise = Callable[[Image, Image, np.random.Generator], Image]


@dataclass(frozen=True)
class Gaussian:
    """Independent noise of `sigma_m` metres on each measured depth (thesis Eq. 3.21)."""

    sigma_m: float = 0.001

    def __post_init__(self) -> None:
        if not (np.isfinite(self.sigma_m) and 0 <= self.sigma_m < 1):
            raise ValueError(f"noise: expected a sigma of 0 to 1 m, got {self.sigma_m:g}")

    def __call__(self, depth: Image, cosine: Image, rng: np.random.Generator) -> Image:
        out = depth.copy()
        seen = depth > 0
        out[seen] += (self.sigma_m * rng.standard_normal(np.count_nonzero(seen))).astype(np.float32)
        return np.maximum(out, 0)


@dataclass(frozen=True)
class Kinect:
    """Structured light at close range.

    Axial noise `s0_m + s2_per_m (Z - 0.4 m)^2` (Nguyen, Izadi and Lovell 2012), lateral jitter of `lateral_px`,
    disparity quantised to an eighth of a pixel for a baseline times focal length of `baseline_m_px`, no measurement
    beyond `grazing_rad` of incidence (fading in over 10 degrees) and, with probability `edge_loss`, next to a depth
    discontinuity larger than `edge_m`.
    """

    s0_m: float = 0.0012
    s2_per_m: float = 0.0019
    lateral_px: float = 0.5
    baseline_m_px: float = 43.5
    grazing_rad: float = float(np.radians(80))
    edge_loss: float = 0.5
    edge_m: float = 0.03

    def sigma_m(self, z: Any) -> Any:
        """Standard deviation of the axial noise at depth z (m), before quantisation."""
        return self.s0_m + self.s2_per_m * (np.asarray(z) - 0.4) ** 2

    def __call__(self, depth: Image, cosine: Image, rng: np.random.Generator) -> Image:
        h, w = depth.shape
        # The same count of random numbers for every image keeps frames comparable between settings.
        jitter = np.rint(self.lateral_px * rng.standard_normal((2, h, w), dtype=np.float32)).astype(np.intp)
        axial = rng.standard_normal((h, w), dtype=np.float32)
        chance = rng.random((2, h, w), dtype=np.float32)
        v = np.clip(np.arange(h)[:, None] + jitter[0], 0, h - 1)
        u = np.clip(np.arange(w)[None, :] + jitter[1], 0, w - 1)
        z, c = depth[v, u], cosine[v, u]
        seen = z > 0
        noisy = np.where(seen, z + self.sigma_m(z) * axial, 1.0)
        eighths = np.maximum(np.rint(8 * self.baseline_m_px / np.maximum(noisy, 0.1)), 1)
        incidence = np.arccos(np.clip(c, 0, 1))
        lost = incidence + np.radians(10) * chance[0] > self.grazing_rad
        lost |= (_step(depth) > self.edge_m) & (chance[1] < self.edge_loss)
        return np.where(seen & ~lost, 8 * self.baseline_m_px / eighths, 0).astype(np.float32)


def noise_of(noise: Any) -> Noise | None:
    """A noise function from None, a sigma in metres, a name, or a function."""
    if noise is None or noise == "none":
        return None
    if isinstance(noise, str):
        named: dict[str, Noise] = {"gaussian": Gaussian(), "kinect": Kinect(), "stereo": Stereo()}
        if noise not in named:
            raise ValueError(
                f'noise: expected None, metres, "gaussian", "kinect", "stereo" or a function, got {noise!r}'
            )
        return named[noise]
    if callable(noise):
        return noise  # type: ignore[no-any-return]
    sigma = float(noise)
    return Gaussian(sigma) if sigma != 0 else None


def _step(depth: Image) -> Image:
    """Largest depth difference to the four neighbours."""
    import cv2

    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    return np.maximum(cv2.dilate(depth, cross) - depth, depth - cv2.erode(depth, cross))


# -- Noise model of a stereo depth camera


@dataclass(frozen=True)
class Stereo:
    """Active stereo like a RealSense D400: disparity errors, correlated over the matching window.

    Depth is ``Z = f B / d``, so an error in the disparity d (px) causes a depth error larger by ``Z^2 / (f B)``. The
    noise `subpixel_px` is that of the manufacturer's tuning guide for a textured wall, its correlation that of a window
    of `window_px` pixels, over which the disparity of a surface is averaged: edges and creases are rounded. `bias_px`
    is a calibration error of the stereo rig, constant over the sequence. There are no measurements where the view of
    the other camera is occluded (a shadow on one side of near objects), beyond `grazing_rad` of incidence (fading in
    over 10 degrees), and in a share `dropped` of window-sized patches.
    """

    baseline_m_px: float = 30.0
    subpixel_px: float = 0.08
    window_px: int = 7
    bias_px: float = 0.1
    grazing_rad: float = float(np.radians(80))
    dropped: float = 0.02

    def __post_init__(self) -> None:
        if not 1 <= self.window_px <= 31 or self.window_px % 2 == 0:
            raise ValueError(
                f"noise: Stereo(window_px): expected an odd number of 1 to 31, got {self.window_px}"
            )
        if not 0 <= self.dropped < 1:
            raise ValueError(f"noise: Stereo(dropped): expected 0 to below 1, got {self.dropped:g}")
        if not self.baseline_m_px > 0:
            raise ValueError(
                f"noise: Stereo(baseline_m_px): expected more than 0, got {self.baseline_m_px:g}"
            )

    def sigma_m(self, z: Any) -> Any:
        """Standard deviation of the axial noise at depth z (m)."""
        return self.subpixel_px * np.asarray(z) ** 2 / self.baseline_m_px

    def __call__(self, depth: Image, cosine: Image, rng: np.random.Generator) -> Image:
        """A noisy image. `depth` (m; 0: nothing there), `cosine` of the incidence."""
        import cv2

        h, w = depth.shape
        n = self.window_px
        white = rng.standard_normal((h, w), dtype=np.float32)
        chance = rng.random((h, w), dtype=np.float32)
        patches = rng.random((h // n + 1, w // n + 1), dtype=np.float32) < self.dropped
        seen = depth > 0
        disparity = np.where(seen, self.baseline_m_px / np.maximum(depth, 1e-3), 0).astype(np.float32)
        # A window matches where most of its pixels are of one surface: farther ones do not count.
        smooth = _over_one_surface(disparity, n)
        noise = cv2.blur(white, (n, n)) * n * self.subpixel_px  # of a window's mean: 1 / n of a pixel's
        found = smooth + noise + self.bias_px
        lost = _in_shadow(disparity) | np.kron(patches, np.ones((n, n), bool))[:h, :w]
        lost |= np.arccos(np.clip(cosine, 0, 1)) + np.radians(10) * chance > self.grazing_rad
        return np.where(seen & ~lost & (found > 0), self.baseline_m_px / np.maximum(found, 1e-6), 0).astype(
            np.float32
        )


def _over_one_surface(disparity: Image, window: int) -> Image:
    """Mean over the window of the disparities within one pixel of the middle's."""
    total, count = np.zeros_like(disparity), np.zeros_like(disparity)
    r = window // 2
    h, w = disparity.shape
    padded = np.pad(disparity, r, mode="edge")
    for dy in range(window):
        for dx in range(window):
            other = padded[dy : dy + h, dx : dx + w]
            near = np.abs(other - disparity) < 1
            total += np.where(near, other, 0)
            count += near
    return (total / np.maximum(count, 1)).astype(np.float32)


def _in_shadow(disparity: Image) -> NDArray[np.bool_]:
    """Pixels of the left image that a nearer one hides from the right camera: x - d is not the least from the right."""
    right = np.arange(disparity.shape[1], dtype=np.float32)[None, :] - disparity
    least = np.minimum.accumulate(right[:, ::-1], axis=1)[:, ::-1]
    beyond = np.concatenate([least[:, 1:], np.full((len(right), 1), np.inf, np.float32)], axis=1)
    return beyond <= right - 1
