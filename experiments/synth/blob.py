# SPDX-License-Identifier: MIT
"""Colour video of a blob that moves, rotates, grows and deforms over a background, with its true masks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class BlobVideo:
    """`images`: list of (H, W, 3) uint8 RGB; `masks`: list of (H, W) bool, the visible part."""

    images: list[Image]
    masks: list[Mask]


def blob_video(
    frames: int = 60,
    size: tuple[int, int] = (240, 160),
    *,
    deform: float = 0.2,
    noise: float = 8.0,
    post: bool = False,
    seed: int = 0,
) -> BlobVideo:
    """Make a video (no file is read).

    Parameters
    ----------
    frames : int
    size : (width, height)
        Pixels.
    deform : float
        Amplitude of the radius variation, relative to its mean.
    noise : float
        Standard deviation of the sensor's noise, grey values.
    post : bool
        A grey post in the foreground, behind which the blob passes.
    seed : int
        Seed of textures and noise.

    Returns
    -------
    BlobVideo

    >>> video = blob_video(frames=2, size=(64, 48))
    >>> video.images[0].shape, video.masks[0].dtype
    ((48, 64, 3), dtype('bool'))
    """
    rng = np.random.default_rng(seed)
    width, height = size
    y, x = np.mgrid[:height, :width].astype(np.float64)
    ground = _texture(x, y, np.array([[70, 120, 60], [110, 105, 90], [60, 90, 70]]), rng)
    radius = 0.2 * min(size)
    images, masks = [], []
    for k in range(frames):
        t = k / max(frames - 1, 1)
        cx, cy = width * (0.3 + 0.4 * t), height * (0.5 + 0.1 * np.sin(2 * np.pi * t))
        angle, scale = 0.8 * t, 1 + 0.25 * np.sin(np.pi * t)
        u, v = (x - cx) / scale, (y - cy) / scale
        u, v = u * np.cos(angle) + v * np.sin(angle), v * np.cos(angle) - u * np.sin(angle)
        theta = np.arctan2(v, u)
        edge = radius * (
            1 + deform * np.cos(3 * theta + 4 * t) + 0.5 * deform * np.sin(2 * theta + 6 * np.pi * t)
        )
        mask = np.hypot(u, v) < edge
        skin = _texture(u, v, np.array([[190, 80, 60], [220, 170, 90], [150, 60, 90]]), None)
        picture = np.where(mask[..., None], skin, ground)
        if post:
            standing = np.abs(x - 0.52 * width) < 0.01 * width
            picture = np.where(standing[..., None], 128.0, picture)
            mask = mask & ~standing
        picture = picture + rng.normal(0, noise, picture.shape)
        images.append(np.clip(picture, 0, 255).astype(np.uint8))
        masks.append(mask)
    return BlobVideo(images, masks)


def _texture(
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    colors: NDArray[np.int_],
    rng: np.random.Generator | None,
) -> NDArray[np.float64]:
    """Three colours in soft patches; phases by `rng`, none without."""
    phase = np.zeros(4) if rng is None else rng.uniform(0, 6, 4)
    a = np.sin(0.21 * u + 0.13 * v + phase[0]) + np.sin(0.17 * v - 0.1 * u + phase[1])
    b = np.sin(0.09 * u - 0.23 * v + phase[2]) + np.sin(0.31 * u + phase[3])
    weight = np.exp(2 * np.stack([a, b, -a - b], axis=-1))
    return np.asarray((weight / weight.sum(-1, keepdims=True)) @ colors.astype(np.float64))
