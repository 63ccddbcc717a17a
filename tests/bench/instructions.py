# SPDX-License-Identifier: MIT
"""Count the instructions of the sum over pixels: a number that a busy machine cannot move.

    python tests/bench/instructions.py BUILD/tests/cpp/sdftrack_reduction [--record]

Runs the benchmark's program under callgrind and compares the instructions per pixel with those in instructions.json;
exit status 1 where one has grown by more than 5 %. `--record` writes the counts of now in their place. Needs valgrind,
which knows no AVX-512: AVX2 and the baseline are counted. The counts belong to the compiler named in the file.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

RECORD = Path(__file__).with_name("instructions.json")
POINTS, ROUNDS = 2048, 20  # of sdftrack_reduction
LIMIT = 1.05
LOOPS = ("linearize", "cost")
CASES = [(mode, isa) for mode in ("depth", "rgbd") for isa in ("avx2", "baseline")]


def count(program: Path, mode: str, isa: str, loop: str) -> float:
    """Instructions per pixel of one loop."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            "valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out",
            f"--toggle-collect=*Loops<*::{loop}(*", str(program), str(POINTS), mode, isa,
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr[-2000:]}")
    collected = re.search(r"Collected : (\d+)", done.stderr)
    if collected is None or int(collected[1]) == 0:
        raise RuntimeError(f"callgrind collected nothing in {loop}; was the program stripped?")
    return int(collected[1]) / POINTS / ROUNDS


def compiler(program: Path) -> str:
    """Of the program, as it says itself."""
    text = subprocess.run(
        ["readelf", "-p", ".comment", str(program)], capture_output=True, text=True, check=False
    )
    found = re.search(r"GCC: \(.*?\) (\d+)\.", text.stdout)
    return f"GCC {found[1]}" if found else "unknown"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=Path)
    parser.add_argument("--record", action="store_true")
    a = parser.parse_args()
    if shutil.which("valgrind") is None:
        print("valgrind is not installed: nothing was counted", file=sys.stderr)
        return 2
    known = json.loads(RECORD.read_text()) if RECORD.is_file() else {"compiler": "", "per_pixel": {}}
    now, grown = {}, []
    for mode, isa in CASES:
        for loop in LOOPS:
            name = f"{mode}/{isa}/{loop}"
            now[name] = round(count(a.program, mode, isa, loop), 1)
            before = known["per_pixel"].get(name)
            change = f"{100 * (now[name] / before - 1):+.1f} %" if before else "new"
            print(f"{name:26} {now[name]:8.1f} instructions per pixel  {change}", flush=True)
            if before and now[name] > LIMIT * before:
                grown.append(name)
    if a.record:
        RECORD.write_text(json.dumps({"compiler": compiler(a.program), "per_pixel": now}, indent=1) + "\n")
        return 0
    if known["compiler"] != compiler(a.program):
        print(
            f"recorded with {known['compiler']}, counted with {compiler(a.program)}: not compared",
            file=sys.stderr,
        )
        return 2
    if grown:
        print(f"more than 5 % more instructions: {', '.join(grown)}", file=sys.stderr)
    return 1 if grown else 0


if __name__ == "__main__":
    sys.exit(main())
