# SPDX-License-Identifier: MIT
"""``sdftrack record``: the frames of a camera, stored without loss."""

from __future__ import annotations

import itertools
import math
import sys
import time
from collections.abc import Iterator
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    Usage,
    check_cpu_only,
)
from sdftrack.cli.live_camera import FpsOption, HeightOption, WidthOption, open_from
from sdftrack.cli.progress import progress
from sdftrack.cli.recording import (
    ColorFiles,
    ColorOption,
    Item,
    ResumeOption,
    ToOption,
    check_to,
    opened,
    warn_of_color,
    write_all,
)

WAITING = 60  # frames that may wait for the disk: 2 s


def record(
    source: Annotated[
        str, typer.Argument(metavar="CAMERA", help="realsense:, realsense:SERIAL or replay:RECORDING.")
    ],
    to: ToOption = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    resume: ResumeOption = False,
    color: ColorOption = ColorFiles.png,
    seconds: Annotated[
        float | None, typer.Option(min=0, help="Stop after this time; default: Ctrl-C.")
    ] = None,
    frames: Annotated[int | None, typer.Option(min=1, help="Stop after this number of frames.")] = None,
    width: WidthOption = None,
    height: HeightOption = None,
    fps: FpsOption = None,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Record a camera until Ctrl-C: depth without loss, colour, camera and times.

    A full disk ends the recording; what was written before is complete and can be read. --resume continues after an
    interruption.
    """
    from sdftrack.io.writers import Contents

    out = check_to(to, out)
    if seconds == 0:
        raise Usage("expected a time above 0 s, got 0", "--seconds")
    check_cpu_only(config, device)
    with open_from(source, width, height, fps, waiting=WAITING) as camera:
        contents = Contents(camera.camera)
        with opened(out, to, contents, color, resume, overwrite) as writer:
            warn_of_color(camera.camera, writer)
            if not quiet:
                print(f"recording {camera.name}; end with Ctrl-C", file=sys.stderr, flush=True)
            items = itertools.islice(_items(camera, seconds, quiet), frames)
            write_all(writer, items, source, "record", quiet)
        if camera.dropped:
            print(
                f"sdftrack: warning: {camera.dropped} of {camera.taken} frames were dropped: the disk or the "
                "processor is too slow; use --color jpg, or fewer frames per second",
                file=sys.stderr,
            )


def _items(camera: Any, seconds: float | None, quiet: bool) -> Iterator[Item]:
    end = math.inf if seconds is None else time.monotonic() + seconds
    for frame in progress(camera, 0, "recording", quiet, lambda: f"{camera.dropped} dropped"):
        if time.monotonic() >= end:
            return
        yield Item(frame)
