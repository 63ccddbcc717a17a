# SPDX-License-Identifier: MIT
"""``sdftrack record`` and ``sdftrack convert``: the frames of a camera, or of a recording in another layout."""

from __future__ import annotations

import itertools
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack.cli.common import above_zero
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress
from sdftrack.cli.recording import Item, Recording, items_of, write_all
from sdftrack.cli.sources import CameraSize, Frames, Layout

WAITING = 60  # frames that may wait for the disk: 2 s


@dataclass(frozen=True, kw_only=True)
class Record(CameraSize, Recording):
    """Record a camera until Ctrl-C: depth without loss, colour, camera and times.

    A full disk ends the recording; what was written before is complete and can be read. --resume continues after an
    interruption.
    """

    source: str = argument("realsense:, realsense:SERIAL or replay:RECORDING.", "CAMERA")
    seconds: float | None = option(
        None, "Stop after this time; default: Ctrl-C.", check=above_zero("a time in seconds")
    )
    frames: int | None = option(None, "Stop after this number of frames.", min=1)


def record(job: Record) -> None:
    from sdftrack.io.writers import Contents

    _ = job.folder  # there has to be one
    job.on_cpu()
    with job.opened(job.source, WAITING) as camera:
        with job.writer(Contents(camera.camera)) as writer:
            if not job.quiet:
                print(f"recording {camera.name}; end with Ctrl-C", file=sys.stderr, flush=True)
            items = itertools.islice(_items(camera, job), job.frames)
            write_all(writer, items, job.source, "record", job.quiet)
        if camera.dropped:
            print(
                f"sdftrack: warning: {camera.dropped} of {camera.taken} frames were dropped: the disk or the "
                "processor is too slow; use --color jpg, or fewer frames per second",
                file=sys.stderr,
            )


def _items(camera: Any, job: Record) -> Iterator[Item]:
    end = math.inf if job.seconds is None else time.monotonic() + job.seconds
    for frame in progress(camera, 0, "recording", job.quiet, lambda: f"{camera.dropped} dropped"):
        if time.monotonic() >= end:
            return
        yield Item(frame)


@dataclass(frozen=True, kw_only=True)
class Convert(Frames, Layout, Recording):
    """Write a recorded sequence in another layout: depth, colour, camera, times, poses, masks and models.

    Depth is stored without a change where the layout has a unit that represents it, and the result says where not.
    If the command is interrupted, --resume continues it.
    """

    seq: Path = argument("Recorded sequence.", "SEQ")
    depth_glob: str | None = option(
        None, "Depth images below SEQ of no known layout, in millimetres; quote it.", metavar="PATTERN"
    )
    color_glob: str | None = option(None, "Colour images below SEQ, likewise.", metavar="PATTERN")
    camera: Path | None = option(
        None, "Camera of those images. Default: a camera file in SEQ.", metavar="FILE"
    )

    @property
    def opening(self) -> dict[str, Any]:
        """Keyword arguments of `open_sequence`."""
        globs = {"depth_glob": self.depth_glob, "color_glob": self.color_glob, "camera": self.camera}
        if self.depth_glob is not None:
            return {"layout": "folders", **globs}
        if self.color_glob is not None or self.camera is not None:
            raise Usage("expected --depth-glob with --color-glob and --camera", "--depth-glob")
        return super().opening


def convert(job: Convert) -> None:
    from sdftrack.io.writers import Contents

    out = job.folder
    job.on_cpu()
    with st.open_sequence(job.seq, **job.opening) as whole:
        if out.resolve() == job.seq.resolve():
            raise ValueError(f"--out: expected another folder than the sequence {job.seq}, got the same")
        part = whole[job.part]
        with job.writer(Contents(part.camera, part.objects, part.models)) as writer:
            items = items_of(part, writer.count, job.seq.name, job.quiet)
            write_all(writer, items, str(job.seq), "convert", job.quiet)
