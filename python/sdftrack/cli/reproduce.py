# SPDX-License-Identifier: MIT
"""``sdftrack reproduce``: figures of the thesis, with the printed values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    Usage,
    show_table,
    tracker_settings,
)
from sdftrack.cli.progress import progress_counter


def reproduce(
    figure: Annotated[
        list[str] | None, typer.Argument(metavar="FIGURE", help="Figure ids, see --list.")
    ] = None,
    show_list: Annotated[bool, typer.Option("--list", help="List the available figures.")] = False,
    mesh: Annotated[
        Path | None, typer.Option(metavar="M.ply", help="Mesh to use instead of the built-in shape.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the mesh: m, mm, cm or in.")] = None,
    frames: Annotated[
        int | None, typer.Option(min=2, help="Number of frames, e.g. fewer for a quick test.")
    ] = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Reproduce figures of the thesis; all of them if none is named."""
    from sdftrack import __version__
    from sdftrack._internal.files import write_json
    from sdftrack.mesh import UNITS
    from sdftrack.recorder import prepare_folder
    from sdftrack.reproduce import FIGURES, Context, find

    if show_list:
        for f in FIGURES.values():
            print(f"{f.id:6s} {f.title}")
        return
    try:
        wanted = [find(name) for name in figure] if figure else list(FIGURES.values())
    except ValueError as error:
        raise Usage(str(error)) from None
    if unit not in (None, *UNITS):
        raise Usage(f"expected one of {', '.join(UNITS)}, got {unit!r}", "--unit")
    options = {**tracker_settings(config), "device": device, "threads": threads}
    root = Path("sdftrack-reproduce") if out is None else out
    for f in wanted:
        folder = root / f.id
        prepare_folder(folder, overwrite)
        with progress_counter(quiet) as step:
            made = f.run(Context(folder, mesh, frames, options, step, unit))
        write_json(folder / "result.json", {"version": __version__, "figure": f.id, **made})
        if not quiet:
            show_table(made["title"], made["head"], made["rows"])
            for line in made.get("notes", []):
                print(line)
            print(f"written to {folder}")
