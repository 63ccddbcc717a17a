# SPDX-License-Identifier: MIT
"""``python -m experiments figures``: figures and tables of the thesis beside the printed values, a folder each."""

from __future__ import annotations

import argparse
import inspect
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments import data, progress
from experiments.registry import Experiment, all_experiments
from experiments.table import Table
from sdftrack import __version__
from sdftrack._internal.files import write_json, write_text
from sdftrack.cli.common import show_table, tracker_settings
from sdftrack.device import resolve_device
from sdftrack.io.out_folder import prepare_folder
from sdftrack.mesh import UNITS
from sdftrack.viz.plots import save_figure

PREFIX = "thesis."  # of the experiments that remake a figure or a table of the thesis


def figures() -> dict[str, Experiment]:
    """Those experiments by the numbers of their figures, in the order of the thesis."""
    found = {name.removeprefix(PREFIX): e for name, e in all_experiments().items() if name.startswith(PREFIX)}

    def place(name: str) -> tuple[str, int, str]:
        chapter, _, number = name.partition(".")
        digits = number.rstrip("ab")
        return chapter, int(digits), number[len(digits) :]

    return {name: found[name] for name in sorted(found, key=place)}


def main(arguments: Sequence[str]) -> int:
    """Entry of the command; the exit code: 0, 1 for an error, 2 for wrong usage."""
    asked = _parser().parse_args(arguments)
    known = figures()
    if asked.list:
        for name, e in known.items():
            print(f"{name:6s} {e.summary}")
        return 0
    if unknown := [name for name in asked.figure if name not in known]:
        return _fail(f"figure: expected one of {', '.join(known)}, got {unknown[0]!r} (see --list)", 2)
    try:
        for name in asked.figure or known:
            _make(name, known[name], asked)
    except (OSError, ValueError, TypeError, ImportError, RuntimeError) as error:
        return _fail(" ".join(str(error).split()), 1)
    except KeyboardInterrupt:
        return 130
    return 0


def _fail(text: str, code: int) -> int:
    print(f"sdftrack: error: {text}", file=sys.stderr)
    return code


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


def _make(name: str, e: Experiment, asked: argparse.Namespace) -> None:
    """One figure: result.json, table.txt and figure.png in a folder of its name."""
    resolve_device(asked.device)  # a GPU that is asked for and missing is an error, whatever the figure uses
    folder = asked.out / name
    prepare_folder(folder, asked.overwrite)
    with progress.shown(asked.quiet):
        (table,) = [made] if isinstance(made := e.function(**_settings(e, asked)), Table) else made
    write_text(folder / "table.txt", f"{table}\n")
    assert table.picture is not None
    save_figure(table.picture(), folder / "figure.png")
    shown = {"title": table.title, "head": table.columns, "rows": table.rows, "notes": table.notes}
    write_json(
        folder / "result.json",
        {"version": __version__, "figure": name, **shown, "levels": _valid(table.numbers)},
    )
    if not asked.quiet:
        show_table(table.title, table.columns, table.rows)
        for line in table.notes:
            print(line)
        print(f"written to {folder}")


def _valid(value: Any) -> Any:
    """The value without what JSON does not know: null where a number is none, lists of arrays."""
    if isinstance(value, Mapping):
        return {str(key): _valid(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_valid(one) for one in value]
    if hasattr(value, "tolist"):
        return _valid(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _settings(e: Experiment, asked: argparse.Namespace) -> dict[str, Any]:
    """What the experiment takes of the options of the command; fewer frames of what has none: a short run."""
    tracker = {**tracker_settings(asked.config), "device": asked.device}
    given = {"data": data.root(), "mesh": asked.mesh, "unit": asked.unit, "threads": asked.threads}
    known = inspect.signature(e.function).parameters
    if asked.frames is not None:
        given |= {"frames": asked.frames} if "frames" in known else e.short
    return {name: value for name, value in {**given, "options": tracker}.items() if name in known}
