# SPDX-License-Identifier: MIT
"""What a contour tracker has lost: time of a frame, and where it is found again."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from experiments.contour.contour import THESIS
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour.tracker import ContourTracker
from sdftrack.metrics import iou

AWAY, WAIT = 30, 20
SIZES, RADII = ((427, 240), (1280, 720), (1920, 1080)), (30, 100)
RETURNS = ((350, 150, 30), (1100, 600, 30), (160, 150, 15), (160, 150, 60), (1100, 600, 15), (1000, 500, 60))


def scene(
    cx: float, cy: float, radius: float, size: tuple[int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """A disc (none with radius 0) in an image of (width, height), and its mask."""
    y, x = np.mgrid[: size[1], : size[0]]
    mask = np.hypot(x - cx, y - cy) < radius
    noise = np.random.default_rng(1).normal(0, 6, (size[1], size[0], 3))
    return np.clip(np.where(mask[..., None], (200, 60, 40), (90, 100, 110)) + noise, 0, 255).astype(
        np.uint8
    ), mask


def _times(size: tuple[int, int], radius: int) -> list[str]:
    tracker = ContourTracker(**THESIS)
    image, mask = scene(size[0] // 2, size[1] // 2, radius, size)
    tracker.start(image, mask=mask)
    empty = scene(0, 0, 0, size)[0]
    ms = []
    for k in range(5 + AWAY):
        began = time.thread_time()
        tracker.track(image if k < 5 else empty)
        ms.append(1e3 * (time.thread_time() - began))
    lost = ms[5:]
    return [
        f"{size[0]} x {size[1]}, {radius} px",
        f"{min(ms[:5]):.2f}",
        f"{np.median(lost):.2f}",
        f"{max(lost):.2f}",
    ]


def _return(to: tuple[int, int, int]) -> list[str]:
    size = (1280, 720)
    tracker = ContourTracker(**THESIS)
    image, mask = scene(150, 150, 30, size)
    tracker.start(image, mask=mask)
    for _ in range(3):
        tracker.track(scene(0, 0, 0, size)[0])
    image, mask = scene(*to, size)
    for k in range(1, WAIT + 1):
        result = tracker.track(image)
        if result.ok:
            return [f"({to[0]}, {to[1]}), {to[2]} px", str(k), f"{iou(result.mask, mask):.3f}"]
    return [f"({to[0]}, {to[1]}), {to[2]} px", "-", "-"]


@experiment(
    "redetection",
    chosen_on="a disc of 30 px at 1280 x 720",
    reported_on="discs of 15 to 100 px in images of three sizes",
    short={"sizes": 1, "returns": 1},
)
def redetection(*, sizes: int = len(SIZES), returns: int = len(RETURNS)) -> list[Table]:
    """What a contour tracker has lost: how long a frame takes, and where it is found again.

    A red disc on plain ground with noise that is away for 30 frames: the processor time of a frame, tracked and lost;
    then in how many frames it is found at other places and sizes.

    Parameters
    ----------
    sizes
        of the image, the smallest first
    returns
        places where it comes back
    """
    times = [_times(size, radius) for size in SIZES[:sizes] for radius in RADII]
    back = [_return(to) for to in RETURNS[:returns]]
    return [
        Table(
            "Processor time of a frame, ms", ["image, radius", "tracked", "lost, median", "lost, most"], times
        ),
        Table(
            "A disc of 30 px at (150, 150), away for 3 frames, 1280 x 720", ["back at", "frames", "IoU"], back
        ),
    ]
