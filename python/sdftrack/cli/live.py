# SPDX-License-Identifier: MIT
"""``sdftrack live``: follow or reconstruct objects in front of a camera."""

from __future__ import annotations

import contextlib
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    SensorOption,
    ThreadsOption,
)
from sdftrack.cli.live_camera import (
    FpsOption,
    HeightOption,
    IntrinsicsOption,
    WidthOption,
    is_webcam,
)
from sdftrack.cli.live_usage import INIT, Task

ALL_LOST = 3  # exit code


def live(
    # Named as the arguments of `open_camera`, whose advice about them thus names the options.
    address: Annotated[
        str,
        typer.Option(
            "--camera",
            metavar="CAMERA",
            help="realsense:, realsense:SERIAL, replay:RECORDING, or webcam:0 for --contour and --mode rgb.",
        ),
    ] = "realsense:",
    camera: IntrinsicsOption = None,
    model: Annotated[
        list[Path] | None, typer.Option(metavar="M.ply", help="Mesh; repeat for several objects.")
    ] = None,
    reconstruct: Annotated[
        bool, typer.Option("--reconstruct", help="Reconstruct an unknown object instead.")
    ] = False,
    contour: Annotated[
        bool, typer.Option("--contour", help="Follow an outline in the colour images instead.")
    ] = False,
    init: Annotated[
        list[str] | None,
        typer.Option(
            metavar=INIT,
            help="Location of the objects in the first image: automatic search (default); shown in the browser "
            "(default of --reconstruct and --contour); a file; a mask, box or click in the depth image, repeated for "
            "every --model. --contour: a mask or box in the colour image; --mode rgb: poses.json.",
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
            metavar="ws://HOST:PORT|osc://HOST:PORT|mcap:FILE|foxglove://HOST:PORT",
            help="Send the poses to other programs; repeatable.",
        ),
    ] = None,
    width: WidthOption = None,
    height: HeightOption = None,
    fps: FpsOption = None,
    seconds: Annotated[
        float | None, typer.Option(min=0, help="Stop after this time; default: Ctrl-C.")
    ] = None,
    motion: Annotated[
        bool,
        typer.Option(
            "--motion", help="Speed, path and repetitions so far, on the page and in ws:// streams."
        ),
    ] = False,
    mode: Annotated[
        str,
        typer.Option(
            metavar="auto|depth|rgbd|rgb", help="Depth only, with colour if available, or colour alone."
        ),
    ] = "auto",
    unit: Annotated[str | None, typer.Option(help="Unit of the meshes: m, mm, cm or in.")] = None,
    voxels: Annotated[int, typer.Option(min=8, help="Voxels along the longest side of a volume.")] = 200,
    no_video: Annotated[bool, typer.Option("--no-video", help="Do not write overlay.mp4.")] = False,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    sensor: SensorOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Follow known shapes (--model), an unknown one (--reconstruct) or an outline (--contour) in front of a camera.

    A page in the browser shows the poses; a click on an object, or a box around it, starts it again. With --out the
    files of ``track`` (of ``contour`` with --contour) are written, and recordings that are started on the page. End
    with Ctrl-C; the exit code is 3 where an object was lost in all frames.
    """
    task = Task.of(model or [], reconstruct, contour, mode, address, init, viewer)
    task.check(unit, seconds, device, stream or [], is_webcam(address), camera)
    from sdftrack.cli import live_start
    from sdftrack.cli.live_outline import ColorAlone

    settings = live_start.settings_of(task, config, sensor)
    with contextlib.ExitStack() as stack:
        source = stack.enter_context(live_start.camera_of(task, address, width, height, fps, camera))
        if contour:
            source = ColorAlone(source)
        options = {"unit": unit, "voxels": voxels, "device": device, "threads": threads}
        follower, shapes = live_start.follower_of(task, source.camera, options, settings)
        new_recorder = None
        if out is not None:
            new_recorder = live_start.recorder_of(
                task, out, overwrite, source, follower, shapes, not no_video, address
            )
        page = (
            stack.enter_context(_page(shapes, source.camera, follower.names, host, port)) if viewer else None
        )
        streams = [
            stack.enter_context(_opened_stream(s, follower.names, source.camera)) for s in stream or []
        ]
        if not quiet:
            _tell_start(source, page, streams)
        lost = _run(source, follower, page, streams, new_recorder, out, seconds, quiet, motion)
    if lost:
        print(f"sdftrack: lost in all frames: {', '.join(lost)}", file=sys.stderr)
        raise typer.Exit(ALL_LOST)


def _page(shapes: list[Any], camera: Any, names: list[str], host: str, port: int) -> Any:
    from sdftrack.viz.viewer import Viewer

    return Viewer(shapes, camera, names, host=host, port=port)


def _opened_stream(address: str, names: list[str], camera: Any) -> Any:
    from sdftrack.live.streams import open_stream

    return open_stream(address, names, camera)


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
    motion: bool,
) -> list[str]:
    """Returns the names of the objects that were lost in all frames."""
    from sdftrack.cli.live_files import LiveFiles
    from sdftrack.cli.live_run import Live

    files = LiveFiles(out, source.camera)
    run = Live(source, follower, page, streams, new_recorder, files, quiet, motion)
    began = time.monotonic()
    with contextlib.suppress(KeyboardInterrupt):  # the usual end
        run.run(seconds)
    if not quiet:
        print(run.statistics.line(time.monotonic() - began, source))
        for name, values in zip(follower.names, run.movements, strict=False):
            print(f"{name}: {values.text()}")
        for one in streams:
            print(
                f"{one.address}: {one.sent} messages sent, {one.dropped} dropped{one.error and '; ' + one.error}"
            )
        if run.recorder is not None:
            lost = getattr(run.recorder, "dropped", 0)
            print(f"written to {run.recorder.directory}{f', {lost} frames left out' if lost else ''}")
    counted = run.statistics
    return [
        n for n, count in zip(follower.names, counted.followed, strict=True) if counted.frames and not count
    ]
