# SPDX-License-Identifier: MIT
"""``sdftrack view``: results, a sequence or a mesh in the browser."""

from __future__ import annotations

import math
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
    ThreadsOption,
    Usage,
    check_cpu_only,
    opening,
)
from sdftrack.cli.sequences import check_unit

MESHES = (".ply", ".obj", ".glb", ".stl")


def view(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="DIR|SEQ|MESH",
            help="Output folder of track or reconstruct, a recorded sequence, or a mesh.",
        ),
    ],
    seq: Annotated[
        str | None,
        typer.Option("--seq", metavar="SEQ", help="The sequence of the results, if it has been moved."),
    ] = None,
    host: Annotated[
        str,
        typer.Option(help="Address to listen at; others than localhost are for the network, with a token."),
    ] = "localhost",
    port: Annotated[int, typer.Option(min=0, max=65535, help="First port tried; 0: any free one.")] = 8080,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", help="End after so many seconds. Default: at Ctrl-C.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the meshes: m, mm, cm or in.")] = None,
    layout: LayoutOption = "auto",
    depth_topic: DepthTopicOption = None,
    color_topic: ColorTopicOption = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Show results, a sequence or a mesh on a page in the browser, until Ctrl-C.

    The page's save button writes the image that it shows into DIR of --out, as view_NNNNNN.png.
    """
    source = opening(layout, depth_topic, color_topic)
    check_cpu_only(config, device)
    check_unit(unit)
    if seconds is not None and not 0 <= seconds < math.inf:
        raise Usage(f"expected seconds, 0 or more, got {seconds}", "--seconds")
    from sdftrack.cli.view_files import load_mesh_alone, load_recording

    if not path.exists():
        raise FileNotFoundError(f"{path}: no such folder or file")
    mesh = path.is_file() and path.suffix.lower() in MESHES
    shown = load_mesh_alone(path, unit) if mesh else load_recording(path, seq, source, unit)
    try:
        if out is not None:
            from sdftrack.recorder import prepare_folder

            prepare_folder(out, overwrite)
        _serve(shown, out, host, port, seconds, quiet)
    except KeyboardInterrupt:
        pass  # the usual end
    finally:
        shown.close()


def _serve(shown: Any, out: Path | None, host: str, port: int, seconds: float | None, quiet: bool) -> None:
    import time

    from sdftrack.viz.view import view as open_view

    with open_view(
        shown.frames,
        shown.results,
        shown.meshes,
        camera=shown.camera,
        names=shown.names,
        host=host,
        port=port,
    ) as viewer:
        if viewer.note and not quiet:
            print(viewer.note)
        # Also with --quiet: without its address the page cannot be opened.
        print(f"the page: {viewer.url} (Ctrl-C ends)", flush=True)
        end = math.inf if seconds is None else time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            viewer.wait(min(left, 0.2))
            _save(viewer, out)


def _save(viewer: Any, out: Path | None) -> None:
    """Write the shown image for each `Save` that the page asked for."""
    from sdftrack.viz.pictures import save_picture
    from sdftrack.viz.viewer.requests import Save

    for request in viewer.requests():
        if isinstance(request, Save) and viewer.picture is not None:
            if out is None:
                print("not saved: start with --out DIR", flush=True)
                continue
            number = len(list(out.glob("view_*.png")))
            save_picture(out / f"view_{number:06d}.png", viewer.picture)
            print(f"saved {out / f'view_{number:06d}.png'}", flush=True)
