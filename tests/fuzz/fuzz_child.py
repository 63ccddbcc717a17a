# SPDX-License-Identifier: MIT
"""The process of a batch: ``fuzz_child.py TARGET FIRST COUNT FOLDER``; tells each case before it begins."""

from __future__ import annotations

import faulthandler
import json
import os
import sys
import time
from pathlib import Path

from fuzz_targets import outcome_of
from run import TARGETS

MOST_BYTES = 6_000_000_000  # of address space beyond what is taken at the start: more is a MemoryError


def main(name: str, first: int, count: int, folder: Path) -> None:
    faulthandler.enable()
    target = TARGETS[name]
    scratch = folder / "scratch"
    scratch.mkdir()
    os.chdir(scratch)
    case = target.make(scratch)
    _limit_memory()
    with (folder / "outcomes").open(
        "w", buffering=1
    ) as outcomes:  # line by line, so that an end leaves its case
        for seed in range(first, first + count):
            outcomes.write(json.dumps({"begun": seed}) + "\n")
            started = time.perf_counter()
            outcome, message = outcome_of(target, case, seed)
            seconds = time.perf_counter() - started
            line = {"seed": seed, "outcome": outcome, "seconds": round(seconds, 3), "message": message[:600]}
            outcomes.write(json.dumps(line) + "\n")


def _limit_memory() -> None:
    try:
        import resource

        with open("/proc/self/statm") as file:
            taken = int(file.read().split()[0]) * resource.getpagesize()
    except (ImportError, OSError):  # elsewhere than on Linux
        return
    resource.setrlimit(resource.RLIMIT_AS, (taken + MOST_BYTES, resource.RLIM_INFINITY))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
    sys.stdout.flush()
    os._exit(0)  # without the ends of threads of others
