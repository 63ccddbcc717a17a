# SPDX-License-Identifier: MIT
"""``sdftrack contour``: segmentation of a deforming object in colour video, from a box."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sdftrack._internal.text_files import reason_of
from sdftrack.cli.common import Common, contour_settings, parse_box
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress
from sdftrack.cli.sources import Frames

BURN_IN = 60  # frames


@dataclass(frozen=True, kw_only=True)
class Contour(Frames, Common):
    """Track a deforming object in colour video by its outline.

    Writes into DIR mask/NNNNNN.png (0 and 255), overlay.mp4 and result.json (status, confidence,
    warp and area of each frame); with --masks also iou.png. --config: the table [contour] of sdftrack config.
    """

    source: Path = argument("Video, or a folder of images in order.", "VIDEO|FOLDER")
    box: str | None = option(None, "Location of the object in the first frame, pixels.", metavar="x,y,w,h")
    mask: Path | None = option(None, "Alternatively, a mask: nonzero pixels are the object.", metavar="M.png")
    warp: Literal["similarity", "affine"] | None = option(None, "Motion model.  [default: similarity]")
    memory: bool = option(False, "Learn the shape, and recover it when occluded.")
    memory_file: Path | None = option(
        None, "Load the memory from this file, if it exists, and save it there.", metavar="FILE"
    )
    burn_in: int | None = option(
        None, "Number of burn-in frames.  [default: 60; 0 with a memory from a file]", min=0
    )
    masks: Path | None = option(
        None, "Ground-truth masks, one per frame: adds IoU and iou.png.", metavar="FOLDER"
    )

    def place(self) -> dict[str, Any]:
        from sdftrack.io.frames import read_mask

        if self.mask is not None:
            return {"mask": read_mask(self.mask, f"--mask {self.mask}")}
        assert self.box is not None
        return {"box": parse_box(self.box)}

    def first_memory(self) -> tuple[Any, int]:
        """The initial memory, and the number of burn-in frames."""
        from sdftrack.contour.memory import ShapeMemory

        if self.memory_file is not None and self.memory_file.exists():
            return ShapeMemory.load(self.memory_file), self.burn_in or 0
        return ShapeMemory(), BURN_IN if self.burn_in is None else self.burn_in

    def settings(self, burn_in: int) -> dict[str, Any]:
        return {
            "source": str(self.source), "box": self.box, "mask": self.mask and str(self.mask), "memory": self.memory,
            "memory_file": self.memory_file and str(self.memory_file), "burn_in": burn_in,
            "start": self.start, "stop": self.stop, "step": self.step,
        }  # fmt: skip


def contour(job: Contour) -> None:
    out = job.folder
    if (job.box is None) == (job.mask is None):
        raise Usage(f"expected --box or --mask, got {'none' if job.box is None else 'both'}", "--box")
    for name, value in (("--memory-file", job.memory_file), ("--burn-in", job.burn_in)):
        if value is not None and not job.memory:
            raise Usage("expected --memory with it", name)
    from sdftrack.cli.contour_files import ContourFiles, refuse_places
    from sdftrack.contour import ContourTracker
    from sdftrack.io.video import ColorVideo

    job.on_cpu()  # a frame is the work of one thread of the CPU
    options = contour_settings(job.config, alone=True)
    if job.warp is not None:
        options["warp"] = job.warp
    place = job.place()
    shapes, burn_in = job.first_memory() if job.memory else (None, 0)
    video = ColorVideo(job.source)
    truth = _truth(job.masks)
    job.refuse_out()
    inputs = [("VIDEO|FOLDER", job.source), ("--mask", job.mask), ("--masks", job.masks)]
    refuse_places(out, [(name, path) for name, path in inputs if path is not None])
    frames = video.frames(job.start, job.stop, job.step)
    number, image = _first(job, frames)
    tracker = ContourTracker(memory=shapes, burn_in=burn_in, **options)
    begun = tracker.start(image, **place)
    files = ContourFiles(out, job.overwrite, video.fps, truth, {**job.settings(burn_in), **tracker.options})
    total = len(range(video.count)[job.part]) if video.count else 0
    rest = progress(frames, max(total - 1, 0), job.source.name or str(job.source), job.quiet)
    try:
        files.add(number, image, begun)
        _follow(tracker, rest, files, begun)
    except (Exception, KeyboardInterrupt) as error:
        _keep(files, error)
        raise
    files.close()
    if job.memory_file is not None and shapes is not None:
        shapes.save(job.memory_file)
    if not job.quiet:
        print(files.summary(job.source))


def _first(job: Contour, frames: Any) -> tuple[int, Any]:
    first = next(frames, None)
    if first is None:
        raise ValueError(f"--start, --stop: expected some of the frames of {job.source}, got none")
    if isinstance(first[1], Exception):
        raise first[1]
    return int(first[0]), first[1]


def _follow(tracker: Any, frames: Iterable[tuple[int, Any]], files: Any, last: Any) -> None:
    """Track the remaining frames; unusable ones are reported and skipped."""
    from sdftrack.cli.contour_files import bad_frame, trouble_of

    for number, image in frames:
        trouble = str(image) if isinstance(image, Exception) else trouble_of(image, last)
        if trouble:
            files.add(number, None, bad_frame(last, trouble))
            continue
        last = tracker.track(image)
        files.add(number, image, last)


def _keep(files: Any, error: BaseException) -> None:
    """Keep the results obtained so far, unless the disk is full."""
    if not files.rows or isinstance(error, OSError):
        files.drop()
        return
    files.close(reason_of(error))


def _truth(masks: Path | None) -> list[Path] | None:
    from sdftrack.io.datasets.images import image_files

    if masks is None:
        return None
    if not masks.is_dir():
        raise FileNotFoundError(f"--masks: no such folder: {masks}")
    files = image_files(masks)
    if not files:
        raise ValueError(f"--masks: expected a folder of masks, got one without images: {masks}")
    return files
