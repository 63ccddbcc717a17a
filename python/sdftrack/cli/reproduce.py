# SPDX-License-Identifier: MIT
"""``sdftrack reproduce``: figures of the thesis, by the experiments of a source checkout."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import typer

from sdftrack.cli.common import Common, Unit
from sdftrack.cli.options import argument, option

SOURCE = "a source checkout (git clone, or the sdist: pip download --no-binary sdftrack sdftrack)"


@dataclass(frozen=True, kw_only=True)
class Reproduce(Common):
    """Reproduce figures of the thesis; all of them if none is named. Needs a source checkout."""

    figure: tuple[str, ...] = argument("Figure ids, see --list.", "FIGURE", default=())
    show_list: bool = option(False, "List the available figures.", "--list")
    mesh: Path | None = option(None, "Mesh to use instead of the built-in shape.", metavar="M.ply")
    unit: Unit | None = option(None, "Unit of the mesh.")
    frames: int | None = option(None, "Number of frames, where a figure has any.", min=2)
    short: bool = option(False, "The fewest frames that can show each claim.", "--short")


def reproduce(job: Reproduce) -> None:
    job.on_device()
    places = [Path.cwd(), *Path.cwd().parents, Path(__file__).resolve().parents[3]]
    root = next((p for p in places if (p / "experiments/figures.py").is_file()), None)
    if root is None:
        raise FileNotFoundError(f"reproduce: the experiments are not installed; run it in {SOURCE}")
    given = {
        name: getattr(job, name) for name in ("mesh", "unit", "frames", "out", "config", "device", "threads")
    }
    flags = {"list": job.show_list, "overwrite": job.overwrite, "quiet": job.quiet, "short": job.short}
    options = [f"--{name}={value}" for name, value in given.items() if value is not None]
    options += [f"--{name}" for name, value in flags.items() if value]
    path = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-m", "experiments", "figures", *options, *job.figure]
    raise typer.Exit(subprocess.run(command, env={**os.environ, "PYTHONPATH": path}).returncode)
