# SPDX-License-Identifier: MIT
"""What OpenCV offers for following an object in colour video: five usual ways, each from a first image and mask."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from sdftrack.metrics import iou

__all__ = ["WAYS", "box_of", "follow_by", "grabcut_in_box"]

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
GRABCUT_DILATED_PX, GRABCUT_ROUNDS = 8, 2
BOX_ROUNDS = 5
MOST_CORNERS, LEAST_QUALITY, CORNERS_APART_PX = 200, 0.01, 3.0
MOST_MISS_PX = 3.0  # of a corner from the affinity
UNTIL = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 1)
SEED = 0  # of GrabCut's clusters and of RANSAC


class Way(Protocol):
    """One way: started with an image and a mask, it gives the mask of each next image."""

    def __init__(self, image: Image, mask: Mask) -> None: ...

    def track(self, image: Image) -> Mask: ...


def follow_by(
    way: Callable[[Image, Mask], Way], images: Sequence[Image], first: Mask, truth: Sequence[Mask]
) -> tuple[float, float]:
    """(mean IoU, median seconds) over all images but the first; chance is the same in each call."""
    cv2.setRNGSeed(SEED)
    running = way(images[0], first)
    found, seconds = [], []
    for image, true in zip(images[1:], truth[1:], strict=True):
        began = time.thread_time()
        mask = running.track(image)
        seconds.append(time.thread_time() - began)
        found.append(iou(mask, true))
    return float(np.mean(found)), float(np.median(seconds))


def box_of(mask: Mask) -> tuple[int, int, int, int]:
    """(x, y, w, h)."""
    y, x = np.nonzero(mask)
    return int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1


def grabcut_in_box(image: Image, box: tuple[int, int, int, int]) -> Mask:
    """The object in a box by OpenCV's GrabCut; the whole box where that finds nothing."""
    guess = np.zeros(image.shape[:2], np.uint8)
    x, y, w, h = box
    guess[y : y + h, x : x + w] = cv2.GC_PR_FGD
    found = _cut(image, guess, BOX_ROUNDS)
    if not found.any():
        found[y : y + h, x : x + w] = True
    return found


class _BackProjection:
    """The histogram of hue and saturation of the first mask, looked up in each image."""

    def __init__(self, image: Image, mask: Mask) -> None:
        chosen, hue = mask.astype(np.uint8), cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
        self._histogram = cv2.calcHist([hue], [0, 1], chosen, [30, 32], [0, 180, 0, 256])
        cv2.normalize(self._histogram, self._histogram, 0, 255, cv2.NORM_MINMAX)
        self._first: Any = box_of(mask)
        self._window: Any = self._first

    def _back(self, image: Image) -> Any:
        hue = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
        return cv2.calcBackProject([hue], [0, 1], self._histogram, [0, 180, 0, 256], 1)


class MeanShift(_BackProjection):
    """The mask is what the back-projection holds likely in the window."""

    def track(self, image: Image) -> Mask:
        back = self._back(image)
        _, self._window = cv2.meanShift(back, self._window, UNTIL)
        x, y, w, h = self._window
        found = np.zeros(back.shape, bool)
        found[y : y + h, x : x + w] = back[y : y + h, x : x + w] > 127
        return found


class CamShift(_BackProjection):
    """The mask is what the back-projection holds likely in the ellipse."""

    def track(self, image: Image) -> Mask:
        back = self._back(image)
        ellipse, self._window = cv2.CamShift(back, self._window, UNTIL)
        drawn = np.zeros(back.shape, np.uint8)
        if min(ellipse[1]) > 0:
            cv2.ellipse(drawn, ellipse, 1, -1)
        if min(self._window[2:]) < 1:
            self._window = self._first
        return np.asarray((drawn > 0) & (back > 127))


class GrabCut:
    """GrabCut in each image, the last mask dilated as its guess."""

    def __init__(self, image: Image, mask: Mask) -> None:
        self._last = mask
        self._kernel = np.ones((2 * GRABCUT_DILATED_PX + 1,) * 2, np.uint8)

    def track(self, image: Image) -> Mask:
        grown = cv2.dilate(self._last.astype(np.uint8), self._kernel) > 0
        guess = np.where(self._last, cv2.GC_PR_FGD, np.where(grown, cv2.GC_PR_BGD, cv2.GC_BGD))
        if self._last.any():
            self._last = _cut(image, guess.astype(np.uint8), GRABCUT_ROUNDS)
        return self._last


class DisFlow:
    """The first mask moved from image to image by OpenCV's DIS flow."""

    def __init__(self, image: Image, mask: Mask) -> None:
        dis: Any = cv2  # OpenCV's stubs lack it
        self._flow = dis.DISOpticalFlow_create(dis.DISOPTICAL_FLOW_PRESET_MEDIUM)
        self._mask, self._before = mask.astype(np.float32), cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        height, width = mask.shape
        self._v, self._u = np.indices((height, width), np.float32, sparse=True)

    def track(self, image: Image) -> Mask:
        gray = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        back = self._flow.calc(gray, self._before, None)
        there = cv2.remap(self._mask, self._u + back[..., 0], self._v + back[..., 1], cv2.INTER_LINEAR)
        self._mask, self._before = (there > 0.5).astype(np.float32), gray
        return np.asarray(self._mask > 0)


class LucasKanade:
    """The first mask moved by the affinity of the corners in it, followed by pyramidal Lucas-Kanade."""

    def __init__(self, image: Image, mask: Mask) -> None:
        self._mask, self._before = (
            mask.view(np.uint8) * np.uint8(255),
            cv2.cvtColor(image, cv2.COLOR_RGB2GRAY),
        )

    def track(self, image: Image) -> Mask:
        gray: Any = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        before, self._before = self._before, gray
        motion = self._motion(before, gray)
        if motion is not None:  # else it stays
            moved = cv2.warpAffine(self._mask, motion, gray.shape[::-1], flags=cv2.INTER_LINEAR)
            self._mask = np.where(moved > 127, np.uint8(255), np.uint8(0))
        return np.asarray(self._mask > 0)

    def _motion(self, before: Any, gray: Any) -> Any:
        """(2, 3), from the last image to this one; None where too few corners agree."""
        corners: Any = cv2.goodFeaturesToTrack(
            before, MOST_CORNERS, LEAST_QUALITY, CORNERS_APART_PX, mask=self._mask
        )
        if corners is None or len(corners) < 3:
            return None
        there: Any
        there, seen, _ = cv2.calcOpticalFlowPyrLK(before, gray, corners, None)  # type: ignore[call-overload]
        seen = seen.ravel() > 0
        if seen.sum() < 3:
            return None
        return cv2.estimateAffine2D(corners[seen], there[seen], ransacReprojThreshold=MOST_MISS_PX)[0]


WAYS: dict[str, Callable[[Image, Mask], Way]] = {
    "MeanShift": MeanShift,
    "CamShift": CamShift,
    "GrabCut": GrabCut,
    "DIS": DisFlow,
    "LK affine": LucasKanade,
}


def _cut(image: Image, guess: NDArray[np.uint8], rounds: int) -> Mask:
    grab: Any = cv2.grabCut
    models = np.zeros((1, 65)), np.zeros((1, 65))
    grab(np.ascontiguousarray(image[..., ::-1]), guess, None, *models, rounds, cv2.GC_INIT_WITH_MASK)
    return np.asarray((guess == cv2.GC_FGD) | (guess == cv2.GC_PR_FGD))
