# SPDX-License-Identifier: MIT
"""Run the benchmarks beside this file: ``python tests/bench/run.py [--only TEXT] [--out bench.json]``."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

import harness

import sdftrack as st


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="run the benchmarks whose name contains this text")
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    parser.add_argument("--list", action="store_true", help="print the names and stop")
    arguments = parser.parse_args()

    sys.path.append(str(Path(__file__).resolve().parents[2]))  # some take the settings of an experiment
    for path in sorted(Path(__file__).parent.glob("bench_*.py")):
        importlib.import_module(path.stem)
    chosen = [bench for bench in harness.REGISTERED if arguments.only in bench.name]
    if not chosen:
        print(f"no benchmark has {arguments.only!r} in its name; see --list", file=sys.stderr)
        return 1
    if arguments.list:
        print(*[bench.name for bench in chosen], sep="\n")
        return 0

    machine = harness.machine()
    print(
        f"{machine['cpu']}, {machine['cores']} cores, load {machine['load']:.1f}, sdftrack {st.__version__}"
    )
    print(f"{'benchmark':40} {'median':>10} {'quartiles':>21} {'runs':>5}  per item")
    figures = []
    for bench in chosen:
        figure = harness.measure(bench)
        figures.append(figure)
        lower, upper = figure["quartiles_s"]
        print(
            f"{bench.name:40} {1e3 * figure['median_s']:8.3f}ms {1e3 * lower:9.3f}..{1e3 * upper:8.3f}ms "
            f"{figure['runs']:5d}  {figure['median_ns_per_item']:.1f} ns/{bench.unit}",
            flush=True,
        )
    if arguments.out:
        text = json.dumps({"version": st.__version__, "machine": machine, "figures": figures}, indent=1)
        part = arguments.out.with_name(arguments.out.name + ".part")
        part.write_text(text + "\n")
        os.replace(part, arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
