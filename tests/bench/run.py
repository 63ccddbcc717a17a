# SPDX-License-Identifier: MIT
"""Run the benchmarks beside this file: ``python tests/bench/run.py [--only TEXT]``."""

import argparse
import importlib
import os
import sys

import harness

import sdftrack as st


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="run the benchmarks whose name contains this text")
    parser.add_argument("--list", action="store_true", help="print the names and stop")
    arguments = parser.parse_args()

    chosen = [bench for bench in harness.all_benchmarks() if arguments.only in bench.name]
    if not chosen:
        print(f"no benchmark has {arguments.only!r} in its name; see --list", file=sys.stderr)
        return 1
    if arguments.list:
        print(*[bench.name for bench in chosen], sep="\n")
        return 0

    machine, load = importlib.import_module("experiments.record").machine(), os.getloadavg()[0]
    print(f"{machine['cpu']}, {machine['cores']} cores, load {load:.1f}, sdftrack {st.__version__}")
    print(f"{'benchmark':40} {'median':>10} {'quartiles':>21} {'runs':>5}  per item")
    for bench in chosen:
        print(harness.measure(bench), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
