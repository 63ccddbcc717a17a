# SPDX-License-Identifier: MIT
"""Output of ``sdftrack contour``: masks, a video, a report; and which files may be replaced."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack._internal.files import write_json
from sdftrack.io.out_folder import OutFolder, earlier_files, refuse_inputs
from sdftrack.io.video import PART

# The names that this command may ever write below DIR.
OWN = re.compile(r"mask/\d{6,}\.png|overlay\.mp4|iou\.png")
# Names of the masks so far, a line each, of a run that has not ended or was killed.
WRITTEN = f".written{PART}"


def refuse_places(out: Path, inputs: Sequence[tuple[str, Path]]) -> None:
    """ValueError if an output would replace one of the inputs, (option, path) each; FileExistsError for a mask in the
    folder that was not written by this command."""
    masks = (out / "mask").resolve()
    for option, path in inputs:
        given = path.resolve()
        if given == masks or masks in given.parents:
            raise ValueError(
                f"{option}: expected files outside of {out / 'mask'}, where the results go, got {path}; "
                "choose another --out"
            )
    refuse_inputs(out, ("overlay.mp4", "iou.png", "result.json"), inputs)
    ours = _written_before(out)
    strange = sorted(
        p.name
        for p in masks.glob("*.png")
        if OWN.fullmatch(f"mask/{p.name}") and f"mask/{p.name}" not in ours
    )
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
    """The result of a frame that could not be used, after the result `last`."""
    import numpy as np

    return dataclasses.replace(
        last,
        mask=np.zeros_like(last.mask),
        status=st.Status.BAD_FRAME,
        reason=reason,
        confidence=0.0,
        judgement=None,
    )


class ContourFiles:
    """The files of one run. Masks are written immediately; video, plot and report on closing.

    The folder is new or empty, unless `overwrite`: files listed in an earlier run's result.json are replaced. `fps` of
    the video: None is 30. `truth` has a ground-truth mask for each frame of the source; `settings` go to result.json.
    """

    def __init__(
        self,
        out: Path,
        overwrite: bool,
        fps: float | None,
        truth: list[Path] | None,
        settings: dict[str, Any],
        video: bool = True,
    ) -> None:
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
        """Add a frame's result; `image` is None if it could not be used. `timestamp`: of a camera, seconds."""
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
        self.rows.append(
            {
                "frame": number,
                "status": str(result.status),
                "reason": result.reason,
                "confidence": result.confidence,
                "judgement": result.judgement,
                "area_px": int(result.mask.sum()),
                "warp": result.warp.tolist(),
                **({} if timestamp is None else {"timestamp": timestamp}),
                **score,
            }
        )

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
        """The report lists the files, or there are none."""
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
        """Mean IoU over the tracked frames, without the given first one."""
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
