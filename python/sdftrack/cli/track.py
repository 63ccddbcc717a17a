# SPDX-License-Identifier: MIT
"""``sdftrack track``: poses of known objects in recorded sequences, with video and report."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

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
    SensorOption,
    StartOption,
    StepOption,
    StopOption,
    ThreadsOption,
    Usage,
    opening,
    tracker_settings,
)
from sdftrack.cli.init import INIT, Init, begin, parse_inits
from sdftrack.cli.progress import progress
from sdftrack.cli.sequences import MODES, check_usage, each_sequence
from sdftrack.cli.start_picture import NAME, StartError, error_with_picture, save_start_picture
from sdftrack.cli.symmetries import check_symmetry, give_symmetries
from sdftrack.cli.targets import Target, load_mesh, load_targets

ALL_LOST = 3  # exit code


@dataclass(frozen=True)
class Job:
    """The settings of a run, common to all sequences."""

    models: list[Path]
    inits: list[Init]
    mode: str
    overlay: list[Path]
    overwrite: bool
    part: slice
    source: dict[str, Any]  # arguments of open_sequence
    unit: str | None
    voxels: int
    holes: str
    colored: bool
    symmetry: str
    video: bool
    options: dict[str, Any]
    quiet: bool


def track(
    seq: Annotated[list[str], typer.Argument(metavar="SEQ", help="Folders of recorded sequences.")],
    model: Annotated[list[Path], typer.Option(metavar="M.ply", help="Mesh; repeat for several objects.")],
    count: Annotated[
        list[int] | None,
        typer.Option(
            min=1, metavar="N", help="Number of copies of the --model; once, or repeated for every model."
        ),
    ] = None,
    init: Annotated[
        list[str] | None,
        typer.Option(
            metavar=INIT,
            help="Location of the objects in the first image: ground truth (default); automatic search; a file; "
            "a mask, box or click in the depth image, repeated for every --model.",
        ),
    ] = None,
    mode: Annotated[
        str,
        typer.Option(
            metavar="auto|depth|rgbd|rgb",
            help="Depth only; with colour if available; or only the outline in the colour image.",
        ),
    ] = "auto",
    outline: Annotated[
        bool | None,
        typer.Option(
            "--outline/--no-outline",
            show_default="on, except with --mode depth",
            help="Also use the outline in the colour image, if depth is biased or missing.",
        ),
    ] = None,
    overlay_mesh: Annotated[
        list[Path] | None,
        typer.Option(metavar="MESH.ply", help="Mesh drawn at the pose; the k-th one at the k-th object."),
    ] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    start: StartOption = 0,
    stop: StopOption = None,
    step: StepOption = 1,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the meshes: m, mm, cm or in.")] = None,
    voxels: Annotated[
        int, typer.Option(min=8, help="Voxels along the longest side of a model's volume.")
    ] = 200,
    holes: Annotated[
        str, typer.Option(metavar="error|close", help="Open meshes: report an error, or close them.")
    ] = "error",
    colored: Annotated[
        bool,
        typer.Option(
            "--colored", help="Use the models' colours, which resolve rotations that their shapes do not."
        ),
    ] = False,
    symmetry: Annotated[
        str,
        typer.Option(
            metavar="auto|none|models_info.json",
            help="Symmetries for the errors: from the data set or detected in the shape; none; a BOP file.",
        ),
    ] = "none",
    no_video: Annotated[bool, typer.Option("--no-video", help="Do not write overlay.mp4.")] = False,
    config: ConfigOption = None,
    sensor: SensorOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Track known shapes in recorded sequences.

    Writes poses.csv (BOP), trajectory_<k>.txt (TUM), overlay.mp4 and report.json into DIR; several sequences get
    a folder each. The exit code is 3 where an object is lost in all frames.
    """
    model = _copies(model, count or [1] * len(model))
    _check_usage(mode, unit, holes, out, overlay_mesh, model)
    if colored and mode == "depth":
        raise Usage("expected --mode rgbd or auto: depth mode does not use colours", "--colored")
    inits = parse_inits(init or ["gt"], len(model))
    if mode == "rgb" and any(i.kind not in ("gt", "poses") for i in inits):
        raise Usage(
            "expected gt or a file of poses: --mode rgb uses no depth, so it cannot search for an object",
            "--init",
        )
    source = opening(layout, depth_topic, color_topic)
    assert out is not None
    options = {**tracker_settings(config, sensor), "device": device, "threads": threads}
    if outline is not None:
        if outline and mode == "depth":
            raise Usage(
                "expected --mode rgbd, rgb or auto: depth mode does not use colour images", "--outline"
            )
        if not outline and mode == "rgb":
            raise Usage("expected --outline: --mode rgb uses nothing else", "--no-outline")
        options["outline"] = outline
    part = slice(start, stop, step)
    job = Job(
        models=model,
        inits=inits,
        mode=mode,
        overlay=overlay_mesh or [],
        overwrite=overwrite,
        part=part,
        source=source,
        unit=unit,
        voxels=voxels,
        holes=holes,
        colored=colored,
        symmetry=symmetry,
        video=not no_video,
        options=options,
        quiet=quiet,
    )
    check_symmetry(symmetry)
    lost: list[str] = []
    each_sequence(seq, out, lambda folder, target: lost.extend(_track_one(folder, target, job)))
    if lost:
        for line in lost:
            print(f"sdftrack: {line}", file=sys.stderr)
        raise typer.Exit(ALL_LOST)


def _copies(models: list[Path], counts: list[int]) -> list[Path]:
    if len(counts) != len(models):
        raise Usage(f"expected one per --model ({len(models)}), got {len(counts)}", "--count")
    return [path for path, count in zip(models, counts, strict=True) for _ in range(count)]


def _check_usage(
    mode: str,
    unit: str | None,
    holes: str,
    out: Path | None,
    overlay: list[Path] | None,
    models: list[Path],
) -> None:
    check_usage(mode, unit, out, (*MODES, "rgb"))
    if holes not in ("error", "close"):
        raise Usage(f"expected error or close, got {holes!r}", "--holes")
    if overlay and len(overlay) > len(models):
        raise Usage(f"expected at most one per --model ({len(models)}), got {len(overlay)}", "--overlay-mesh")


def _track_one(folder: Path, out: Path, job: Job) -> list[str]:
    """Returns one line of advice for each object that is lost in all frames."""
    import sdftrack as st
    from sdftrack._internal.background import read_ahead
    from sdftrack.cli.track_summary import StatusCounts, lost_throughout, show_summary

    with st.open_sequence(folder, **job.source) as seq:
        numbers = range(len(seq))[job.part]
        if not len(numbers):
            raise ValueError(f"--start, --stop: expected some of the {len(seq)} frames of {folder}, got none")
        targets = load_targets(job.models, seq, job.unit, job.voxels, job.holes, job.colored)
        give_symmetries(targets, seq, job.symmetry, job.colored)
        meshes: list[Any] = [load_mesh(p, "--overlay-mesh", job.unit) for p in job.overlay]
        names, sdfs = [t.name for t in targets], [t.sdf for t in targets]
        declared = [t.symmetry for t in targets]
        tracker = st.Tracker(sdfs, seq.camera, mode=job.mode, names=names, symmetry=declared, **job.options)
        frame = fitting(seq[numbers[0]], seq.camera)
        # Before the folder is made: a start that cannot be leaves nothing behind.
        camera = seq.camera if frame.camera is None else frame.camera
        try:
            result, selection = begin(tracker, job.inits, targets, frame, folder, numbers[0], seq)
        except StartError as error:
            raise error_with_picture(error, out, job.overwrite, frame, camera) from None
        results = [result]
        truths: list[dict[int, Any]] = []
        counts = StatusCounts()
        with (
            contextlib.closing(read_ahead(fitting(seq[i], seq.camera) for i in numbers[1:])) as frames,
            st.Recorder(
                out,
                seq.camera,
                sdfs,
                job.video,
                job.overwrite,
                obj_ids=[t.obj_id for t in targets],
                names=names,
                meshes=meshes + [None] * (len(targets) - len(meshes)) if meshes else None,
                scene_id=int(folder.resolve().name) if folder.resolve().name.isdigit() else 0,
                settings=_settings(folder, job, targets, numbers, seq, tracker),
                bop_name=_bop_name(folder) if seq.layout == "bop" else None,
            ) as recorder,
        ):
            if selection:
                save_start_picture(out / NAME, frame, camera, selection, result, sdfs)
            label = folder.name or str(folder)
            for i in progress(numbers, len(numbers), label, job.quiet, counts):
                if i != numbers[0]:
                    frame = next(frames)
                    results.append(tracker.track(frame))
                counts.add(results[-1])
                truth = seq.ground_truth.get(i, {})
                truths.append({k: truth[t.instance] for k, t in enumerate(targets) if t.instance in truth})
                recorder.add(frame, results[-1], im_id=seq.ids[i], truth=truths[-1])
            delay = tracker.color_delay
            if delay:
                recorder.note("color_delay", dataclasses.asdict(delay))
        if not job.quiet:
            alike = {k: t.symmetry for k, t in enumerate(targets) if t.symmetry}
            show_summary(folder, names, results, truths, [seq.ids[i] for i in numbers], out, alike)
            if delay and delay.significant:
                print(f"{delay}: the two images of a frame are not simultaneous")
            if selection and "lost" in map(str, results[0].status):
                print(f"the regions selected as objects in the first frame: {out / NAME}")
        return list(lost_throughout(folder, names, results, [i.kind for i in job.inits]))


def _settings(
    folder: Path, job: Job, targets: list[Target], numbers: range, seq: Any, tracker: Any
) -> dict[str, Any]:
    """Settings for report.json."""
    return {
        "command": "track",
        "sequence": str(folder),
        "layout": seq.layout,
        "models": [str(t.path) for t in targets],
        "known_models": [t.known for t in targets],
        **(
            {}
            if job.symmetry == "none"
            else {"symmetries": [t.symmetry.to_dict() if t.symmetry else None for t in targets]}
        ),
        "instances": [t.instance for t in targets],
        "init": job.inits[0].text if len(job.inits) == 1 else [i.text for i in job.inits],
        "mode": tracker.mode,
        "frames": [numbers.start, numbers.stop, numbers.step],
        "voxels": job.voxels,
        "colored": job.colored,
        "threads": job.options["threads"],
        **({} if tracker.sensor is None else {"sensor": tracker.sensor.to_dict()}),
        "tracker": tracker.options.to_dict(),
    }


def fitting(frame: Any, camera: Any) -> Any:
    """The frame, or an unreadable one if its size differs from the camera's."""
    from sdftrack.frame import Frame

    lens = frame.camera if frame.camera is not None else camera
    shape = getattr(lens, "depth", lens).shape
    if frame.depth is None or frame.depth.shape == shape:
        return frame
    size = " x ".join(map(str, frame.depth.shape[::-1]))
    return Frame.unreadable(
        f"the depth image is {size}, the camera {shape[1]} x {shape[0]}", frame.timestamp, frame.index
    )


def _bop_name(folder: Path) -> str:
    """``sdftrack_<dataset>-<split>.csv`` from <dataset>/<split>/<scene>; a single scene is its own data set."""
    scene = folder.resolve()
    split = scene.parent.name
    if scene.name.isdigit() and split.split("_")[0] in ("train", "val", "test"):
        return f"sdftrack_{scene.parent.parent.name}-{split}.csv"
    return f"sdftrack_{scene.name}-test.csv"
