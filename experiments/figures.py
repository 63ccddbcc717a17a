# SPDX-License-Identifier: MIT
"""``python -m experiments figures``: figures and tables of the thesis beside the printed values, a folder each."""

from __future__ import annotations

import argparse
import inspect
import math
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments import data, progress
from experiments.registry import PREFIX, Experiment, all_experiments
from experiments.table import Table
from experiments.targets import Verdict, judge
from sdftrack import __version__
from sdftrack._internal.files import write_json, write_text
from sdftrack.cli.common import show_table, tracker_settings
from sdftrack.device import resolve_device
from sdftrack.io.out_folder import prepare_folder
from sdftrack.mesh import UNITS
from sdftrack.viz.plots import save_figure


def figures() -> dict[str, Experiment]:
    """The experiments of figures by their numbers, in their order; "table." or "section." before those of others."""
    found = {name.removeprefix(PREFIX): e for name, e in all_experiments().items() if name.startswith(PREFIX)}

    def place(name: str) -> tuple[str, int, str]:
        chapter, number = name.split(".")[-2:]
        digits = number.rstrip("ab")
        return chapter, int(digits), name

    return {name: found[name] for name in sorted(found, key=place)}


def main(arguments: Sequence[str]) -> int:
    """Entry of the command; the exit code: 0, 1 for an error, 2 for wrong usage."""
    asked = _parser().parse_args(arguments)
    known = figures()
    if asked.list:
        for name, e in known.items():
            print(f"{name:12s} {e.summary}")
        return 0
    if unknown := [name for name in asked.figure if name not in known]:
        return _fail(f"figure: expected one of {', '.join(known)}, got {unknown[0]!r} (see --list)", 2)
    chosen = {name: known[name] for name in asked.figure or known}
    try:
        for e in chosen.values():
            e.check_frames(asked.frames)
        return max(
            [_make(name, e, asked) for name, e in chosen.items() if asked.figure or _can(name, e)], default=0
        )
    except ValueError as error:
        return _fail(str(error), 2)
    except KeyboardInterrupt:
        return 130


def _can(name: str, e: Experiment) -> bool:
    """Whether the data are there; says what is missing."""
    missing = [need for need in e.needs if not data.has(need, data.root())]
    if missing:
        print(f"{name}: left out, {', '.join(missing)} not in {data.root()}")
    return not missing


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
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--frames", type=int, metavar="N", help="number of frames, where a figure has any")
    length.add_argument("--short", action="store_true", help="the fewest that can show each claim")
    parser.add_argument("--out", type=Path, default=Path("sdftrack-reproduce"), metavar="DIR")
    parser.add_argument("--overwrite", action="store_true", help="allow a folder to contain files")
    parser.add_argument("--config", type=Path, metavar="FILE.toml", help="options of the tracker")
    parser.add_argument("--device", default="auto", help="device for the computation")
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="0: all cores")
    parser.add_argument("--quiet", "-q", action="store_true", help="print only errors")
    return parser


def _make(name: str, e: Experiment, asked: argparse.Namespace) -> int:
    """One figure: the exit code."""
    try:
        verdicts = _made(name, e, asked)
    except (OSError, ValueError, TypeError, ImportError, RuntimeError) as error:
        return _fail(" ".join(str(error).split()), 1)
    unseen = [verdict for verdict in verdicts if asked.short and not verdict.rows]
    return _fail(f"{name}: the short form does not show: {unseen[0].target.figure}", 1) if unseen else 0


def _made(name: str, e: Experiment, asked: argparse.Namespace) -> list[Verdict]:
    """result.json, table.txt and figure.png in a folder of the figure's name; how its targets are met."""
    resolve_device(asked.device)  # a GPU that is asked for and missing is an error, whatever the figure uses
    data.check(name, e.needs, data.root())
    began, folder = time.perf_counter(), asked.out / name
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
    verdicts = judge(e.name, [table])
    if not asked.quiet:
        show_table(table.title, table.columns, table.rows)
        for line in (*table.notes, *verdicts):
            print(line)
        print(f"written to {folder}, {time.perf_counter() - began:.0f} s")
    return verdicts


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
    """What the experiment takes of the options of the command."""
    tracker = {**tracker_settings(asked.config), "device": asked.device}
    given = {"data": data.root(), "mesh": asked.mesh, "unit": asked.unit, "threads": asked.threads}
    known = inspect.signature(e.function).parameters
    if asked.frames is not None:
        given["frames"] = asked.frames
    if asked.short:
        given |= e.short
    return {name: value for name, value in {**given, "options": tracker}.items() if name in known}
