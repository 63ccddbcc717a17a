# SPDX-License-Identifier: MIT
"""The contour tracker on recorded sequences with hand-made masks, beside what OpenCV offers."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.registry import experiment
from experiments.table import Table
from sdftrack.contour.tracker import ContourTracker
from sdftrack.metrics import iou

__all__ = ["SEQUENCES", "Followed", "contour", "follow_davis", "open_davis", "separation"]

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
SEQUENCES: tuple[Literal["cows", "camel", "libby", "bmx-trees"], ...] = (
    "cows",
    "camel",
    "libby",
    "bmx-trees",
)
Sequence = Literal["cows", "camel", "libby", "bmx-trees", "drift-straight", "dance-twirl", "soapbox"]
CHOSEN_ON: tuple[Sequence, ...] = (*SEQUENCES, "drift-straight")
REPORTED_ON: tuple[Sequence, ...] = ("dance-twirl", "soapbox")
THESIS: dict[str, Any] = {"motion": "none", "confidence": "colors", "box_start": "colors"}
ORACLE_SIGMA_PX = 2.5
GRABCUT_DILATED_PX, GRABCUT_ROUNDS = 8, 2
BOX_ROUNDS = 5


@dataclass(frozen=True)
class Davis:
    """Frames and true masks."""

    name: str
    images: list[Image]
    masks: list[Mask]


@dataclass(frozen=True)
class Followed:
    """IoU, confidence, status and time of all frames but the first."""

    ious: NDArray[np.float64]
    confidence: NDArray[np.float64]
    status: list[str]
    seconds: NDArray[np.float64]


def open_davis(folder: Path, name: str, most: int | None = None, scale: int = 1) -> Davis:
    """Read a sequence; `scale` 2: upsampled to 854 x 480."""
    from sdftrack.io.datasets.images import image_files
    from sdftrack.io.frames import read_color, read_mask

    images = [read_color(f) for f in image_files(folder / name / "rgb")[:most]]
    masks = [read_mask(f) for f in image_files(folder / name / "mask")[:most]]
    if not images or len(images) != len(masks):
        raise FileNotFoundError(f"data: expected rgb/ and mask/ with as many images in {folder / name}")
    if scale > 1:
        size = (images[0].shape[1] * scale, images[0].shape[0] * scale)
        images = [np.asarray(cv2.resize(i, size, interpolation=cv2.INTER_CUBIC), np.uint8) for i in images]
        masks = [np.kron(m, np.ones((scale, scale), bool)) for m in masks]
    return Davis(name, images, masks)


def box_of(mask: Mask) -> tuple[int, int, int, int]:
    """(x, y, w, h)."""
    y, x = np.nonzero(mask)
    return int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1


def follow_davis(video: Davis, by: str = "mask", **options: Any) -> Followed:
    """Track a sequence from its first mask or that mask's box; `options` of `ContourTracker`."""
    tracker = ContourTracker(**options)
    place: Any = {"mask": video.masks[0]} if by == "mask" else {"box": box_of(video.masks[0])}
    tracker.start(video.images[0], **place)
    ious, confidence, status, seconds = [], [], [], []
    for image, true in zip(video.images[1:], video.masks[1:], strict=True):
        began = time.thread_time()  # what others do on this machine does not count
        result = tracker.track(image)
        seconds.append(time.thread_time() - began)
        ious.append(iou(result.mask, true))
        confidence.append(result.confidence)
        status.append(str(result.status))
    return Followed(np.array(ious), np.array(confidence), status, np.array(seconds))


def separation(confidence: NDArray[np.float64], bad: NDArray[np.bool_]) -> float:
    """Chance that a good frame has more confidence than a bad one, ties half; NaN where all are of a kind."""
    good, poor = confidence[~bad], confidence[bad]
    if not len(good) or not len(poor):
        return float("nan")
    more = (good[:, None] > poor).mean() + 0.5 * (good[:, None] == poor).mean()
    return float(more)


def oracle(video: Davis) -> tuple[float, float]:
    """Mean IoU of thresholded posteriors, each frame's own true mask having made the histograms; as they are, and
    smoothed by a Gaussian of ORACLE_SIGMA_PX."""
    from sdftrack import _core

    found = []
    for image, true in zip(video.images[1:], video.masks[1:], strict=True):
        x, y, w, h = box_of(true)
        ring = max(12, int(0.3 * max(w, h)))
        v, u = np.mgrid[: h + 2 * ring, : w + 2 * ring]
        v, u = v + y - ring, u + x - ring
        height, width = true.shape
        on = (u >= 0) & (v >= 0) & (u < width) & (v < height)
        inside = np.zeros(u.shape, bool)
        inside[on] = true[v[on], u[on]]
        phi = np.where(inside, -0.5, 0.5).astype(np.float32)
        warp = [1.0, 0.0, 0.0, 1.0, x + (w - 1) / 2, y + (h - 1) / 2]
        posterior = _core.contour_posterior(image, image, phi, warp, {})
        posterior = np.where(posterior == 0.5, np.float32(0), posterior)  # off the grid
        smooth = cv2.GaussianBlur(posterior, (0, 0), ORACLE_SIGMA_PX)
        found.append((iou(posterior > 0.5, true), iou(smooth > 0.5, true)))
    plain, smoothed = np.mean(found, axis=0)
    return float(plain), float(smoothed)


def grabcut_in_box(image: Image, box: tuple[int, int, int, int]) -> Mask:
    """The object in a box by OpenCV's GrabCut; the whole box where that finds nothing."""
    guess = np.zeros(image.shape[:2], np.uint8)
    x, y, w, h = box
    guess[y : y + h, x : x + w] = cv2.GC_PR_FGD
    grab: Any = cv2.grabCut
    models = np.zeros((1, 65)), np.zeros((1, 65))
    grab(np.ascontiguousarray(image[..., ::-1]), guess, None, *models, BOX_ROUNDS, cv2.GC_INIT_WITH_MASK)
    found = (guess == cv2.GC_FGD) | (guess == cv2.GC_PR_FGD)
    if not found.any():
        found[y : y + h, x : x + w] = True
    return np.asarray(found)


def camshift(video: Davis, first: Mask) -> tuple[float, float]:
    """(mean IoU, median seconds) of OpenCV's back-projection and CamShift, from the first mask."""

    def hue(image: Image) -> Any:
        return cv2.cvtColor(image, cv2.COLOR_RGB2HSV)

    chosen = first.astype(np.uint8)
    histogram = cv2.calcHist([hue(video.images[0])], [0, 1], chosen, [30, 32], [0, 180, 0, 256])
    cv2.normalize(histogram, histogram, 0, 255, cv2.NORM_MINMAX)
    window: Any = box_of(first)
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 10, 1)
    found, seconds = [], []
    for image, true in zip(video.images[1:], video.masks[1:], strict=True):
        began = time.thread_time()
        back = cv2.calcBackProject([hue(image)], [0, 1], histogram, [0, 180, 0, 256], 1)
        ellipse, window = cv2.CamShift(back, window, until)
        seconds.append(time.thread_time() - began)
        drawn = np.zeros(true.shape, np.uint8)
        if min(ellipse[1]) > 0:
            cv2.ellipse(drawn, ellipse, 1, -1)
        if window[2] < 1 or window[3] < 1:
            window = box_of(first)
        found.append(iou((drawn > 0) & (back > 127), true))
    return float(np.mean(found)), float(np.median(seconds))


def grabcut(video: Davis, first: Mask) -> tuple[float, float]:
    """(mean IoU, median seconds) of OpenCV's GrabCut in each frame, the last mask eroded and dilated as its guess."""
    last = first
    kernel = np.ones((2 * GRABCUT_DILATED_PX + 1,) * 2, np.uint8)
    found, seconds = [], []
    for image, true in zip(video.images[1:], video.masks[1:], strict=True):
        began = time.thread_time()
        grown = cv2.dilate(last.astype(np.uint8), kernel) > 0
        guess = np.where(last, cv2.GC_PR_FGD, np.where(grown, cv2.GC_PR_BGD, cv2.GC_BGD)).astype(np.uint8)
        if last.any():
            grab: Any = cv2.grabCut
            models = np.zeros((1, 65)), np.zeros((1, 65))
            bgr = np.ascontiguousarray(image[..., ::-1])
            grab(bgr, guess, None, *models, GRABCUT_ROUNDS, cv2.GC_INIT_WITH_MASK)
            last = (guess == cv2.GC_FGD) | (guess == cv2.GC_PR_FGD)
        seconds.append(time.thread_time() - began)
        found.append(iou(last, true))
    return float(np.mean(found)), float(np.median(seconds))


def propagated(video: Davis, first: Mask) -> tuple[float, float]:
    """(mean IoU, median seconds) of the first mask moved from image to image by OpenCV's DIS flow."""
    dis: Any = cv2
    flow = dis.DISOpticalFlow_create(dis.DISOPTICAL_FLOW_PRESET_MEDIUM)
    mask, before = first.astype(np.float32), cv2.cvtColor(video.images[0], cv2.COLOR_RGB2GRAY)
    height, width = mask.shape
    v, u = np.indices((height, width), np.float32, sparse=True)
    found, seconds = [], []
    for image, true in zip(video.images[1:], video.masks[1:], strict=True):
        began = time.thread_time()
        gray = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        back = flow.calc(gray, before, None)
        there = cv2.remap(mask, u + back[..., 0], v + back[..., 1], cv2.INTER_LINEAR)
        mask, before = (there > 0.5).astype(np.float32), gray
        seconds.append(time.thread_time() - began)
        found.append(iou(mask > 0, true))
    return float(np.mean(found)), float(np.median(seconds))


def _row(video: Davis) -> list[str]:
    mask, box = follow_davis(video, "mask"), follow_davis(video, "box")
    former, former_box = follow_davis(video, "mask", **THESIS), follow_davis(video, "box", **THESIS)
    affine = follow_davis(video, "mask", warp="affine")
    return [
        video.name,
        f"{mask.ious.mean():.3f} / {box.ious.mean():.3f}",
        f"{former.ious.mean():.3f} / {former_box.ious.mean():.3f}",
        f"{affine.ious.mean():.3f}",
        " / ".join(f"{value:.3f}" for value in oracle(video)),
        *(
            f"{1e3 * np.median(f.seconds):.2f} / {1e3 * np.percentile(f.seconds, 99):.1f}"
            for f in (mask, former)
        ),
    ]


def _rival_row(video: Davis) -> list[str]:
    cv2.setRNGSeed(0)  # of GrabCut's clusters
    row = [video.name]
    rivals: tuple[Callable[[Davis, Mask], tuple[float, float]], ...] = (camshift, grabcut, propagated)
    in_box = grabcut_in_box(video.images[0], box_of(video.masks[0]))
    for rival in rivals:
        value, seconds = rival(video, video.masks[0])
        row += [f"{value:.3f} / {rival(video, in_box)[0]:.3f}", f"{1e3 * seconds:.2f}"]
    return row


HEAD = ["sequence", "mask / box", "thesis: mask / box", "affine", "oracle", "ms: median / 99 %", "thesis: ms"]

RIVALS = ["sequence", "CamShift", "CamShift ms", "GrabCut", "GrabCut ms", "DIS", "DIS ms"]


@experiment(
    "contour",
    needs=["davis"],
    chosen_on=", ".join(CHOSEN_ON),
    reported_on=", ".join(REPORTED_ON),
    short={"only": ("cows",), "frames": 3, "others": False},
)
def contour(
    *,
    data: Path,
    only: tuple[Sequence, ...] = CHOSEN_ON + REPORTED_ON,
    frames: int | None = None,
    scale: int = 1,
    others: bool = True,
) -> list[Table]:
    """The contour tracker on recorded sequences with hand-made masks, beside what OpenCV offers.

    For each sequence: the mean IoU over all frames but the first from a mask and from a box, with the defaults, without
    the optical flow (as in the thesis), and with an affine warp; the oracle, which is the per-pixel posteriors with the
    histograms of the true mask in each frame, in the same windows, thresholded as they are and smoothed; time of a
    frame on one thread; and, from the mask and from the box as segmented by GrabCut, OpenCV's CamShift (mask: the
    back-projection above one half in its ellipse), GrabCut (each frame from the dilated last mask) and DIS flow (the
    first mask moved from image to image).

    Parameters
    ----------
    frames
        of each sequence, at most
    scale
        2: upsampled to 854 x 480
    others
        OpenCV's methods too
    """
    cv2.setNumThreads(1)
    videos = [open_davis(data / "davis", s, frames, scale) for s in only]
    height, width = videos[0].masks[0].shape
    size = f"{width} x {height}"
    title = f"Mean IoU of the tracker, {size}; processor time of a frame on one thread"
    tables = [Table(title, HEAD, [_row(video) for video in videos])]
    if others:
        title = f"Mean IoU of OpenCV's ways, from the mask / from the box, {size}"
        tables.append(Table(title, RIVALS, [_rival_row(video) for video in videos]))
    return tables
