# SPDX-License-Identifier: MIT
"""``sdftrack contour``: segmentation of a deforming object in colour video, from a box."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    StartOption,
    StepOption,
    StopOption,
    ThreadsOption,
    Usage,
    check_cpu_only,
    contour_settings,
    parse_box,
)
from sdftrack.cli.progress import progress

BURN_IN = 60  # frames


class Warp(str, Enum):
    similarity = "similarity"
    affine = "affine"


def contour(
    source: Annotated[
        Path, typer.Argument(metavar="VIDEO|FOLDER", help="Video, or a folder of images in order.")
    ],
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    box: Annotated[
        str | None, typer.Option(metavar="x,y,w,h", help="Location of the object in the first frame, pixels.")
    ] = None,
    mask: Annotated[
        Path | None,
        typer.Option(metavar="M.png", help="Alternatively, a mask: nonzero pixels are the object."),
    ] = None,
    warp: Annotated[
        Warp | None, typer.Option(help="Motion model.  [default: similarity]", case_sensitive=False)
    ] = None,
    memory: Annotated[
        bool, typer.Option("--memory", help="Learn the shape, and recover it when occluded.")
    ] = False,
    memory_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Load the memory from this file, if it exists, and save it there."),
    ] = None,
    burn_in: Annotated[
        int | None,
        typer.Option(min=0, help="Number of burn-in frames.  [default: 60; 0 with a memory from a file]"),
    ] = None,
    masks: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Ground-truth masks, one per frame: adds IoU and iou.png."),
    ] = None,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Track a deforming object in colour video by its outline.

    Writes into DIR mask/NNNNNN.png (0 and 255), overlay.mp4 and result.json (status, confidence,
    warp and area of each frame); with --masks also iou.png. --config: the table [contour] of sdftrack config.
    """
    if out is None:
        raise Usage("expected a folder for the results: --out DIR", "--out")
    if (box is None) == (mask is None):
        raise Usage(f"expected --box or --mask, got {'none' if box is None else 'both'}", "--box")
    from sdftrack.cli.contour_files import ContourFiles, refuse_places
    from sdftrack.io.color_video import ColorVideo
    from sdftrack.recorder import refuse_folder

    check_cpu_only(config, device)  # a frame is the work of one thread of the CPU
    options = contour_settings(config, alone=True)
    if warp is not None:
        options["warp"] = warp.value
    place = _place(box, mask)
    shapes, burn_in = _memory(memory, memory_file, burn_in)
    video = ColorVideo(source)
    truth = _truth(masks)
    refuse_folder(out, overwrite)
    inputs = [("VIDEO|FOLDER", source), ("--mask", mask), ("--masks", masks)]
    refuse_places(out, [(name, path) for name, path in inputs if path is not None])
    frames = video.frames(start, stop, step)
    first = next(frames, None)
    if first is None:
        raise ValueError(f"--start, --stop: expected some of the frames of {source}, got none")
    if isinstance(first[1], Exception):
        raise first[1]
    import sdftrack as st

    tracker = st.contour.ContourTracker(memory=shapes, burn_in=burn_in, **options)
    begun = tracker.start(first[1], **place)
    settings = {
        "source": str(source), "box": box, "mask": None if mask is None else str(mask), "memory": memory,
        "memory_file": None if memory_file is None else str(memory_file), "burn_in": burn_in,
        "start": start, "stop": stop, "step": step, **tracker.options,
    }  # fmt: skip
    files = ContourFiles(out, overwrite, video.fps, truth, settings)
    total = len(range(start, min(stop or video.count, video.count), step)) if video.count else 0
    rest = progress(frames, max(total - 1, 0), source.name or str(source), quiet)
    try:
        files.add(first[0], first[1], begun)
        _follow(tracker, rest, files, begun)
    except (Exception, KeyboardInterrupt) as error:
        _keep(files, error)
        raise
    files.close()
    if memory_file is not None:
        shapes.save(memory_file)
    if not quiet:
        print(files.summary(source))


def _memory(wanted: bool, path: Path | None, burn_in: int | None) -> tuple[Any, int]:
    """The initial memory, and the number of burn-in frames."""
    if not wanted:
        for name, value in (("--memory-file", path), ("--burn-in", burn_in)):
            if value is not None:
                raise Usage("expected --memory with it", name)
        return None, 0
    from sdftrack.contour.memory import ShapeMemory

    if path is not None and path.exists():
        return ShapeMemory.load(path), burn_in or 0
    return ShapeMemory(), BURN_IN if burn_in is None else burn_in


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
    from sdftrack._internal.text_files import reason_of

    if not files.rows or isinstance(error, OSError):
        files.drop()
        return
    files.close(reason_of(error))


def _place(box: str | None, mask: Path | None) -> dict[str, Any]:
    from sdftrack.io.frames import read_mask

    if mask is not None:
        return {"mask": read_mask(mask, f"--mask {mask}")}
    assert box is not None
    return {"box": parse_box(box)}


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
