# SPDX-License-Identifier: MIT
"""Hashes of the results of every class of run, so that a change that should keep the results provably does.

    python tests/gate/hashes.py            # compare with hashes.json, exit 1 where one differs
    python tests/gate/hashes.py --write    # record them: only with a decision, which the commit message explains
    python tests/gate/hashes.py several lost

The hashes are of one machine and one set of package versions (`made_with` in hashes.json): numpy and OpenCV render
the input, and their vectorised functions differ in the last bit from processor to processor. On any other machine
`compare.py` builds two commits and compares those.
"""

import argparse
import functools
import hashlib
import importlib
import json
import os
import platform
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from listing import data_folder, listed

sys.path.append(str(Path(__file__).resolve().parents[2]))  # for scenes of experiments, which is not installed

KEPT = Path(__file__).with_name("hashes.json")
PACKAGES = ("numpy", "opencv-python-headless", "scikit-image", "trimesh")


def made_with() -> dict[str, str]:
    """What the bits depend on beside the code."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []

    def of_processor(*keys: str) -> str:
        return next((line.partition(":")[2].strip() for line in lines if line.startswith(keys)), "")

    # numpy, OpenCV and BLAS choose their functions by what a processor can do, not by its name.
    chosen = [*sorted(of_processor("flags", "Features").split()), os.environ.get("OPENBLAS_CORETYPE", "")]
    return {
        "processor": of_processor("model name") or platform.processor() or platform.machine(),
        "instructions": hashlib.sha256(" ".join(chosen).encode()).hexdigest()[:12],
        "python": platform.python_version(),
        **{name: version(name) for name in PACKAGES},
    }


def elsewhere(kept: dict[str, Any]) -> str:
    """Why recorded hashes do not apply here, "" if they do."""
    here = made_with()
    other = [f"{name} {here.get(name)} (recorded: {was})" for name, was in kept["made_with"].items()
             if here.get(name) != was]  # fmt: skip
    return ", ".join(other)


def runs() -> dict[str, Callable[[], dict[str, str]]]:
    """Every run that is possible here, by name."""
    out = {}
    for name, file in listed().items():
        module = importlib.import_module(file)
        run = getattr(module, name)
        out[name] = functools.partial(run, data_folder()) if run in module.RECORDED else run
    return out


def differences(kept: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """What differs, as "run: output"."""
    return [
        f"{run}: {name}"
        for run, hashes in now.items()
        for name in sorted({*hashes, *kept.get(run, {})})
        if kept.get(run, {}).get(name) != hashes.get(name)
    ]


def lines(names: list[str]) -> None:
    """Runs with the package of PYTHONPATH: a line of JSON for each, also for one that fails."""
    # An editable installation would be found before PYTHONPATH.
    sys.meta_path[:] = [finder for finder in sys.meta_path if "Redirecting" not in type(finder).__name__]
    wanted, found = Path(os.environ["PYTHONPATH"].split(os.pathsep)[0]), importlib.import_module("sdftrack")
    if not Path(found.__path__[0]).is_relative_to(wanted):
        sys.exit(f"expected the package of {wanted}, got {found.__path__[0]}")
    for name in names:
        begin = time.perf_counter()
        try:
            hashes = runs()[name]()
        except Exception as error:
            hashes = {"failed": f"{type(error).__name__}: {error}".splitlines()[0]}
        seconds = time.perf_counter() - begin
        print(json.dumps({"run": name, "hashes": hashes, "seconds": seconds}), flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", nargs="*", help="only these")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--applies", action="store_true", help="only say why they do not apply here, if so")
    parser.add_argument("--lines", action="store_true", help="for compare.py: hashes by lines, not compared")
    given = parser.parse_args()
    if given.lines:
        lines(given.run)
        return 0
    kept = json.loads(KEPT.read_text())
    why = "" if given.write else elsewhere(kept)
    if given.applies or why:
        print(
            f"the recorded hashes do not apply here: {why}; use tests/gate/compare.py" if why else "", end=""
        )
        return 0 if given.applies else 1
    now = {}
    for name, run in runs().items():
        if given.run and name not in given.run:
            continue
        begin = time.perf_counter()
        now[name] = run()
        print(f"{name:20} {len(now[name]):3} hashes {time.perf_counter() - begin:6.1f} s", flush=True)
    if given.write:
        everything = {"made_with": made_with(), "hashes": {**kept["hashes"], **now}}
        KEPT.write_text(json.dumps(everything, indent=1) + "\n")
        return 0
    differ = differences(kept["hashes"], now)
    print(*(f"DIFFERS {line}" for line in differ), f"{len(differ)} differences", sep="\n")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
