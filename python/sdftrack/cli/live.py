# SPDX-License-Identifier: MIT
"""``sdftrack live``: follow or reconstruct objects in front of a camera."""

from __future__ import annotations

import contextlib
import functools
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    Device,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    SensorOption,
    ThreadsOption,
    Usage,
    reconstructor_settings,
    refuse_cuda,
    tracker_settings,
)
from sdftrack.cli.init import Init, box_inside, mask_file, parse_init, parse_inits
from sdftrack.cli.live_camera import FpsOption, HeightOption, WidthOption, open_from
from sdftrack.cli.sequences import MODES, check_unit

ALL_LOST = 3  # exit code
INIT = "auto|view|poses.json|mask.png|box:x,y,w,h|click:x,y"


def live(
    camera: Annotated[
        str,
        typer.Option(metavar="CAMERA", help="realsense:, realsense:SERIAL, or replay:RECORDING."),
    ] = "realsense:",
    model: Annotated[
        list[Path] | None, typer.Option(metavar="M.ply", help="Mesh; repeat for several objects.")
    ] = None,
    reconstruct: Annotated[
        bool, typer.Option("--reconstruct", help="Reconstruct an unknown object instead.")
    ] = False,
    init: Annotated[
        list[str] | None,
        typer.Option(
            metavar=INIT,
            help="Location of the objects in the first image: automatic search (default); shown in the browser "
            "(default of --reconstruct); a file; a mask, box or click in the depth image, repeated for every --model.",
        ),
    ] = None,
    viewer: Annotated[bool, typer.Option("--viewer/--no-viewer", help="Show a page in the browser.")] = True,
    host: Annotated[
        str, typer.Option(help="Address of the page; others than localhost can be reached from the network.")
    ] = "localhost",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page; 0: any.")] = 8080,
    stream: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ws://HOST:PORT|osc://HOST:PORT|mcap:FILE",
            help="Send the poses to other programs; repeatable.",
        ),
    ] = None,
    width: WidthOption = None,
    height: HeightOption = None,
    fps: FpsOption = None,
    seconds: Annotated[
        float | None, typer.Option(min=0, help="Stop after this time; default: Ctrl-C.")
    ] = None,
    mode: Annotated[
        str, typer.Option(metavar="auto|depth|rgbd", help="Depth only, or with colour if available.")
    ] = "auto",
    unit: Annotated[str | None, typer.Option(help="Unit of the meshes: m, mm, cm or in.")] = None,
    voxels: Annotated[int, typer.Option(min=8, help="Voxels along the longest side of a volume.")] = 200,
    no_video: Annotated[bool, typer.Option("--no-video", help="Do not write overlay.mp4.")] = False,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    sensor: SensorOption = None,
    device: DeviceOption = Device.auto,
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Follow known shapes (--model) in front of a camera, or reconstruct an unknown one (--reconstruct).

    A page in the browser shows the poses; a click on an object, or a box around it, starts it again. With --out the
    files of ``track`` are written, and recordings that are started on the page. End with Ctrl-C; the exit code is 3
    where an object was lost in all frames.
    """
    models = model or []
    from sdftrack.io.out_folder import refuse_folder

    inits = _check_usage(models, reconstruct, init, viewer, mode, unit, seconds, device)
    settings = reconstructor_settings(config) if reconstruct else tracker_settings(config, sensor)
    with contextlib.ExitStack() as stack:
        source = stack.enter_context(open_from(camera, width, height, fps, waiting=2))
        if reconstruct:
            follower, shapes = _reconstructor(source.camera, inits, mode, voxels, threads, settings)
        else:
            options = {**settings, "device": device.value, "threads": threads}
            follower, shapes = _tracker(source.camera, models, inits, mode, unit, voxels, options)
        page = (
            stack.enter_context(_page(shapes, source.camera, follower.names, host, port)) if viewer else None
        )
        streams = [
            stack.enter_context(_opened_stream(s, follower.names, source.camera)) for s in stream or []
        ]
        new_recorder = None
        if out is not None:
            refuse_folder(out, overwrite)
            new_recorder = functools.partial(
                _recorder, out, source, follower, shapes, not no_video, overwrite, camera
            )
        if not quiet:
            _tell_start(source, page, streams)
        lost = _run(source, follower, page, streams, new_recorder, out, seconds, quiet)
    if lost:
        print(f"sdftrack: lost in all frames: {', '.join(lost)}", file=sys.stderr)
        raise typer.Exit(ALL_LOST)


def _check_usage(
    models: list[Path],
    reconstruct: bool,
    init: list[str] | None,
    viewer: bool,
    mode: str,
    unit: str | None,
    seconds: float | None,
    device: Device,
) -> list[Init] | None:
    """The parsed --init; None: shown by the user on the page."""
    if reconstruct == bool(models):
        raise Usage("expected either --model M.ply (repeatable) or --reconstruct", "--model")
    if mode not in MODES:
        raise Usage(f"expected one of {', '.join(MODES)}, got {mode!r}", "--mode")
    check_unit(unit)
    if seconds == 0:
        raise Usage("expected a time above 0 s, got 0", "--seconds")
    if reconstruct:
        refuse_cuda(device)
    texts = init or (["view"] if reconstruct else ["auto"])
    if texts == ["view"]:
        if not viewer:
            raise Usage(
                "expected box:x,y,w,h, or a mask.png: without a page nobody can show the object", "--init"
            )
        return None
    if reconstruct:
        inits = [parse_init(text, INIT) for text in texts]
        if len(inits) != 1 or inits[0].kind not in ("box", "mask"):
            raise Usage(
                f"expected view, box:x,y,w,h or mask.png with --reconstruct, got {' '.join(texts)}", "--init"
            )
        return inits
    if "gt" in texts or "view" in texts:
        raise Usage(f"expected {INIT.replace('|', ', ')}, got {' '.join(texts)}", "--init")
    return parse_inits(texts, len(models))


def _tracker(
    camera: Any,
    models: list[Path],
    inits: list[Init] | None,
    mode: str,
    unit: str | None,
    voxels: int,
    options: dict[str, Any],
) -> tuple[Any, list[Any]]:
    import sdftrack as st
    from sdftrack.cli.live_followers import TrackerFollower, unknown_sequence
    from sdftrack.cli.targets import load_targets

    targets = load_targets(models, unknown_sequence(camera), unit, voxels)
    shapes = [t.sdf for t in targets]
    tracker = st.Tracker(shapes, camera, mode=mode, names=[t.name for t in targets], **options)
    return TrackerFollower(tracker, targets, inits), shapes


def _reconstructor(
    camera: Any, inits: list[Init] | None, mode: str, voxels: int, threads: int, settings: dict[str, Any]
) -> tuple[Any, list[Any]]:
    import sdftrack as st
    from sdftrack.cli.live_followers import ReconstructorFollower

    star = st.Reconstructor(camera, voxels=voxels, mode=mode, threads=threads, **settings)
    where: dict[str, Any] | None = None
    if inits is not None:
        shape = camera.depth.shape
        one = inits[0]
        where = {"box": box_inside(one, shape)} if one.kind == "box" else {"mask": mask_file(one, shape)}
    return ReconstructorFollower(star, where), [st.SDF.sphere(0.01, voxels=16)]


def _page(shapes: list[Any], camera: Any, names: list[str], host: str, port: int) -> Any:
    from sdftrack.viz.viewer import Viewer

    return Viewer(shapes, camera, names, host=host, port=port)


def _opened_stream(address: str, names: list[str], camera: Any) -> Any:
    from sdftrack.live.streams import open_stream

    return open_stream(address, names, camera)


def _recorder(
    out: Path, source: Any, follower: Any, shapes: list[Any], video: bool, overwrite: bool, address: str
) -> Any:
    import sdftrack as st

    settings = {"command": "live", "camera": address, "name": source.name}
    return st.Recorder(
        out,
        source.camera,
        shapes,
        video,
        overwrite,
        names=follower.names,
        settings=settings,
        live=True,
    )


def _tell_start(source: Any, page: Any, streams: list[Any]) -> None:
    print(f"camera: {source.name}", file=sys.stderr)
    for what in (page, *streams):
        if what is not None and what.note:
            print(what.note, file=sys.stderr)
    if page is not None:
        print(f"open {page.url} in a browser; end with Ctrl-C", file=sys.stderr)
    for one in streams:
        print(f"stream: {one.address}", file=sys.stderr)
    sys.stderr.flush()


def _run(
    source: Any,
    follower: Any,
    page: Any,
    streams: list[Any],
    new_recorder: Any,
    out: Path | None,
    seconds: float | None,
    quiet: bool,
) -> list[str]:
    """Returns the names of the objects that were lost in all frames."""
    from sdftrack.cli.live_files import LiveFiles
    from sdftrack.cli.live_run import Live

    files = LiveFiles(out, source.camera)
    run = Live(source, follower, page, streams, new_recorder, files, quiet)
    began = time.monotonic()
    with contextlib.suppress(KeyboardInterrupt):  # the usual end
        run.run(seconds)
    if not quiet:
        print(run.statistics.line(time.monotonic() - began, source))
        for one in streams:
            print(
                f"{one.address}: {one.sent} messages sent, {one.dropped} dropped{one.error and '; ' + one.error}"
            )
        if run.recorder is not None:
            print(f"written to {run.recorder.directory}")
    counted = run.statistics
    return [
        n for n, count in zip(follower.names, counted.followed, strict=True) if counted.frames and not count
    ]
