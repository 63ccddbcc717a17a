# SPDX-License-Identifier: MIT
"""``sdftrack reconstruct``: shape, mesh and poses of an unknown object from recorded sequences."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sdftrack._internal.extras import need
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
    Usage,
    opening,
    reconstructor_settings,
)
from sdftrack.cli.init import Init
from sdftrack.cli.reconstruct_place import INIT, SHAPE, find_place, load_shape, parse_place, parse_shape
from sdftrack.cli.sequences import check_usage, each_sequence
from sdftrack.cli.track import fitting

if TYPE_CHECKING:
    from sdftrack.cli.reconstruct_then import Further

FORMATS = ("ply", "obj", "glb", "stl")


@dataclass(frozen=True)
class Job:
    """The settings of a run, common to all sequences."""

    init: Init | None
    then: list[Further]
    number: int | None
    shape: str | None
    unit: str | None
    voxels: int
    extent: float | None
    mode: str
    refine: bool
    formats: list[str]
    seen_only: bool
    faces: int | None
    texture: int | None
    overwrite: bool
    part: slice
    source: dict[str, Any]  # arguments of open_sequence
    video: bool
    device: str
    threads: int
    options: dict[str, Any]
    quiet: bool


class Quality(str, Enum):
    quick = "quick"
    normal = "normal"
    fine = "fine"


def reconstruct(
    seq: Annotated[list[str], typer.Argument(metavar="SEQ", help="Folders of recorded sequences.")],
    init: Annotated[
        str | None,
        typer.Option(
            metavar=INIT,
            help="Location of the object in the first image: a box or a mask in the depth image, or the true pose of "
            "--shape. Default: the sequence's own mask.",
        ),
    ] = None,
    then: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SEQ",
            help="Another recording of the same object, on another side, that extends its shape; may be repeated.",
        ),
    ] = None,
    then_init: Annotated[
        list[str] | None,
        typer.Option(
            metavar="box:x,y,w,h|mask.png|mask",
            help="Location of the object in the first image of each --then; mask (default): the sequence's own.",
        ),
    ] = None,
    number: Annotated[
        int | None,
        typer.Option(
            "--object", min=0, metavar="K", help="Index of the object among those of the sequence, from 0."
        ),
    ] = None,
    shape: Annotated[
        str | None,
        typer.Option(
            metavar=SHAPE,
            help="Initial shape, metres: a ball, a mesh of a similar object, or a shape.npz. Default: a ball as wide "
            "as the object.",
        ),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the --shape mesh: m, mm, cm or in.")] = None,
    quality: Annotated[
        Quality | None,
        typer.Option(
            help="Voxels along each side of the volume: 96, 200 (the default) or 300.",
            case_sensitive=False,
        ),
    ] = None,
    voxels: Annotated[
        int | None,
        typer.Option(min=16, max=512, help="Number of voxels instead of --quality; 20 bytes each."),
    ] = None,
    extent: Annotated[
        float | None,
        typer.Option(metavar="M", help="Side of the volume, m. Default: 1.8 times the object's width."),
    ] = None,
    mode: Annotated[
        str, typer.Option(metavar="auto|depth|rgbd", help="Depth only, or with colour if available.")
    ] = "auto",
    no_refine: Annotated[
        bool,
        typer.Option("--no-refine", help="Do not refine poses and shape over all frames at the end."),
    ] = False,
    formats: Annotated[
        str,
        typer.Option(
            "--format", metavar="ply,obj,glb,stl", help="Mesh file formats; mesh.ply is always written."
        ),
    ] = "ply",
    seen_only: Annotated[
        bool,
        typer.Option("--seen-only", help="Omit guessed surface from the mesh files; shape.npz contains it."),
    ] = False,
    faces: Annotated[
        int | None,
        typer.Option(
            min=4,
            max=2**31 - 1,
            metavar="N",
            help="Maximum number of triangles in the mesh files. Extra: export.",
        ),
    ] = None,
    texture: Annotated[
        int | None,
        typer.Option(
            min=16,
            max=8192,
            metavar="N",
            help="Store colours in a texture of N x N texels; with --faces, those of the full mesh. Extra: export.",
        ),
    ] = None,
    evolution: Annotated[
        str | None,
        typer.Option(
            metavar="ours|printed",
            help="Evolution of the shape: ours, or as printed in the thesis, with its tracker. Default: as in "
            "--config, else ours.",
        ),
    ] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    no_video: Annotated[
        bool, typer.Option("--no-video", help="Do not write overlay.mp4 and turntable.mp4.")
    ] = False,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Reconstruct an unknown rigid object from recorded sequences while tracking it.

    Writes into DIR the mesh (mesh.ply, metres), the shape (shape.npz), and
    mesh.png and turntable.mp4, which show it with unobserved surface in violet.

    Also the files of track: poses.csv (BOP) and trajectory_0.txt (TUM) with
    the poses estimated frame by frame, ground_truth_0.txt where known (in the mesh's frame), overlay.mp4, report.json.
    refined_0.txt has the poses that belong to the refined mesh.

    Ctrl-C ends a sequence early and keeps the results so far. Several sequences get a folder each; recordings of --then
    continue the shape of the first, and their poses go to DIR/recording_2, and so on.
    """
    from sdftrack.cli.reconstruct_then import parse_further

    check_usage(mode, unit, out)
    if extent is not None and not 0 < extent < 10:
        raise Usage(f"expected metres above 0 and below 10, got {extent:g}", "--extent")
    source = opening(layout, depth_topic, color_topic)
    if evolution not in (None, "ours", "printed"):
        raise Usage(f"expected ours or printed, got {evolution!r}", "--evolution")
    # What is missing is told now, not after all frames.
    if faces is not None:
        need("fast_simplification", "export")
    if texture is not None:
        need("xatlas", "export")
    assert out is not None
    job = Job(
        init=parse_place(init),
        then=parse_further(then or [], then_init or [], seq),
        number=number,
        shape=parse_shape(shape),
        unit=unit,
        voxels=_voxels(quality, voxels),
        extent=extent,
        mode=mode,
        refine=not no_refine,
        formats=_formats(formats),
        seen_only=seen_only,
        faces=faces,
        texture=texture,
        overwrite=overwrite,
        part=slice(start, stop, step),
        source=source,
        video=not no_video,
        device=device,
        threads=threads,
        options=reconstructor_settings(config, evolution),
        quiet=quiet,
    )
    known = job.options.get("evolution") or getattr(job.options.get("options"), "evolution", "ours")
    if job.then and known == "printed":
        raise Usage(
            "expected the default evolution with it, got printed, which supports only one recording", "--then"
        )
    if job.init is not None and job.init.kind == "gt" and job.shape is None:
        raise Usage(
            "gt: requires --shape with a known true pose in the sequence; otherwise omit --init", "--init"
        )
    # What a sequence's own masks or truths do not have is a usage error of that sequence alone.
    each_sequence(seq, out, lambda folder, target: _reconstruct_one(folder, target, job), typer.BadParameter)


def _voxels(quality: Quality | None, voxels: int | None) -> int:
    from sdftrack.reconstruction.arguments import VOXELS

    if voxels is None:
        return VOXELS[(quality or Quality.normal).value]
    if quality is not None:
        raise Usage("expected one of --quality and --voxels, got both", "--quality")
    return voxels


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
    from sdftrack.cli.reconstruct_then import check_further

    with st.open_sequence(folder, **job.source) as seq:
        numbers = range(len(seq))[job.part]
        if not len(numbers):
            raise ValueError(f"--start, --stop: expected some of the {len(seq)} frames of {folder}, got none")
        frame = fitting(seq[numbers[0]], seq.camera)
        place = find_place(job.init, job.number, seq, numbers[0], frame, folder)
        for further in job.then:
            check_further(further, job, seq.camera)
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
