# SPDX-License-Identifier: MIT
"""An image with known regions: curved patches of colour, with shading and texture similar to photographs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

BENT = 0.06  # how far borders wander, as a part of the width
TEXTURE, GRAIN = (
    7.0,
    2.0,
)  # deviation of the texture (amplitude falls as 1 / frequency) and of the pixels, levels
SHADE = 0.25


def region_picture(
    height: int = 480, width: int = 640, regions: int = 30, seed: int = 0
) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """An image and the region of each pixel, with the same content at any size.

    Parameters
    ----------
    height, width : int, pixels
    regions : int
        Number of patches: Voronoi cells of this many seeds, with curved borders.
    seed : int

    Returns
    -------
    image : (H, W, 3) uint8 array, RGB
    truth : (H, W) int32 array, 1..regions
    """
    rng = np.random.default_rng(seed)
    seeds, colors = rng.random((regions, 2)) * (width / height, 1), rng.uniform(30, 225, (regions, 3))
    waves = rng.normal(size=(2, 6, 3))
    y, x = np.mgrid[:height, :width].astype(np.float32) / height
    bent = [
        BENT * np.mean([np.sin(2 * np.pi * (2 * a * x + 2 * b * y + c)) for a, b, c in axis], axis=0)
        for axis in waves
    ]
    x, y = x + bent[0], y + bent[1]
    best, truth = np.full(x.shape, np.inf, np.float32), np.zeros(x.shape, np.int32)
    for k, (u, v) in enumerate(seeds):
        d = (x - u) ** 2 + (y - v) ** 2
        nearer = d < best
        best[nearer], truth[nearer] = d[nearer], k + 1
    shade = 1 + SHADE * np.sin(3 * x + 1) * np.cos(2 * y)
    image = colors[truth - 1] * shade[..., None] + _texture(rng, height, width)[..., None]
    image += rng.normal(0, GRAIN, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), truth


def _texture(rng: Any, height: int, width: int) -> NDArray[np.float64]:
    f = np.hypot(np.fft.fftfreq(height)[:, None] * height, np.fft.rfftfreq(width)[None] * height)
    spectrum = np.fft.rfft2(rng.normal(size=(height, width))) / np.maximum(f, 3)
    noise = np.fft.irfft2(spectrum, (height, width))
    out: NDArray[np.float64] = TEXTURE * noise / noise.std()
    return out
