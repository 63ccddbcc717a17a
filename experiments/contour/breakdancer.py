# SPDX-License-Identifier: MIT
"""Silhouettes whose poses do not repeat: a figure that turns over and moves its limbs without a cycle."""

from __future__ import annotations

from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.dct import align

Mask: TypeAlias = NDArray[np.bool_]
Array: TypeAlias = NDArray[np.float64]

CANVAS, UNIT = 320, 150.0  # pixels of the drawing, and of a body length
FRAMES_PER_TURN = 45
# Of a limb: root, angle at rest (0 hangs down), lengths of its two parts, thickness.
LIMBS = (
    ((-0.14, -0.42), -2.0, (0.26, 0.27), 0.09),
    ((0.14, -0.42), 2.0, (0.26, 0.27), 0.09),
    ((-0.07, 0.02), -0.5, (0.38, 0.38), 0.15),
    ((0.07, 0.02), 0.5, (0.38, 0.38), 0.15),
)


def breakdancer(n: int, seed: int, size: int = 64) -> Mask:
    """(n, size, size) aligned silhouettes of a figure whose body turns over while each limb moves on its own."""
    rng = np.random.default_rng([seed, 11])
    turn = 2 * np.pi / FRAMES_PER_TURN * np.arange(n) + 1.5 * _wandering(rng, n, 14)
    swings = 1.3 * np.array([[_wandering(rng, n, 9) for _ in range(2)] for _ in LIMBS])
    return np.array([align(_drawn(turn[i], swings[:, :, i]), size)[0] for i in range(n)])


def tumbling(masks: Mask, seed: int) -> Mask:
    """The same silhouettes, each turned: the angle is a random walk with a random speed, some full turns in all."""
    rng = np.random.default_rng([seed, 7])
    size = masks.shape[-1]
    middle = ((size - 1) / 2, (size - 1) / 2)
    degrees, speed, out = 0.0, 0.0, []
    for mask in masks:
        speed = 0.9 * speed + rng.normal(0, 6)
        degrees += speed
        turn = cv2.getRotationMatrix2D(middle, degrees, 1.0)
        out.append(cv2.warpAffine(mask.astype(np.float32), turn, (size, size)) > 0.5)
    return np.array(out)


def _wandering(rng: np.random.Generator, n: int, frames: int) -> Array:
    """A smooth curve of about unit size through random values `frames` apart."""
    knots = rng.standard_normal(n // frames + 3)
    at, t = np.divmod(np.arange(n) / frames, 1)
    left = at.astype(int)
    s = t * t * (3 - 2 * t)
    return np.asarray((1 - s) * knots[left] + s * knots[left + 1])


def _drawn(turn: float, swings: Array) -> Mask:
    """The figure on a canvas; `swings`: angles (limb, joint)."""
    parts: list[tuple[list[tuple[float, float]], float]] = [
        ([(0.0, -0.42), (0.0, 0.0)], 0.24),
        ([(0.0, -0.42), (0.0, -0.68)], 0.11),
        ([(0.0, -0.68), (0.0, -0.69)], 0.18),
    ]
    for (root, rest, lengths, thickness), (first, second) in zip(LIMBS, swings, strict=True):
        joints, angle = [root], rest
        for length, swing in zip(lengths, (first, second), strict=True):
            angle += swing
            x, y = joints[-1]
            joints.append((x + length * np.sin(angle), y + length * np.cos(angle)))
        parts.append((joints, thickness))
    c, s = np.cos(turn), np.sin(turn)
    image = np.zeros((CANVAS, CANVAS), np.uint8)
    for joints, thickness in parts:
        points = CANVAS / 2 + UNIT * (np.array(joints) @ np.array([[c, s], [-s, c]]))
        cv2.polylines(image, [np.rint(points).astype(np.int32)], False, 1, max(1, round(UNIT * thickness)))
    return image > 0
