# SPDX-License-Identifier: MIT
"""What ``track`` and ``reconstruct`` share: a sequence that is followed, its files and the summary that is printed."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import sdftrack as st
from sdftrack._internal.background import read_ahead
from sdftrack.cli.common import show_table
from sdftrack.cli.progress import Tell
from sdftrack.cli.sources import fitting
from sdftrack.viz.page import History

COLORS = {"ok": "green", "weak": "yellow", "lost": "red", "bad frame": "bright_black"}
EVENTS = 5  # lines about trouble after the table
UNITS = "the units of --model (--unit) and of the depth"
# What fits a reason: a part of it, the option that helps, if the command has it and it is not given, and the advice.
REMEDIES = (
    (("ambiguous",), "symmetry",
     "--symmetry auto, if the poses look alike; --colored, if colours tell them apart"),
    (("undetermined",), "symmetry",
     "--symmetry auto, if the object is round; --colored, if colours show how it turns"),
    (("undetermined",), "mask", "colour images show how a round object turns: --mode rgbd"),
    (("another size", "continues where", "free space at"), "scale",
     "--scale free, if the size is not known; check --unit"),
    (("colours do not match",), "mode", "--mode depth, which does not use colours"),
    (("no depth measurement", "too few depth"), "symmetry",
     "--mode rgb, if the object is black, shiny or transparent"),
    (("do not fit the shape", "probability of only"), "sensor",
     "--sensor NAME or FILE, with the errors of the depth camera"),
)  # fmt: skip
MOSTLY = 0.5  # of the frames: an object that is weak or lost in more is told
NEXT = {
    "own": f"check that the masks of the recording show the object, and {UNITS}",
    "gt": "check that --model is the object of the ground truth, in its unit (--unit) and its frame",
    "poses": "check the poses' unit (m) and direction (T_cam_obj), and the unit of --model (--unit)",
    "auto": "give its location: --init box:x,y,w,h, --init click:x,y or --init mask.png",
    "mask": f"check that the mask shows the object in the first image, and {UNITS}",
    "box": f"try a mask, --init mask.png, and check {UNITS}",
    "click": f"try a box or a mask, --init box:x,y,w,h or --init mask.png, and check {UNITS}",
}


class StatusCounts:
    def __init__(self) -> None:
        self._counts = Counter[str]()

    def add(self, result: Any) -> str:
        self._counts.update(map(str, result.status))
        return self()

    def __call__(self) -> str:
        named = ((status, self._counts[status]) for status in ("weak", "lost", "bad_frame"))
        return ", ".join(f"{n} {status.replace('_', ' ')}" for status, n in named if n)


@dataclass
class Followed:
    """A recorded sequence from its first frame on; `job` are the options of the command.

    `truths`: {k: T_cam_obj} of each result, where known.
    """

    job: Any
    folder: Path
    out: Path
    seq: Any
    numbers: range
    frame: Any  # the first one
    results: list[Any] = field(default_factory=list, kw_only=True)
    truths: list[dict[int, Any]] = field(default_factory=list, kw_only=True)

    @property
    def ids(self) -> list[int]:
        return [self.seq.ids[i] for i in self.numbers]

    def recorder(self, shapes: Any, settings: Mapping[str, Any], **more: Any) -> Any:
        name, job, part = self.folder.resolve().name, self.job, self.numbers
        common = {
            "sequence": str(self.folder), "layout": self.seq.layout, "frames": [part.start, part.stop, part.step],
            "threads": job.threads,
        }  # fmt: skip
        return st.Recorder(
            self.out, self.seq.camera, shapes, not job.no_video, job.overwrite,
            scene_id=int(name) if name.isdecimal() else 0, settings={**settings, **common}, **more,
        )  # fmt: skip

    def follow(
        self, track: Callable[[Any], Any], truth: Callable[[int], dict[int, Any]], shapes: Callable[[], Any],
        note: Callable[[Any], str], recorder: Any, tell: Tell,
    ) -> None:  # fmt: skip
        """Track and record all frames; the result of the first one is there. `note`: on a result, for the progress."""
        frame, label = self.frame, self.folder.name or str(self.folder)
        further = read_ahead(fitting(self.seq[i], self.seq.camera, self.job.fps) for i in self.numbers[1:])
        with contextlib.closing(further) as frames:
            for n, i in enumerate(self.numbers):
                if n:
                    frame = next(frames)
                    self.results.append(track(frame))
                self.truths.append(truth(i))
                result = self.results[n]
                recorder.add(frame, result, im_id=self.seq.ids[i], truth=self.truths[n], shapes=shapes())
                tell(n + 1, len(self.numbers), label, note(result))

    def show(self, names: list[str], truths: list[dict[int, Any]], alike: Mapping[int, Any]) -> None:
        rows = []
        for k, name in enumerate(names):
            status = [str(r.status[k]) for r in self.results]
            errors = []
            for truth, r in zip(truths, self.results, strict=True):
                if k in truth and str(r.status[k]) in ("ok", "weak"):
                    true = alike[k].canonical(truth[k], near=r.poses[k]) if k in alike else truth[k]
                    errors.append(st.metrics.pose_error(r.poses[k], true))
            counts = [str(status.count(s)) for s in ("ok", "weak", "lost", "bad_frame")]
            mean = np.mean(errors, axis=0) if errors else (np.nan, np.nan)
            accuracy = [f"{1e3 * mean[0]:.2f}", f"{np.rad2deg(mean[1]):.2f}"] if errors else ["-", "-"]
            rows.append([name, *counts, *accuracy])
        head = ["object", "ok", "weak", "lost", "bad frame", "mean mm", "mean deg"]
        milliseconds = 1e3 * float(np.median([r.seconds for r in self.results]))
        title = f"{self.folder}: {len(self.results)} frames, {milliseconds:.2f} ms per frame -> {self.out}"
        show_table(title, head, rows, COLORS)
        events = list(self._without_pose(names))
        for line in events[:EVENTS]:
            print(line)
        if len(events) > EVENTS:
            print(f"and {len(events) - EVENTS} more, see report.html")

    def _without_pose(self, names: list[str]) -> Iterator[str]:
        for k, name in enumerate(names):
            history = History(name)
            for im_id, result in zip(self.ids, self.results, strict=True):
                history.add(result, k, im_id)
            for run in history.without_pose:
                yield f"{name} {run.status}, {run.images}: {run.reason}"

    def _remedy(self, reasons: list[str], otherwise: str) -> str:
        reason = Counter(reasons).most_common(1)[0][0] if reasons else ""
        for parts, option, advice in REMEDIES:
            open_ = getattr(self.job, option, "given") in (None, "auto", "none", "known")
            if open_ and any(part in reason for part in parts):
                return advice if option == "mask" or not otherwise else f"{advice}; or {otherwise}"
        return otherwise

    def tell_remedies(self, names: list[str], inits: list[str]) -> None:
        """Print a line for each object that was followed but not well: how often, why, and what to try next."""
        for k, name in enumerate(names):
            told = [(str(r.status[k]), r.reason[k]) for r in self.results]
            counts, reasons = (
                Counter(s for s, _ in told),
                [reason for s, reason in told if s in ("weak", "lost")],
            )
            if (counts["ok"] or counts["weak"]) and len(reasons) > MOSTLY * len(told):
                shown = ", ".join(f"{counts[s]} {s}" for s in ("weak", "lost") if counts[s])
                reason = Counter(reasons).most_common(1)[0][0]
                step = self._remedy(reasons, "" if counts["ok"] else NEXT[inits[min(k, len(inits) - 1)]])
                following = f"; next: {step}" if step else ""
                print(f"{name}: {shown} of {len(told)} frames, mostly because {reason}{following}")

    def lost_throughout(self, names: list[str], inits: list[str], after: int = 0) -> Iterator[str]:
        """A line for each object without any pose in the frames from `after` on: since when, why, what to try next."""
        results = self.results[after:] or self.results
        for k, name in enumerate(names):
            if any(str(r.status[k]) in ("ok", "weak") for r in results):
                continue
            reasons = [r.reason[k] for r in results if str(r.status[k]) == "lost"]
            step = self._remedy(reasons, NEXT[inits[min(k, len(inits) - 1)]])
            count = "the only frame" if len(results) == 1 else f"all {len(results)} frames"
            count += " after the first" if len(results) < len(self.results) else ""
            why = reasons[0] if reasons else results[0].reason[k]
            yield f"{self.folder}: {name} is lost in {count} ({why}); next: {step}"
