# SPDX-License-Identifier: MIT
"""``python -m experiments list | run NAME [options] | run --short NAME | figures [ID] | stale | again``."""

from __future__ import annotations

import argparse
import inspect
import os
import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments import data, figures, progress, record
from experiments.again import again
from experiments.options import add_options
from experiments.registry import Experiment, UnknownExperimentError, all_experiments, find
from experiments.sources import digests, stale
from experiments.table import Table
from experiments.targets import judge
from sdftrack.viz.plots import save_figure


def main(given: Sequence[str] | None = None) -> int:
    """Entry of the command; the exit code: 0, 1 for an error, 2 for wrong usage."""
    arguments = list(sys.argv[1:] if given is None else given)
    parser = argparse.ArgumentParser(
        prog="python -m experiments", description="Measure what the documents claim."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    listing = commands.add_parser("list", help="names, what they need, and the data they were chosen on")
    listing.add_argument("--long", action="store_true", help="also the data of each")
    running = commands.add_parser("run", help="run one; NAME --help prints its options", add_help=False)
    running.add_argument(
        "--short", action="store_true", help="seconds, not minutes; the result is not recorded"
    )
    running.add_argument("name", nargs="?", help="as `list` prints it")
    commands.add_parser("figures", help="figures and tables of the thesis; --help for more", add_help=False)
    aging = commands.add_parser("stale", help="records that do not rest on today's code, and why")
    aging.add_argument("--check", action="store_true", help="exit code 1 if there are any")
    renewing = commands.add_parser("again", help="measure stale records again, with their settings")
    renewing.add_argument("names", nargs="*", metavar="NAME", help="only these, stale or not")
    if arguments[:1] == ["figures"]:
        return figures.main(arguments[1:])
    asked, rest = parser.parse_known_args(arguments)
    if asked.command == "list":
        if rest:
            listing.error(f"unrecognized arguments: {' '.join(rest)}")
        print(listed(asked.long))
        return 0
    if asked.command == "stale":
        old = stale()
        for name, changed in old.items():
            print(f"{name:28s} {', '.join(changed)}")
        print(f"{len(old)} of {len(record.names())} records are stale")
        return int(asked.check and bool(old))
    if asked.command == "again":
        return renew(asked.names)
    if asked.name is None or asked.name.startswith("-"):
        running.print_help()
        return 0 if {"-h", "--help"} & set(rest) else 2
    try:
        run(find(asked.name), rest, asked.short)
    except UnknownExperimentError as error:
        print(error, file=sys.stderr)
        return 2
    except (OSError, ValueError, ImportError) as error:
        print(f"{asked.name}: {error}" if not str(error).startswith(asked.name) else error, file=sys.stderr)
        return 1
    return 0


def listed(details: bool = False) -> str:
    """A line for each experiment; with `details` also its needs and data."""
    lines = []
    for e in all_experiments().values():
        lines.append(f"{e.name:24s} {e.summary}")
        if details:
            needs = ", ".join([*e.needs, *(f"{use} (optional)" for use in e.uses)]) or "nothing"
            lines += [f"    needs        {needs}", f"    chosen on    {e.chosen_on}"]
            lines += [f"    reported on  {e.reported_on}"]
    return "\n".join(lines)


def run(chosen: Experiment, arguments: Sequence[str], short: bool = False) -> list[Table]:
    """Run an experiment with command line `arguments`; print its tables and verdicts, and record them."""
    parser = argparse.ArgumentParser(
        prog=f"python -m experiments run {chosen.name}",
        description=inspect.cleandoc(chosen.function.__doc__ or "").split("\n\nParameters")[0],
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--data", type=Path, metavar="PATH", help="data folder (default: SDFTRACK_DATA)")
    parser.add_argument(
        "--out", type=Path, metavar="PATH", help="folder for the record, NAME.json, and pictures"
    )
    add_options(parser, chosen.function)
    if short:
        parser.set_defaults(**chosen.short)
    settings = vars(parser.parse_args(arguments))
    folder, out = data.root(settings.pop("data")), settings.pop("out")
    tables, seconds = measured(chosen, settings, folder, quiet=short)
    for verdict in [] if short else judge(chosen.name, tables):
        print(verdict)
    if out is not None or not short:
        path = _record(chosen, settings, tables, seconds, **({} if out is None else {"folder": out}))
        if out is not None:
            _draw(tables, path)
    return tables


def measured(
    chosen: Experiment, settings: Mapping[str, Any], folder: Path, quiet: bool = False
) -> tuple[list[Table], float]:
    """Tables of an experiment, which are printed, and the seconds that it took."""
    data.check(chosen.name, chosen.needs, folder)
    chosen.check_frames(settings.get("frames"))
    given = {"data": folder} if "data" in inspect.signature(chosen.function).parameters else {}
    began = time.perf_counter()
    with warnings.catch_warnings(), progress.shown(quiet=quiet):
        warnings.simplefilter("ignore")
        made = chosen.function(**given, **settings)
    seconds = time.perf_counter() - began
    tables = [made] if isinstance(made, Table) else made
    print("\n\n".join(map(str, tables)))
    return tables, seconds


def renew(names: Sequence[str]) -> int:
    """Measure records again; 1 if one could not be."""
    failed = False

    def measure(chosen: Experiment, settings: Mapping[str, Any], instead_of: Mapping[str, Any]) -> None:
        tables, seconds = measured(chosen, settings, data.root())
        _record(chosen, settings, tables, seconds, instead_of=instead_of)

    for name in names or stale():
        try:
            again(find(name), measure, lambda said: print(said, file=sys.stderr))
        except (OSError, ValueError, ImportError) as error:
            print(f"{name}: {error}", file=sys.stderr)
            failed = True
    return int(failed)


def _record(
    chosen: Experiment, settings: Mapping[str, Any], tables: Sequence[Table], seconds: float, **told: Any
) -> Path:
    plain = [table.to_dict() for table in tables]
    path = record.save(chosen.name, settings, plain, seconds, sources=digests(chosen), **told)
    print(f"recorded: {path}")
    return path


def _draw(tables: Sequence[Table], path: Path) -> None:
    """Save the pictures of the tables that have one beside the record."""
    for table in tables:
        if table.picture is not None:
            name = "" if len(tables) == 1 else f"-{record.table_id(table.title)}"
            save_figure(table.picture(), path.with_name(f"{path.stem}{name}.png"))


if __name__ == "__main__":
    try:
        raise SystemExit(main())
    except BrokenPipeError:  # `... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
