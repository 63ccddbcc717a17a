# SPDX-License-Identifier: MIT
"""``sdftrack reconstruct``: recorded sequences of an unknown object in, its shape, mesh and poses out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    Device,
    DeviceOption,
    LayoutOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    StartOption,
    StepOption,
    StopOption,
    ThreadsOption,
    Usage,
    check_layout,
    reconstructor_settings,
    refuse_cuda,
)
from sdftrack.cli.init import Init
from sdftrack.cli.reconstruct_place import INIT, SHAPE, find_place, load_shape, parse_place, parse_shape
from sdftrack.cli.sequences import check_usage, each_sequence
from sdftrack.cli.track import fitting

FORMATS = ("ply", "obj", "glb", "stl")


@dataclass(frozen=True)
class Job:
    """What was asked for, the same for every sequence."""

    init: Init | None
    number: int | None
    shape: str | None
    unit: str | None
    voxels: int
    extent: float | None
    mode: str
    refine: bool
    formats: list[str]
    seen_only: bool
    overwrite: bool
    part: slice
    layout: str
    video: bool
    device: str
    threads: int
    options: dict[str, Any]
    quiet: bool


def reconstruct(
    seq: Annotated[list[str], typer.Argument(metavar="SEQ", help="Folders of recorded sequences.")],
    init: Annotated[
        str | None,
        typer.Option(
            metavar=INIT,
            help="Where the object is in the first image: a box or a mask in the depth image, or the true pose of "
            "--shape. By default the sequence's own mask.",
        ),
    ] = None,
    number: Annotated[
        int | None,
        typer.Option(
            "--object", min=0, metavar="K", help="Which of the sequence's own objects it is, from 0."
        ),
    ] = None,
    shape: Annotated[
        str | None,
        typer.Option(
            metavar=SHAPE,
            help="A first guess of the shape, metres: a ball, a mesh of its kind, or a shape.npz. By default a ball as "
            "wide as the object.",
        ),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the --shape mesh: m, mm, cm or in.")] = None,
    voxels: Annotated[
        int, typer.Option(min=16, max=512, help="Along each side of the volume; 20 bytes each.")
    ] = 200,
    extent: Annotated[
        float | None,
        typer.Option(metavar="M", help="Side of the volume, m. By default 1.8 times the object's width."),
    ] = None,
    mode: Annotated[
        str, typer.Option(metavar="auto|depth|rgbd", help="Depth alone, or with colour where there is.")
    ] = "auto",
    no_refine: Annotated[
        bool,
        typer.Option(
            "--no-refine", help="Leave poses and shape as they came, without a second look at all frames."
        ),
    ] = False,
    formats: Annotated[
        str,
        typer.Option("--format", metavar="ply,obj,glb,stl", help="Of the mesh; mesh.ply is always written."),
    ] = "ply",
    seen_only: Annotated[
        bool,
        typer.Option("--seen-only", help="Leave what is guessed out of the mesh files; shape.npz has it."),
    ] = False,
    evolution: Annotated[
        str | None,
        typer.Option(
            metavar="ours|printed",
            help="How the shape follows the frames: ours, or as printed in the thesis, with its tracker. By default "
            "as --config says, else ours.",
        ),
    ] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    layout: LayoutOption = "auto",
    no_video: Annotated[
        bool, typer.Option("--no-video", help="Leave out overlay.mp4 and turntable.mp4.")
    ] = False,
    config: ConfigOption = None,
    device: DeviceOption = Device.auto,
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Reconstruct an unknown rigid object from recorded sequences, and track it meanwhile.

    Writes into DIR the mesh (mesh.ply, metres), the shape (shape.npz), and
    mesh.png and turntable.mp4, which show it with what was not seen in violet.

    Also the files of track: poses.csv (BOP) and trajectory_0.txt (TUM) with
    the poses as they were found frame by frame, ground_truth_0.txt where
    known (in the mesh's frame), overlay.mp4, report.json. refined_0.txt has
    the poses that belong to the refined mesh.

    Ctrl-C ends a sequence early and keeps what stands. Several sequences get
    a folder each.
    """
    check_usage(mode, unit, out)
    refuse_cuda(device)
    if extent is not None and not 0 < extent < 10:
        raise Usage(f"expected metres above 0 and below 10, got {extent:g}", "--extent")
    check_layout(layout)
    if evolution not in (None, "ours", "printed"):
        raise Usage(f"expected ours or printed, got {evolution!r}", "--evolution")
    assert out is not None
    job = Job(
        init=parse_place(init),
        number=number,
        shape=parse_shape(shape),
        unit=unit,
        voxels=voxels,
        extent=extent,
        mode=mode,
        refine=not no_refine,
        formats=_formats(formats),
        seen_only=seen_only,
        overwrite=overwrite,
        part=slice(start, stop, step),
        layout=layout,
        video=not no_video,
        device=device.value,
        threads=threads,
        options=reconstructor_settings(config, evolution),
        quiet=quiet,
    )
    if job.init is not None and job.init.kind == "gt" and job.shape is None:
        raise Usage(
            "gt: expected --shape with it, whose true pose the sequence knows; or leave --init out", "--init"
        )
    # What a sequence's own masks or truths do not have is a usage error of that sequence alone.
    each_sequence(seq, out, lambda folder, target: _reconstruct_one(folder, target, job), typer.BadParameter)


def _formats(text: str) -> list[str]:
    names = [name.strip().lower().removeprefix(".") for name in text.split(",")]
    for name in names:
        if name not in FORMATS:
            raise Usage(
                f"expected some of {', '.join(FORMATS)} with commas between, got {text!r}", "--format"
            )
    return names


def _reconstruct_one(folder: Path, out: Path, job: Job) -> None:
    import sdftrack as st
    from sdftrack.cli.reconstruct_run import Run

    with st.open_sequence(folder, layout=job.layout) as seq:
        numbers = range(len(seq))[job.part]
        if not len(numbers):
            raise ValueError(f"--start, --stop: expected some of the {len(seq)} frames of {folder}, got none")
        frame = fitting(seq[numbers[0]], seq.camera)
        place = find_place(job.init, job.number, seq, numbers[0], frame, folder)
        guess = load_shape(job.shape, job.unit, job.voxels)
        star = st.Reconstructor(
            seq.camera,
            guess,
            job.voxels,
            job.extent,
            job.device,
            mode=job.mode,
            threads=job.threads,
            **job.options,
        )
        # Before the folder is made: a start that cannot be leaves nothing behind.
        first = star.start(frame, **place.arguments)
        Run(folder, out, job, seq, numbers, star, place.instance, [first]).go(frame)
