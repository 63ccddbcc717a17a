# SPDX-License-Identifier: MIT
"""The contour tracker on recorded sequences with hand-made masks."""

from __future__ import annotations

import time
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


def box_of(mask: Mask) -> tuple[int, int, int, int]:
    """(x, y, w, h)."""
    y, x = np.nonzero(mask)
    return int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1


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
        posterior = _core.contour_posterior(image, image, phi, warp, _core.ContourOptions())
        posterior = np.where(posterior == 0.5, np.float32(0), posterior)  # off the grid
        smooth = cv2.GaussianBlur(posterior, (0, 0), ORACLE_SIGMA_PX)
        found.append((iou(posterior > 0.5, true), iou(smooth > 0.5, true)))
    plain, smoothed = np.mean(found, axis=0)
    return float(plain), float(smoothed)


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


HEAD = ["sequence", "mask / box", "thesis: mask / box", "affine", "oracle", "ms: median / 99 %", "thesis: ms"]


@experiment(
    "contour",
    needs=["davis"],
    chosen_on=", ".join(CHOSEN_ON),
    reported_on=", ".join(REPORTED_ON),
    short={"only": ("cows",), "frames": 3},
)
def contour(
    *,
    data: Path,
    only: tuple[Sequence, ...] = CHOSEN_ON + REPORTED_ON,
    frames: int | None = None,
    scale: int = 1,
) -> Table:
    """The contour tracker on recorded sequences with hand-made masks.

    For each sequence: the mean IoU over all frames but the first from a mask and from a box, with the defaults, without
    the optical flow (as in the thesis), and with an affine warp; the oracle, which is the per-pixel posteriors with the
    histograms of the true mask in each frame, in the same windows, thresholded as they are and smoothed; time of a
    frame on one thread.

    Parameters
    ----------
    frames
        of each sequence, at most
    scale
        2: upsampled to 854 x 480
    """
    cv2.setNumThreads(1)
    videos = [open_davis(data / "davis", s, frames, scale) for s in only]
    height, width = videos[0].masks[0].shape
    title = f"Mean IoU of the tracker, {width} x {height}; processor time of a frame on one thread"
    return Table(title, HEAD, [_row(video) for video in videos])
