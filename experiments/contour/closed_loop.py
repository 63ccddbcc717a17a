# SPDX-License-Identifier: MIT
"""The contour tracker with a memory of shapes, while something passes before the object."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.common.protocol import say
from experiments.contour.contour import SEQUENCES, THESIS, open_davis
from experiments.data import has
from experiments.registry import experiment
from experiments.synth.gait import FIGURES
from experiments.synth.gait_video import GaitVideo, gait_video, occluder
from experiments.table import Table
from sdftrack.contour.dct import align
from sdftrack.contour.memory import ShapeMemory
from sdftrack.contour.result import ContourResult
from sdftrack.contour.tracker import ContourTracker
from sdftrack.metrics import iou

Mask: TypeAlias = NDArray[np.bool_]
BURN_IN = 60
SWEEP = 30  # frames that a bar takes over an object of davis
BAR_COLOR = (90, 90, 200)


@dataclass(frozen=True)
class Run:
    """Mean overlaps with the whole silhouette before the thing, while it is there, and after; and what was said."""

    before: float
    during: float
    after: float
    judgements: Counter[str]
    judged_before: Counter[str]
    lost: int
    milliseconds: float
    milliseconds_during: float
    masks: list[Mask]


def follow(
    video: GaitVideo,
    memory: ShapeMemory | None,
    burn_in: int = BURN_IN,
    told: bool = False,
    options: Mapping[str, Any] = THESIS,
) -> Run:
    """Track a video from its first mask; `told`: an ideal memory in place of one; `options` of the tracker."""
    ideal = _Told() if told else None
    tracker = ContourTracker(memory=ideal or memory, burn_in=0 if told else burn_in, **options)
    tracker.start(video.images[0], mask=video.whole[0])
    found, results, seconds = [], [], []
    for image, whole in zip(video.images[1:], video.whole[1:], strict=True):
        if ideal is not None:
            ideal.prepare(tracker, whole)
        began = time.thread_time()  # what others do on this machine does not count
        result = tracker.track(image)
        seconds.append(time.thread_time() - began)
        found.append(iou(result.mask, whole))
        results.append(result)
    return _summed(video, np.array(found), results, 1e3 * np.array(seconds), burn_in)


def _summed(
    video: GaitVideo,
    found: NDArray[np.float64],
    results: list[ContourResult],
    ms: NDArray[np.float64],
    burn_in: int,
) -> Run:
    first, last = video.during.start - 1, video.during.stop - 1
    start = min(burn_in, first - 1)

    def said(some: list[ContourResult]) -> Counter[str]:
        return Counter(r.judgement or "-" for r in some)

    return Run(
        float(found[start:first].mean()),
        float(found[first:last].mean()),
        float(found[last:].mean()) if last < len(found) else float("nan"),
        said(results[first:last]),
        said(results[start:first]),
        sum(r.status == "lost" for r in results[first:last]),
        float(np.median(ms[start:first])),
        float(np.median(ms[first:last])),
        [video.whole[0], *(r.mask for r in results)],
    )


class _Told:
    """Knows each frame's whole silhouette, in the image."""

    def __init__(self) -> None:
        self._tracker: ContourTracker | None = None
        self._whole: Mask | None = None

    def prepare(self, tracker: ContourTracker, whole: Mask) -> None:
        self._tracker, self._whole = tracker, whole

    def learn(self, mask: Mask) -> None:
        pass

    def judge(self, mask: Mask) -> str:
        whole = self.recover(mask)
        return "occluded" if np.count_nonzero(mask & whole) < 0.95 * np.count_nonzero(whole) else "unoccluded"

    def recover(self, mask: Mask) -> Mask:
        import cv2

        assert self._tracker is not None
        assert self._whole is not None
        image = cv2.warpAffine(
            self._whole.astype(np.float32), self._tracker.warp[:2], mask.shape[::-1],
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )  # fmt: skip
        return np.asarray(image > 0.5)


def davis_video(folder: Path, name: str, most: int | None = None) -> GaitVideo:
    """A sequence with a bar drawn into the images in the middle of its second half.

    `whole` is the hand-made mask, that is what was visible without the bar.
    """
    given = open_davis(folder, name, most)
    n = len(given.images)
    first = n // 2 + 5
    during = range(first, min(n - 3, first + SWEEP))
    images, seen = [], []
    for k, (image, whole) in enumerate(zip(given.images, given.masks, strict=True)):
        there = np.zeros_like(whole)
        if k in during:
            y, x = np.nonzero(whole)
            box = (int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1)
            there = occluder("bar", whole.shape, box, (k - first) / len(during))
        images.append(np.where(there[..., None], np.array(BAR_COLOR, np.uint8), image))
        seen.append(whole & ~there)
    return GaitVideo(images, given.masks, seen, during)


def row(name: str, video: GaitVideo, burn_in: int) -> list[str]:
    """One line of the table."""
    plain = follow(video, None, burn_in)
    memory = ShapeMemory()
    with_it = follow(video, memory, burn_in)
    ideal = follow(video, None, burn_in, told=True)
    seen = np.mean([iou(video.seen[k], video.whole[k]) for k in video.during])
    return [
        name,
        *(f"{r.before:.3f}" for r in (plain, with_it)),
        f"{seen:.3f}",
        *(f"{r.during:.3f}" for r in (plain, with_it, ideal)),
        f"{with_it.during - plain.during:+.3f}",
        *(f"{r.after:.3f}" for r in (plain, with_it)),
        counts(with_it.judgements),
        str(with_it.judged_before["occluded"]),
        f"{plain.lost} / {with_it.lost}",
        f"{plain.milliseconds:.1f} / {with_it.milliseconds:.1f} / {with_it.milliseconds_during:.1f}",
    ]


def taught_row(name: str, video: GaitVideo) -> list[str]:
    """A memory that has learnt the true masks of the first half; the second is tracked from its first true mask."""
    middle = len(video.images) // 2
    memory = ShapeMemory()
    for mask in video.whole[:middle]:
        memory.learn(align(mask)[0])
    during = range(video.during.start - middle, video.during.stop - middle)
    rest = GaitVideo(video.images[middle:], video.whole[middle:], video.seen[middle:], during)
    plain, with_it = follow(rest, None, 0), follow(rest, memory, 0)
    seen = np.mean([iou(rest.seen[k], rest.whole[k]) for k in during])
    return [
        name,
        f"{seen:.3f}",
        *(f"{r.during:.3f}" for r in (plain, with_it)),
        *(f"{r.after:.3f}" for r in (plain, with_it)),
        counts(with_it.judgements),
    ]


def counts(said: Counter[str]) -> str:
    """Frames of each judgement; "-": lost."""
    return " ".join(str(said[j]) for j in ("occluded", "unoccluded", "novel", "-"))


HEAD = [
    "video", "before", "before, memory", "seen", "during", "during, memory", "ideal", "gain", "after", "after, memory",
    "occl. unocc. novel -", "false", "lost", "ms: none / memory / during",
]  # fmt: skip


@experiment(
    "closed_loop",
    uses=["davis"],
    chosen_on="the four gaits, seed 0, and davis",
    reported_on="the four gaits, seeds 1 and 2, and davis, on which it was chosen",
    short={"things": ("bar",), "kinds": 1, "frames": 32, "videos": ()},
)
def closed_loop(
    *,
    data: Path,
    seeds: int = 2,
    frames: int = 160,
    kinds: int = len(FIGURES),
    things: tuple[Literal["none", "bar", "fence", "window"], ...] = ("bar", "fence", "window"),
    videos: tuple[Literal["cows", "camel", "libby", "bmx-trees"], ...] = SEQUENCES,
) -> list[Table]:
    """The contour tracker with a memory of shapes, while something passes before the object.

    Mean overlaps with the *whole* object: before, while the thing is there, and after; and the judgements then. Videos:
    four synthetic gaits with a bar that sweeps over the figure, a fence, and all but its middle hidden; where `davis`
    is at hand, its sequences with a bar drawn into the images of the second half. "seen" is the visible part against
    the whole: what a perfect tracker of the visible part would get. "ideal" is a memory that is told the whole
    silhouette in each frame: what the tracker's loop could do. "gain": during, with the memory less without. "false":
    frames before the thing that are called occluded.

    Parameters
    ----------
    seeds
        videos of each gait, from seed 1; seed 0 is that of the choices
    frames
        of each gait; the thing is there from 100 to 150
    kinds
        of gaits, the first so many
    things
        what passes before the figure
    videos
        of davis
    """
    cv2.setNumThreads(1)
    during = (frames * 5 // 8, frames * 15 // 16)
    burn_in = min(BURN_IN, frames // 2)
    tables = []
    for thing in things:
        rows = [
            row(f"{kind} {seed}", gait_video(kind, frames, thing, during=during, seed=seed), burn_in)
            for kind in list(FIGURES)[:kinds]
            for seed in range(1, seeds + 1)
        ]
        tables.append(Table(f"Gaits, {thing}; {burn_in} frames learned", HEAD, rows))
        say(tables[-1].title)
    if not videos or not has("davis", data):
        return tables
    read = {name: davis_video(data / "davis", name) for name in videos}
    rows = [row(name, video, len(video.images) // 2) for name, video in read.items()]
    tables.append(
        Table("davis, a bar drawn into the images; the first half learned as it is tracked", HEAD, rows)
    )
    rows = [taught_row(name, video) for name, video in read.items()]
    columns = ["video", "seen", "during", "during, memory", "after", "after, memory", "occl. unocc. novel -"]
    title = "davis, the hand-made masks of the first half learned, tracked from the middle on"
    return [*tables, Table(title, columns, rows)]
