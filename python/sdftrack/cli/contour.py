# SPDX-License-Identifier: MIT
"""``sdftrack contour``: segmentation of a deforming object in colour video, from a box; its files."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import sdftrack as st
from sdftrack._internal.files import PART, write_json
from sdftrack._internal.text_files import reason_of
from sdftrack.cli.common import Common, contour_settings, parse_box
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress
from sdftrack.cli.sources import Frames
from sdftrack.io.out_folder import OutFolder, earlier_files, refuse_inputs

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
    refuse_places(out, [("VIDEO|FOLDER", job.source), ("--mask", job.mask), ("--masks", job.masks)])
    frames = video.frames(job.start, job.stop, job.step)
    number, image = next(frames, (0, None))
    if image is None:
        raise ValueError(f"--start, --stop: expected some of the frames of {job.source}, got none")
    if isinstance(image, Exception):
        raise image
    tracker = ContourTracker(memory=shapes, burn_in=burn_in, **options)
    last = tracker.start(image, **place)
    files = ContourFiles(out, job.overwrite, video.fps, truth, {**job.settings(burn_in), **tracker.options})
    total = len(range(video.count)[job.part]) if video.count else 0
    try:
        files.add(number, image, last)
        label = job.source.name or str(job.source)
        for number, found in progress(frames, max(total - 1, 0), label, job.quiet):
            trouble = str(found) if isinstance(found, Exception) else trouble_of(found, last)
            if isinstance(found, Exception) or trouble:  # told, and passed over
                files.add(number, None, bad_frame(last, trouble))
            else:
                last = tracker.track(found)
                files.add(number, found, last)
    except (Exception, KeyboardInterrupt) as error:
        if not files.rows or isinstance(error, OSError):  # a full disk
            files.drop()
        else:
            files.close(reason_of(error))
        raise
    files.close()
    if job.memory_file is not None and shapes is not None:
        shapes.save(job.memory_file)
    if not job.quiet:
        print(files.summary(job.source))


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


# The names that this command may ever write below DIR.
OWN = re.compile(r"mask/\d{6,}\.png|overlay\.mp4|iou\.png")
# Names of the masks so far, a line each, of a run that has not ended or was killed.
WRITTEN = f".written{PART}"


def refuse_places(out: Path, inputs: Sequence[tuple[str, Path | None]]) -> None:
    """ValueError if an output would replace one of the inputs, (option, path) each; FileExistsError for a mask in the
    folder that was not written by this command."""
    masks = (out / "mask").resolve()
    for name, path in inputs:
        if path is not None and masks in (path.resolve(), *path.resolve().parents):
            raise ValueError(
                f"{name}: expected files outside of {out / 'mask'}, where the results go, got {path}; "
                "choose another --out"
            )
    refuse_inputs(out, ("overlay.mp4", "iou.png", "result.json"), inputs)
    there = {f"mask/{p.name}" for p in masks.glob("*.png")} - _written_before(out)
    strange = sorted(Path(name).name for name in there if OWN.fullmatch(name))
    if strange:
        raise FileExistsError(
            f"out: expected {out / 'mask'} to hold masks of this command alone, got {strange[0]}, which is not "
            f"listed in {out / 'result.json'}; choose another folder, or move it away"
        )


def _written_before(out: Path) -> set[str]:
    """File names, relative to `out`, listed by an earlier run of this command, or by one that was killed."""
    names = earlier_files(out, "result.json", "contour")
    with contextlib.suppress(OSError, ValueError):
        names |= {*(out / WRITTEN).read_text(encoding="utf-8").splitlines()}
    return {name for name in names if OWN.fullmatch(name)}


def trouble_of(image: Any, last: Any) -> str:
    """Why an image cannot follow the result `last`, or ""."""
    height, width = last.mask.shape
    if image.shape[:2] == (height, width):
        return ""
    return f"the image is {image.shape[1]} x {image.shape[0]}, the first one {width} x {height}"


def bad_frame(last: Any, reason: str) -> Any:
    import numpy as np

    return dataclasses.replace(
        last, mask=np.zeros_like(last.mask), status=st.Status.BAD_FRAME, reason=reason, confidence=0.0,
        judgement=None,
    )  # fmt: skip


class ContourFiles:
    """The files of one run. Masks are written immediately; video, plot and report on closing.

    The folder is new or empty, unless `overwrite`: files listed in an earlier run's result.json are replaced. `fps` of
    the video: None is 30. `truth` has a ground-truth mask for each frame of the source; `settings` go to result.json.
    """

    def __init__(
        self, out: Path, overwrite: bool, fps: float | None, truth: list[Path] | None, settings: dict[str, Any],
        video: bool = True,
    ) -> None:  # fmt: skip
        from sdftrack.io.video import VideoFile

        self.out, self.truth, self.settings = out, truth, settings
        self._stale = _written_before(out)
        self._folder = OutFolder(out, overwrite)
        self._list = (out / WRITTEN).open("w", encoding="utf-8", buffering=1)
        self._list.writelines(f"{name}\n" for name in sorted(self._stale))
        (out / "mask").mkdir(exist_ok=True)
        self._video = VideoFile(out / "overlay.mp4", fps or 30.0) if video else None
        self._files: list[str] = []
        self.rows: list[dict[str, Any]] = []

    def add(self, number: int, image: Any, result: Any, timestamp: float | None = None) -> None:
        import numpy as np

        from sdftrack.contour.drawing import draw_outline
        from sdftrack.io.frames import write_mask

        score = self._score(number, result.mask)  # read before anything is written
        name = f"mask/{number:06d}.png"
        self._list.write(f"{name}\n")
        write_mask(self.out / name, result.mask)
        self._files.append(name)
        if self._video is not None:
            shown = np.zeros((*result.mask.shape, 3), np.uint8) if image is None else image
            self._video.add(draw_outline(shown, result.mask, str(result.status)), None)
        row = {
            "frame": number, "status": str(result.status), "reason": result.reason, "confidence": result.confidence,
            "judgement": result.judgement, "area_px": int(result.mask.sum()), "warp": result.warp.tolist(),
        }  # fmt: skip
        self.rows.append({**row, **({} if timestamp is None else {"timestamp": timestamp}), **score})

    def _score(self, number: int, mask: Any) -> dict[str, float]:
        from sdftrack.io.frames import read_mask

        if self.truth is None:
            return {}
        if number >= len(self.truth):
            raise ValueError(f"--masks: expected a mask for frame {number}, got {len(self.truth)} masks")
        true = read_mask(self.truth[number])
        if true.shape != mask.shape:
            raise ValueError(
                f"{self.truth[number]}: expected the frames' size {mask.shape}, got {true.shape}"
            )
        return {"iou": st.metrics.iou(mask, true)}

    def drop(self) -> None:
        if self._video is not None:
            self._video.drop()
        for name in self._files:
            (self.out / name).unlink(missing_ok=True)
        self._end()

    def _end(self) -> None:
        with contextlib.suppress(OSError):
            self._list.close()
        (self.out / WRITTEN).unlink(missing_ok=True)
        self._folder.release()

    def close(self, stopped: str = "") -> None:
        """Finish all files. `stopped`: reason for an early end, one sentence for result.json."""
        from sdftrack.viz.plots import write_plots

        if self._video is not None and self._video.finish():
            os.replace(self._video.part, self.out / "overlay.mp4")
            self._files.append("overlay.mp4")
        report: dict[str, Any] = {"version": st.__version__}
        if self.truth is not None:
            report["mean_iou"] = self.mean_iou()
            self._files += write_plots(self.out, {"iou.png": self._plot})
        report["settings"] = {"command": "contour", **self.settings, "files": self._files}
        if stopped:
            report["stopped"] = stopped
        for name in self._stale - set(self._files):
            (self.out / name).unlink(missing_ok=True)
        write_json(self.out / "result.json", {**report, "frames": self.rows})
        self._end()

    def mean_iou(self) -> float:
        rows = self.rows[1:] or self.rows
        return float(sum(row["iou"] for row in rows) / len(rows))

    def _plot(self) -> Any:
        from sdftrack.viz.plots import figure

        fig, axis = figure(size=(8.0, 3.2))
        numbers = [row["frame"] for row in self.rows]
        axis.plot(numbers, [row["iou"] for row in self.rows], label="IoU")
        axis.plot(numbers, [row["confidence"] for row in self.rows], label="confidence", alpha=0.7)
        for row in self.rows:
            if row["status"] in ("lost", "bad_frame"):
                axis.axvspan(row["frame"] - 0.5, row["frame"] + 0.5, color="#d1495b", alpha=0.15, linewidth=0)
        axis.set(xlabel="frame", ylim=(0, 1.02))
        axis.legend(loc="lower left")
        return fig

    def summary(self, source: Path) -> str:
        count = {s: sum(row["status"] == s for row in self.rows) for s in ("ok", "weak", "lost", "bad_frame")}
        told = ", ".join(f"{n} {s.replace('_', ' ')}" for s, n in count.items() if n)
        text = f"{source}: {len(self.rows)} frames, {told}"
        if self.truth is not None:
            text += f"\n  mean IoU {self.mean_iou():.3f}"
        return f"{text}\n  written to {self.out}"
