# SPDX-License-Identifier: MIT
"""``--then`` of ``sdftrack reconstruct``: further recordings of the same object, which extend its shape."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack.cli.common import Usage
from sdftrack.cli.init import Init
from sdftrack.cli.progress import Tell
from sdftrack.cli.reconstruct_files import write_refined
from sdftrack.cli.reconstruct_place import Place, find_place, parse_place
from sdftrack.cli.track import fitting
from sdftrack.cli.track_summary import show_summary

INIT = "box:x,y,w,h|mask.png|mask"

__all__ = ["Further", "check_further", "follow_further", "parse_further"]


@dataclass(frozen=True)
class Further:
    """A further recording: its folder, and the location of the object in its first image (None: its own mask)."""

    folder: Path
    init: Init | None


@dataclass
class Followed:
    """Result of a further recording, and the index of its first frame among all frames."""

    folder: Path
    out: Path
    recorder: Any
    ids: list[int]
    results: list[Any]
    first: int
    truths: list[dict[int, Any]] = field(default_factory=list)

    def write_refined(self, poses: dict[int, Any]) -> None:
        """refined_0.txt of its own frames."""
        own = {i - self.first: T for i, T in poses.items() if 0 <= i - self.first < len(self.results)}
        times = [
            float(i if r.timestamp is None else r.timestamp)
            for i, r in zip(self.ids, self.results, strict=False)
        ]
        self.recorder.wrote(*write_refined(self.out, own, times))

    def tell(self, name: str) -> None:
        """Print the table of its poses."""
        show_summary(self.folder, [name], self.results, self.truths, self.ids, self.out)


def parse_further(folders: list[str], inits: list[str], sequences: list[str]) -> list[Further]:
    """Combine --then and --then-init in order; "mask" stands for the sequence's own mask."""
    if folders and len(sequences) != 1:
        raise Usage(f"expected one SEQ with it, got {len(sequences)}", "--then")
    if inits and len(inits) != len(folders):
        raise Usage(f"expected one for each --then ({len(folders)}), got {len(inits)}", "--then-init")
    places = [None if text == "mask" else parse_place(text, "--then-init", INIT) for text in inits]
    places = places or [None] * len(folders)
    return [Further(Path(folder), place) for folder, place in zip(folders, places, strict=True)]


def check_further(further: Further, job: Any, camera: Any) -> None:
    """Check a further recording in advance; `camera` is that of the first recording."""
    import sdftrack as st

    with st.open_sequence(further.folder, **job.source) as seq:
        if seq.camera != camera:
            raise ValueError(
                f"{further.folder}: expected the camera of the first recording, {camera!r}, got {seq.camera!r}"
            )
        _first(further, seq, job)


def _first(further: Further, seq: Any, job: Any) -> tuple[range, Any, Place]:
    """The frame numbers, the first frame, and the location of the object in it."""
    numbers = range(len(seq))[job.part]
    if not len(numbers):
        raise ValueError(
            f"--start, --stop: expected some of the {len(seq)} frames of {further.folder}, got none"
        )
    frame = fitting(seq[numbers[0]], seq.camera)
    return numbers, frame, find_place(further.init, job.number, seq, numbers[0], frame, further.folder)


def follow_further(run: Any, further: Further, number: int, stack: Any, tell: Tell) -> Followed:
    """Extend the shape of `run` with one more recording, with output in DIR/recording_<number>."""
    import sdftrack as st

    star, job = run.star, run.job
    seq = stack.enter_context(st.open_sequence(further.folder, **job.source))
    numbers, frame, place = _first(further, seq, job)
    result = star.resume(frame, **place.arguments)
    if not result.ok:
        raise ValueError(
            f"{further.folder}: the object was not found reliably in image {seq.ids[numbers[0]]} ({result.reason[0]}): "
            "the recording was not added; start at a better image (--start), or give --then-init"
        )
    out = run.out / f"recording_{number}"
    recorder = stack.enter_context(
        st.Recorder(
            out, seq.camera, star.shape if job.video else None, job.video, job.overwrite,
            obj_ids=[run.obj_id], names=[run.name], scene_id=run.scene_id(further.folder),
            settings=run.settings(further.folder, seq, numbers, further.init, place.instance),
        )
    )  # fmt: skip
    ids = [seq.ids[i] for i in numbers]
    done = Followed(further.folder, out, recorder, ids, [result], result.index)
    for n, i in enumerate(numbers):
        if n:
            frame = fitting(seq[i], seq.camera)
            done.results.append(star.track(frame))
        done.truths.append(_truth(run, seq, i, place.instance))
        grown = star.shape if job.video else None
        recorder.add(frame, done.results[n], im_id=seq.ids[i], truth=done.truths[n], shapes=grown)
        tell(n + 1, len(numbers), further.folder.name or str(further.folder))
    return done


def _truth(run: Any, seq: Any, i: int, instance: int | None) -> dict[int, Any]:
    """The true pose in the reconstruction's object frame, which the first recording's truth ties to the model's."""
    first = run.seq.ground_truth.get(run.numbers[0], {}).get(run.instance)
    here = seq.ground_truth.get(i, {}).get(instance)
    if first is None or here is None:
        return {}
    return {0: np.asarray(here) @ np.linalg.solve(first, run.results[0].pose)}
