# SPDX-License-Identifier: MIT
"""``python -m experiments figures``: figures and tables of the thesis beside the printed values, a folder each."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from experiments.thesis import FIGURES, Context, find
from sdftrack import __version__
from sdftrack._internal.files import write_json
from sdftrack.cli.common import show_table, tracker_settings
from sdftrack.cli.progress import progress_counter
from sdftrack.mesh import UNITS
from sdftrack.recorder import prepare_folder

__all__ = ["main"]


def main(arguments: Sequence[str]) -> int:
    """Entry of the command; the exit code: 0, 1 for an error, 2 for wrong usage."""
    parser = _parser()
    asked = parser.parse_args(arguments)
    if asked.list:
        for f in FIGURES.values():
            print(f"{f.id:6s} {f.title}")
        return 0
    try:
        wanted = [find(name) for name in asked.figure] or list(FIGURES.values())
    except ValueError as error:
        parser.error(str(error))
    try:
        for f in wanted:
            _make(f.id, asked)
    except (OSError, ValueError, TypeError, ImportError, RuntimeError) as error:
        print(f"sdftrack: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m experiments figures", description=__doc__)
    parser.add_argument("figure", nargs="*", metavar="FIGURE", help="ids, see --list; none: all")
    parser.add_argument("--list", action="store_true", help="list the available figures")
    parser.add_argument(
        "--mesh", type=Path, metavar="M.ply", help="mesh to use instead of the built-in shape"
    )
    parser.add_argument("--unit", choices=UNITS, help="of the mesh")
    parser.add_argument(
        "--frames", type=int, metavar="N", help="number of frames, e.g. fewer for a quick test"
    )
    parser.add_argument("--out", type=Path, default=Path("sdftrack-reproduce"), metavar="DIR")
    parser.add_argument("--overwrite", action="store_true", help="allow a folder to contain files")
    parser.add_argument("--config", type=Path, metavar="FILE.toml", help="options of the tracker")
    parser.add_argument("--device", default="auto", help="device for the computation")
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="0: all cores")
    parser.add_argument("--quiet", "-q", action="store_true", help="print only errors")
    return parser


def _make(name: str, asked: argparse.Namespace) -> None:
    """One figure: result.json, table.txt, figure.png in a folder of its name."""
    f, folder = find(name), asked.out / name
    options = {**tracker_settings(asked.config), "device": asked.device, "threads": asked.threads}
    prepare_folder(folder, asked.overwrite)
    with progress_counter(asked.quiet) as step:
        made = f.run(Context(folder, asked.mesh, asked.frames, options, step, asked.unit))
    write_json(folder / "result.json", {"version": __version__, "figure": f.id, **made})
    if not asked.quiet:
        show_table(made["title"], made["head"], made["rows"])
        for line in made.get("notes", []):
            print(line)
        print(f"written to {folder}")
