# SPDX-License-Identifier: MIT
"""Silhouettes that walk, run, jump and wave, with ground truth, composed of tapered limbs.

They replace the four videos of chapter 6 of the thesis (a running cat, a walking man, a jumping woman, a hand), which
are not available. A figure is a set of limbs, each the hull of two discs; its joints follow a cycle with small, slow
variations, so that no two periods are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack.contour.dct import FILL, align

Mask: TypeAlias = NDArray[np.bool_]
Point: TypeAlias = tuple[float, float]
Limb: TypeAlias = tuple[Point, Point, float, float]  # two ends (x right, y down) and the radii there
CANVAS = 320  # pixels that a figure about one unit tall is drawn into
UNIT = 150.0  # pixels of one unit there


def gait(kind: str, n: int = 400, seed: int = 0, size: int = 64, fill: float = FILL) -> Mask:
    """Aligned silhouettes of a moving figure.

    Parameters
    ----------
    kind : {"cat", "walker", "jumper", "hand"}
        A running cat (few poses, side view), a walker who turns (many poses), somebody who does jumping jacks, a hand
        that opens and closes its fingers one after the other.
    n : int
        Number of frames, at least 1.
    seed : int
        Seed of the variations. The same seed gives the same masks.
    size, fill : int, float
        Size and fill of the grid, as in `st.contour.align`.

    Returns
    -------
    (n, size, size) bool

    Examples
    --------
    >>> masks = gait("walker", 400, seed=0)
    """
    if kind not in FIGURES:
        raise ValueError(f"kind: expected one of {', '.join(FIGURES)}, got {kind!r}")
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise ValueError(f"n: expected a whole number of frames, at least 1, got {n!r}")
    rng = np.random.default_rng([seed, list(FIGURES).index(kind)])
    figure, frames_per_cycle = FIGURES[kind]
    speed = 2 * np.pi / frames_per_cycle
    phase = np.cumsum(speed * (1 + 0.15 * _slow(rng, n, 60))) + rng.uniform(0, 2 * np.pi)
    size_of_swing = 1 + 0.12 * _slow(rng, n, 80)
    sway = 0.05 * _slow(rng, n, 40)
    turn = np.cumsum(np.full(n, 2 * np.pi / 200)) + 0.3 * _slow(rng, n, 100)
    out = np.empty((n, size, size), bool)
    for i in range(n):
        limbs = figure(float(phase[i]), float(size_of_swing[i]), float(sway[i]), float(turn[i]))
        out[i] = align(_drawn(limbs), size, fill)[0]
    return out


def _slow(rng: np.random.Generator, n: int, frames: int) -> NDArray[np.float64]:
    """Smooth random curve of about unit size whose values are alike for `frames` frames."""
    knots = rng.standard_normal(n // frames + 3)
    x = np.arange(n) / frames
    i = x.astype(int)
    t = x - i
    s = t * t * (3 - 2 * t)
    return np.asarray((1 - s) * knots[i] + s * knots[i + 1])


def _drawn(limbs: list[Limb]) -> Mask:
    """The union of the limbs, (CANVAS, CANVAS)."""
    import cv2

    image = np.zeros((CANVAS, CANVAS), np.uint8)
    middle = np.array([CANVAS / 2, CANVAS / 2])
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for a, b, ra, rb in limbs:
        rims = np.concatenate([np.add(a, ra * circle), np.add(b, rb * circle)])
        hull = cv2.convexHull((middle + UNIT * rims).astype(np.float32))
        cv2.fillConvexPoly(image, np.rint(16 * hull).astype(np.int32), 1, shift=4)
    return image.astype(bool)


def _chain(start: Point, angles: tuple[float, ...], lengths: tuple[float, ...]) -> list[Point]:
    """Joints of a limb that hangs from `start`; angle 0 is down, positive to the front (right)."""
    points = [start]
    for angle, length in zip(angles, lengths, strict=True):
        x, y = points[-1]
        points.append((x + length * np.sin(angle), y + length * np.cos(angle)))
    return points


def _cat(phase: float, swing: float, sway: float, _turn: float) -> list[Limb]:
    """A gallop: hind and front legs swing against each other, the back bends and stretches."""
    stretch = np.cos(phase)
    back = 0.06 * stretch * swing
    hip, shoulder = (-0.38 - back, 0.02 + sway * 0.5), (0.30 + back, 0.0)
    middle = (-0.04, -0.05 + 0.10 * stretch * swing)
    limbs: list[Limb] = [(hip, middle, 0.12, 0.11), (middle, shoulder, 0.11, 0.12)]
    head = (shoulder[0] + 0.24, shoulder[1] - 0.14 + 0.04 * np.sin(phase) + sway)
    limbs += [(shoulder, head, 0.09, 0.09), (head, (head[0] + 0.08, head[1] + 0.03), 0.08, 0.04)]
    limbs += [((head[0] - 0.02, head[1] - 0.05), (head[0] - 0.05, head[1] - 0.15), 0.035, 0.01)]
    for k, late in enumerate((0.0, 0.5)):
        reach = 0.85 * swing * np.cos(phase - late)
        fold = 0.6 * (1 + np.sin(phase - late))
        knee = _chain(shoulder, (0.3 * k + reach, reach - fold * 0.8, reach - 0.2), (0.18, 0.17, 0.05))
        limbs += [(p, q, r, 0.8 * r) for p, q, r in zip(knee, knee[1:], (0.07, 0.05, 0.04), strict=False)]
        heel = _chain(hip, (-reach + 0.2, -reach - 0.7 + 0.3 * fold, -reach + 0.3), (0.19, 0.17, 0.10))
        limbs += [(p, q, r, 0.75 * r) for p, q, r in zip(heel, heel[1:], (0.09, 0.055, 0.04), strict=False)]
    lift = -1.9 + 0.5 * np.sin(phase) + 2 * sway
    tail = _chain(hip, (lift, lift - 0.3 + 0.4 * np.sin(phase - 1), lift - 0.5), (0.18, 0.16, 0.12))
    limbs += [(p, q, 0.035, 0.028) for p, q in pairwise(tail)]
    return limbs


def _walker(phase: float, swing: float, sway: float, turn: float) -> list[Limb]:
    """A walk on a circle: the stride is seen from the side, from the front and from behind in turn."""
    side, front = np.cos(turn), np.sin(turn)

    def seen(x: float, y: float, across: float) -> Point:
        return (x * side + across * front + sway * 0.6 * (y < 0), y)

    limbs: list[Limb] = [
        (seen(0.02, -0.42, 0), seen(0, 0.0, 0), 0.085 + 0.05 * abs(front), 0.085 + 0.04 * abs(front)),
        (seen(0.03, -0.42, 0), seen(0.04, -0.62, 0), 0.05, 0.045),
        (seen(0.05, -0.66, 0), seen(0.04, -0.72, 0), 0.085, 0.095),
    ]
    for hand in (-1.0, 1.0):
        step = phase + (np.pi if hand > 0 else 0)
        hip = 0.50 * swing * np.sin(step)
        knee = hip - 0.55 * swing * max(0.0, float(np.cos(step))) - 0.08
        leg = _chain((0.0, 0.02), (hip, knee), (0.38, 0.38))
        foot = (leg[-1][0] + 0.11, leg[-1][1] + 0.02)
        across = 0.09 * hand
        joints = [seen(x, y, across) for x, y in (*leg, foot)]
        limbs += [
            (p, q, r, s)
            for p, q, (r, s) in zip(
                joints, joints[1:], ((0.095, 0.065), (0.06, 0.04), (0.035, 0.03)), strict=False
            )
        ]
        upper = -0.55 * swing * np.sin(step)
        arm = _chain(
            (0.0, -0.42), (upper, upper + 0.35 + 0.25 * swing * max(0.0, -float(np.sin(step)))), (0.26, 0.25)
        )
        joints = [seen(x, y, 0.16 * hand + (0.05 * hand if j else 0)) for j, (x, y) in enumerate(arm)]
        limbs += [(p, q, r, 0.8 * r) for p, q, r in zip(joints, joints[1:], (0.05, 0.04), strict=False)]
    return limbs


def _jumper(phase: float, swing: float, sway: float, _turn: float) -> list[Limb]:
    """Jumping jacks: arms from the thighs over the head, legs apart and together, knees that give."""
    open_ = 0.5 * (1 - np.cos(phase))
    crouch = 0.5 * max(0.0, float(np.sin(2 * phase)))
    top = (sway, -0.42)
    limbs: list[Limb] = [
        (top, (0.0, 0.0), 0.13, 0.11),
        (top, (sway * 1.3, -0.60), 0.05, 0.045),
        ((sway * 1.5, -0.66), (sway * 1.5, -0.71), 0.085, 0.09),
        ((sway * 1.5 - 0.09, -0.66), (sway * 1.5 - 0.13, -0.52 - 0.10 * np.sin(phase)), 0.04, 0.02),
    ]
    for hand in (-1.0, 1.0):
        lift = 0.25 + 2.55 * open_ * swing
        arm = _chain(
            (top[0] + 0.14 * hand, -0.42), (hand * lift, hand * (lift + 0.25 - 0.5 * crouch)), (0.26, 0.27)
        )
        limbs += [(p, q, r, 0.8 * r) for p, q, r in zip(arm, arm[1:], (0.05, 0.04), strict=False)]
        spread = 0.08 + 0.50 * open_ * swing
        leg = _chain(
            (0.07 * hand, 0.02),
            (hand * (spread + 0.4 * crouch), hand * (spread - 0.5 * crouch)),
            (0.38, 0.38),
        )
        foot = (leg[-1][0] + 0.09 * hand, leg[-1][1] + 0.02)
        joints = [*leg, foot]
        limbs += [
            (p, q, r, s)
            for p, q, (r, s) in zip(
                joints, joints[1:], ((0.095, 0.065), (0.06, 0.04), (0.035, 0.03)), strict=False
            )
        ]
    return limbs


def _hand(phase: float, swing: float, sway: float, turn: float) -> list[Limb]:
    """A palm whose fingers bend one after the other, and that tilts slowly."""
    limbs: list[Limb] = [
        ((-0.16, 0.20), (-0.14, -0.05), 0.14, 0.13),
        ((0.14, 0.22), (0.14, -0.05), 0.14, 0.13),
    ]
    limbs += [((-0.05, 0.3), (0.0, 0.62), 0.19, 0.17)]
    roots = ((-0.20, -0.12), (-0.07, -0.17), (0.06, -0.16), (0.19, -0.09))
    lengths = (0.40, 0.46, 0.42, 0.32)
    for k, (root, length) in enumerate(zip(roots, lengths, strict=True)):
        bent = np.clip(0.5 - 0.75 * swing * np.cos(phase - 1.1 * k), 0.0, 1.0)
        lean = (k - 1.5) * (0.16 + 0.10 * np.sin(turn * 2)) + sway
        reach = length * (1 - 0.75 * bent)
        tip = (root[0] + reach * np.sin(lean), root[1] - reach * np.cos(lean))
        limbs.append((root, tip, 0.068, 0.055))
    thumb = 0.75 + 0.45 * np.sin(phase * 0.5 + 1) * swing
    joints = _chain((-0.2, 0.2), (np.pi + thumb * 1.1, np.pi + thumb * 0.8), (0.22, 0.2))
    limbs += [(p, q, 0.075, 0.06) for p, q in pairwise(joints)]
    tilt = 0.25 * np.sin(turn)
    c, s = np.cos(tilt), np.sin(tilt)
    return [
        ((c * a[0] - s * a[1], s * a[0] + c * a[1]), (c * b[0] - s * b[1], s * b[0] + c * b[1]), ra, rb)
        for a, b, ra, rb in limbs
    ]


FIGURES: dict[str, tuple[Callable[[float, float, float, float], list[Limb]], float]] = {
    "cat": (_cat, 17.0),
    "jumper": (_jumper, 31.0),
    "walker": (_walker, 28.0),
    "hand": (_hand, 45.0),
}
