# SPDX-License-Identifier: MIT
"""Hashes of the results of every class of run, so that a change that should keep the results provably does.

    python tests/gate/hashes.py            # compare with hashes.json, exit 1 where one differs
    python tests/gate/hashes.py --write    # record them: only with a decision that says why, in CHANGELOG.md
    python tests/gate/hashes.py several lost

The hashes are of one machine and one set of package versions (`made_with` in hashes.json): numpy and OpenCV render
the input, and their vectorised functions differ in the last bit from processor to processor.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # for experiments, which is not installed

import picture_runs
import shape_runs
import tracking_runs

from experiments.data import root
from experiments.record import machine

KEPT = Path(__file__).with_name("hashes.json")
ROOMS = (tracking_runs, shape_runs, picture_runs)
PACKAGES = ("numpy", "opencv-python-headless", "scikit-image", "trimesh")


def instructions() -> str:
    """A digest of what the processor can do: numpy, OpenCV and BLAS choose their functions by it, not by its name."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    flags = next((line for line in lines if line.startswith(("flags", "Features"))), "")
    chosen = [*sorted(flags.split()), os.environ.get("OPENBLAS_CORETYPE", "")]
    return hashlib.sha256(" ".join(chosen).encode()).hexdigest()[:12]


def made_with() -> dict[str, str]:
    """What the bits depend on beside the code."""
    return {
        "processor": machine()["cpu"],
        "instructions": instructions(),
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }


def runs() -> dict[str, Callable[[], dict[str, str]]]:
    """Every run that is possible here, by name."""
    out: dict[str, Callable[[], dict[str, str]]] = {f.__name__: f for room in ROOMS for f in room.SYNTHETIC}
    data = root()
    if data.is_dir():
        for room in ROOMS:
            out.update({f.__name__: (lambda f=f: f(data)) for f in room.RECORDED})
    return out


def differences(kept: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """What differs, as "run: output"."""
    return [
        f"{run}: {name}"
        for run, hashes in now.items()
        for name in sorted({*hashes, *kept.get(run, {})})
        if kept.get(run, {}).get(name) != hashes.get(name)
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", nargs="*", help="only these")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--file", type=Path, default=KEPT)
    given = parser.parse_args()
    now = {}
    for name, run in runs().items():
        if given.run and name not in given.run:
            continue
        begin = time.perf_counter()
        now[name] = run()
        print(f"{name:20} {len(now[name]):3} hashes {time.perf_counter() - begin:6.1f} s", flush=True)
    kept = json.loads(given.file.read_text()) if given.file.is_file() else {"hashes": {}}
    if given.write:
        everything = {"made_with": made_with(), "hashes": {**kept["hashes"], **now}}
        given.file.write_text(json.dumps(everything, indent=1) + "\n")
        return 0
    differ = differences(kept["hashes"], now)
    print(*(f"DIFFERS {line}" for line in differ), f"{len(differ)} differences", sep="\n")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
