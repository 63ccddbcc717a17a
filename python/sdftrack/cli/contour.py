# SPDX-License-Identifier: MIT
"""``sdftrack contour``: a colour video and a box in, masks out."""

from __future__ import annotations

import itertools
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    Device,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    StartOption,
    StepOption,
    StopOption,
    ThreadsOption,
    Usage,
    check_common,
    progress,
)


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
        str | None, typer.Option(metavar="x,y,w,h", help="Where the object is in the first frame, pixels.")
    ] = None,
    mask: Annotated[
        Path | None, typer.Option(metavar="M.png", help="The same as a mask: not 0 is the object.")
    ] = None,
    warp: Annotated[Warp, typer.Option(help="What moves the shape.", case_sensitive=False)] = Warp.similarity,
    memory: Annotated[
        bool, typer.Option("--memory", help="Learn the shape, and recover it where it is covered.")
    ] = False,
    burn_in: Annotated[int, typer.Option(min=0, help="Frames that --memory learns from first.")] = 60,
    masks: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="True masks, one for each frame: adds IoU and iou.png."),
    ] = None,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    config: ConfigOption = None,
    device: DeviceOption = Device.auto,
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Track something that deforms in colour video by its outline.

    Writes into DIR mask/NNNNNN.png (0 and 255), overlay.mp4 and result.json (status, confidence,
    warp and area of each frame); with --masks also iou.png.
    """
    if out is None:
        raise Usage("expected a folder for the results: --out DIR", "--out")
    if (box is None) == (mask is None):
        raise Usage(f"expected --box or --mask, got {'none' if box is None else 'both'}", "--box")
    from sdftrack.io.color_video import ColorVideo
    from sdftrack.recorder import refuse_folder

    check_common(config, device)  # a frame is the work of one thread of the CPU

    video = ColorVideo(source)
    place = _place(box, mask)
    truth = _truth(masks)
    refuse_folder(out, overwrite)
    frames = itertools.islice(enumerate(video), start, stop, step)
    first = next(frames, None)
    if first is None:
        raise ValueError(f"--start, --stop: expected some of the frames of {source}, got none")
    import sdftrack as st

    tracker = st.contour.ContourTracker(warp.value, st.contour.ShapeMemory() if memory else None, burn_in)
    begun = tracker.start(first[1], **place)
    run = _Run(out, overwrite, video.fps, truth)
    try:
        run.add(first[0], first[1], begun)
        total = len(range(start, min(stop or video.count, video.count), step)) if video.count else 0
        for number, image in progress(frames, max(total - 1, 0), source.name or str(source), quiet):
            run.add(number, image, tracker.track(image))
    except BaseException:
        run.drop()
        raise
    settings = {
        "source": str(source), "box": box, "mask": None if mask is None else str(mask), "memory": memory,
        "burn_in": burn_in, "start": start, "stop": stop, "step": step, **tracker.options,
    }  # fmt: skip
    run.close(settings)
    if not quiet:
        print(run.summary(source))


def _place(box: str | None, mask: Path | None) -> dict[str, Any]:
    from sdftrack.io.frames import read_mask

    if mask is not None:
        return {"mask": read_mask(mask, f"--mask {mask}")}
    from sdftrack.cli.init import parse_init

    return {"box": parse_init(f"box:{box}", "box:x,y,w,h").numbers}


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


class _Run:
    """What is written of the frames."""

    def __init__(self, out: Path, overwrite: bool, fps: float | None, truth: list[Path] | None) -> None:
        from sdftrack.io.video import VideoFile
        from sdftrack.recorder import prepare_folder

        prepare_folder(out, overwrite)
        self.out, self.truth = out, truth
        (out / "mask").mkdir(exist_ok=True)
        for name in [*(out / "mask").glob("*.png"), out / "iou.png"]:  # of an earlier run
            name.unlink(missing_ok=True)
        self.video = VideoFile(out / "overlay.mp4", fps or 30.0)
        self.rows: list[dict[str, Any]] = []

    def add(self, number: int, image: Any, result: Any) -> None:
        from sdftrack.contour.drawing import draw_outline
        from sdftrack.io.frames import read_mask, write_mask
        from sdftrack.metrics import iou

        write_mask(self.out / "mask" / f"{number:06d}.png", result.mask)
        self.video.add(draw_outline(image, result.mask, str(result.status)), None)
        row = {
            "frame": number,
            "status": str(result.status),
            "reason": result.reason,
            "confidence": result.confidence,
            "judgement": result.judgement,
            "area_px": int(result.mask.sum()),
            "warp": result.warp.tolist(),
        }
        if self.truth is not None:
            if number >= len(self.truth):
                raise ValueError(f"--masks: expected a mask for frame {number}, got {len(self.truth)} masks")
            true = read_mask(self.truth[number])
            if true.shape != result.mask.shape:
                raise ValueError(
                    f"{self.truth[number]}: expected the frames' size {result.mask.shape}, got {true.shape}"
                )
            row["iou"] = iou(result.mask, true)
        self.rows.append(row)

    def drop(self) -> None:
        self.video.drop()

    def close(self, settings: dict[str, Any]) -> None:
        import os

        import sdftrack as st
        from sdftrack.io.files import write_json

        if self.video.finish():
            os.replace(self.video.part, self.out / "overlay.mp4")
        report: dict[str, Any] = {"version": st.__version__, "settings": settings}
        if self.truth is not None:
            report["mean_iou"] = self._mean_iou()
            self._plot()
        write_json(self.out / "result.json", {**report, "frames": self.rows})

    def _mean_iou(self) -> float:
        """Over the frames that were tracked; the first was given."""
        rows = self.rows[1:] or self.rows
        return float(sum(row["iou"] for row in rows) / len(rows))

    def _plot(self) -> None:
        from sdftrack.viz.plots import figure, save_figure

        fig, axis = figure(size=(8.0, 3.2))
        numbers = [row["frame"] for row in self.rows]
        axis.plot(numbers, [row["iou"] for row in self.rows], label="IoU")
        axis.plot(numbers, [row["confidence"] for row in self.rows], label="confidence", alpha=0.7)
        for row in self.rows:
            if row["status"] == "lost":
                axis.axvspan(row["frame"] - 0.5, row["frame"] + 0.5, color="#d1495b", alpha=0.15, linewidth=0)
        axis.set(xlabel="frame", ylim=(0, 1.02))
        axis.legend(loc="lower left")
        save_figure(fig, self.out / "iou.png")

    def summary(self, source: Path) -> str:
        count = {s: sum(row["status"] == s for row in self.rows) for s in ("ok", "weak", "lost")}
        told = ", ".join(f"{n} {s}" for s, n in count.items() if n)
        text = f"{source}: {len(self.rows)} frames, {told}"
        if self.truth is not None:
            text += f"\n  mean IoU {self._mean_iou():.3f}"
        return f"{text}\n  written to {self.out}"
