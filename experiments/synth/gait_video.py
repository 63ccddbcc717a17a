# SPDX-License-Identifier: MIT
"""Colour video of a gait with an occluder, with the whole and the visible silhouettes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.synth.gait import gait

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
OCCLUDERS = ("none", "bar", "fence", "window")
BAR = 0.22  # width over the side of the figure's square
SLAT, SLATS_APART = 0.06, 0.14  # of a fence, over the same
WINDOW = 0.16  # radius of the hole through which alone the figure is seen, over the same
FIGURE, GROUND, THING = (190, 90, 60), (80, 120, 70), (90, 90, 200)
TEXTURE, NOISE = 14.0, 6.0  # standard deviations of the ground and of the sensor, grey values


@dataclass(frozen=True)
class GaitVideo:
    """`images`: list of (H, W, 3) uint8 RGB; `whole`, `seen`: lists of (H, W) bool; `during`: occluded frames."""

    images: list[Image]
    whole: list[Mask]
    seen: list[Mask]
    during: range


def gait_video(
    kind: str,
    frames: int = 160,
    thing: str = "bar",
    *,
    during: tuple[int, int] = (100, 150),
    size: tuple[int, int] = (320, 240),
    seed: int = 0,
) -> GaitVideo:
    """Make a video (no file is read): a figure walks there and back over soft ground and something passes before it.

    Parameters
    ----------
    kind : str
        As in `experiments.synth.gait.gait`.
    frames : int
    thing : {"none", "bar", "fence", "window"}
        A bar of 22 % of the figure's square that moves across it from left to right, narrow slats all over it, or
        everything except a disc at its centre.
    during : (int, int)
        First frame with the occluder, and first frame without.
    size : (width, height)
        Pixels; the figure's square is half as high.
    seed : int

    Returns
    -------
    GaitVideo

    >>> video = gait_video("cat", frames=3, size=(64, 48), during=(1, 2))
    >>> video.images[0].shape, video.during
    ((48, 64, 3), range(1, 2))
    """
    import cv2

    if thing not in OCCLUDERS:
        raise ValueError(f"thing: expected one of {', '.join(OCCLUDERS)}, got {thing!r}")
    rng = np.random.default_rng(seed)
    width, height = size
    side = height // 2
    ground = cv2.GaussianBlur(rng.normal(0, 1, (height, width, 3)), (0, 0), 4)
    ground = np.array(GROUND) + ground / ground.std() * TEXTURE
    covered = range(*during)
    images, whole, seen = [], [], []
    for k, mask in enumerate(gait(kind, frames, seed)):
        x = int(width * (0.281 + 0.25 * np.sin(2 * np.pi * k / frames)))
        y = int(height * (0.25 + 0.033 * np.sin(k / 9)))
        figure = np.zeros((height, width), bool)
        large = cv2.resize(mask.astype(np.float32), (side, side), interpolation=cv2.INTER_LINEAR) > 0.5
        figure[y : y + side, x : x + side] = large
        picture = np.where(figure[..., None], FIGURE, ground)
        there = np.zeros_like(figure)
        if k in covered:
            way = (k - covered.start) / len(covered)
            there = occluder(thing, (height, width), (x, y, side, side), way)
        picture = np.where(there[..., None], THING, picture) + rng.normal(0, NOISE, picture.shape)
        images.append(np.clip(picture, 0, 255).astype(np.uint8))
        whole.append(figure)
        seen.append(figure & ~there)
    return GaitVideo(images, whole, seen, covered)


def occluder(thing: str, shape: tuple[int, int], box: tuple[int, int, int, int], way: float) -> Mask:
    """(H, W) bool: where something stands before a box (x, y, w, h); `way` 0 to 1 is how far a bar has come."""
    x0, y0, w, h = box
    y, x = np.indices(shape)
    if thing == "bar":
        left = int(x0 + w * way)
        return np.asarray((x >= left) & (x < left + int(BAR * w)))
    if thing == "fence":
        return np.asarray(((x - x0) / w) % SLATS_APART < SLAT)
    if thing == "window":
        around = np.hypot(x - x0 - 0.5 * w, y - y0 - 0.5 * h) > WINDOW * min(w, h)
        return np.asarray(around & (abs(x - x0 - 0.5 * w) < 0.7 * w) & (abs(y - y0 - 0.5 * h) < 0.7 * h))
    return np.zeros(shape, bool)
