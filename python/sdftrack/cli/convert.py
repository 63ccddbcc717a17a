# SPDX-License-Identifier: MIT
"""``sdftrack convert``: a recorded sequence in another layout."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sdftrack.cli.common import (
    ColorTopicOption,
    ConfigOption,
    DepthTopicOption,
    DeviceOption,
    LayoutOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    StartOption,
    StepOption,
    StopOption,
    ThreadsOption,
    check_cpu_only,
    opening,
)
from sdftrack.cli.recording import (
    ColorFiles,
    ColorOption,
    ResumeOption,
    ToOption,
    check_to,
    items_of,
    opened,
    warn_of_color,
    write_all,
)


def convert(
    seq: Annotated[Path, typer.Argument(metavar="SEQ", help="Recorded sequence.")],
    to: ToOption = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    resume: ResumeOption = False,
    color: ColorOption = ColorFiles.png,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Write a recorded sequence in another layout: depth, colour, camera, times, poses, masks and models.

    Depth is stored without a change where the layout has a unit that represents it, and the result says where not.
    If the command is interrupted, --resume continues it.
    """
    import sdftrack as st
    from sdftrack.io.writers import Contents

    out = check_to(to, out)
    source = opening(layout, depth_topic, color_topic)
    check_cpu_only(config, device)
    with st.open_sequence(seq, **source) as whole:
        if out.resolve() == seq.resolve():
            raise ValueError(f"--out: expected another folder than the sequence {seq}, got the same")
        part = whole[slice(start, stop, step)]
        contents = Contents(part.camera, part.objects, part.models)
        with opened(out, to, contents, color, resume, overwrite) as writer:
            warn_of_color(part.camera, writer)
            write_all(writer, items_of(part, writer.count, seq.name, quiet), str(seq), "convert", quiet)
