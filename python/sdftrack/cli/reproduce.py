# SPDX-License-Identifier: MIT
"""``sdftrack reproduce``: figures of the thesis, by the experiments of a source checkout."""

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
    check_common,
)

SOURCE = "a source checkout (git clone, or the sdist: pip download --no-binary sdftrack sdftrack)"


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
    """Reproduce figures of the thesis; all of them if none is named. Needs a source checkout."""
    import os
    import subprocess
    import sys

    check_common(config, device)
    places = [Path.cwd(), *Path.cwd().parents, Path(__file__).resolve().parents[3]]
    root = next((p for p in places if (p / "experiments/figures.py").is_file()), None)
    if root is None:
        raise FileNotFoundError(f"reproduce: the experiments are not installed; run it in {SOURCE}")
    given = {"mesh": mesh, "unit": unit, "frames": frames, "out": out, "config": config, "device": device}
    flags = {"list": show_list, "overwrite": overwrite, "quiet": quiet}
    options = [
        f"--{name}={value}" for name, value in {**given, "threads": threads}.items() if value is not None
    ]
    options += [f"--{name}" for name, value in flags.items() if value]
    path = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-m", "experiments", "figures", *options, *(figure or [])]
    raise typer.Exit(subprocess.run(command, env={**os.environ, "PYTHONPATH": path}).returncode)
