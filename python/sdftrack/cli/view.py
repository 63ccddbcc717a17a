# SPDX-License-Identifier: MIT
"""``sdftrack view``: results, a sequence or a mesh in the browser."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from sdftrack.cli.common import Common, Unit
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.sources import Layout

MESHES = (".ply", ".obj", ".glb", ".stl")


def _seconds(value: float) -> float:
    if not 0 <= value < math.inf:
        raise Usage(f"expected seconds, 0 or more, got {value}")
    return value


@dataclass(frozen=True, kw_only=True)
class View(Layout, Common):
    """Show results, a sequence or a mesh on a page in the browser, until Ctrl-C.

    The page's save button writes the image that it shows into DIR of --out, as view_NNNNNN.png.
    """

    path: Annotated[
        Path,
        argument("Output folder of track or reconstruct, a recorded sequence, or a mesh.", "DIR|SEQ|MESH"),
    ]
    seq: Annotated[
        str | None, option("The sequence of the results, if it has been moved.", metavar="SEQ")
    ] = None
    host: Annotated[
        str, option("Address to listen at; others than localhost are for the network, with a token.")
    ] = "localhost"
    port: Annotated[int, option("First port tried; 0: any free one.", min=0, max=65535)] = 8080
    seconds: Annotated[
        float | None, option("End after so many seconds. Default: at Ctrl-C.", metavar="S"), _seconds
    ] = None
    unit: Annotated[Unit | None, option("Unit of the meshes.")] = None


def view(job: View) -> None:
    from sdftrack.cli.view_files import load_mesh_alone, load_recording

    job.on_cpu()
    path = job.path
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such folder or file")
    mesh = path.is_file() and path.suffix.lower() in MESHES
    shown = load_mesh_alone(path, job.unit) if mesh else load_recording(path, job.seq, job.opening, job.unit)
    try:
        if job.out is not None:
            from sdftrack.recorder import prepare_folder

            prepare_folder(job.out, job.overwrite)
        _serve(shown, job)
    except KeyboardInterrupt:
        pass  # the usual end
    finally:
        shown.close()


def _serve(shown: Any, job: View) -> None:
    import time

    from sdftrack.viz.view import view as open_view

    about = {"camera": shown.camera, "names": shown.names, "host": job.host, "port": job.port}
    with open_view(shown.frames, shown.results, shown.meshes, **about) as viewer:
        if viewer.note and not job.quiet:
            print(viewer.note)
        # Also with --quiet: without its address the page cannot be opened.
        print(f"the page: {viewer.url} (Ctrl-C ends)", flush=True)
        end = math.inf if job.seconds is None else time.monotonic() + job.seconds
        while (left := end - time.monotonic()) > 0:
            viewer.wait(min(left, 0.2))
            _save(viewer, job.out)


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
