# SPDX-License-Identifier: MIT
"""Fuzz the readers and the bindings: ``python tests/fuzz/run.py --cases 1000000 --targets all --jobs 2 --seed 7``.

``--replay TARGET:SEED`` runs one case in this process, with the traceback of what it raises. ``--json FILE`` writes the
table and all findings.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import fuzz_arrays
import fuzz_datasets
import fuzz_objects
import fuzz_readers
import fuzz_saved
from fuzz_batches import Score, run_batches
from fuzz_targets import Target, outcome_of, rng_of

TARGETS: dict[str, Target] = {
    target.name: target
    for module in (fuzz_readers, fuzz_saved, fuzz_datasets, fuzz_arrays, fuzz_objects)
    for target in module.TARGETS
    if all(find_spec(name) is not None for name in target.needs)
}
BATCH = 1000  # cases of a process


def plan(names: Sequence[str], cases: int, seed: int) -> list[tuple[str, int, int]]:
    """(target, first seed, count) of all processes; the cases of run `seed` are from 10^9 times it on."""
    total = sum(TARGETS[name].weight for name in names)
    made = []
    for name in names:
        count = max(1, round(cases * TARGETS[name].weight / total))
        first = seed * 10**9
        made += [(name, first + at, min(BATCH, count - at)) for at in range(0, count, BATCH)]
    return sorted(made, key=lambda one: one[1])  # the first of each target, then the second: a run may be cut


def replay(target: Target, seed: int, plain: bool = False) -> tuple[str, str]:
    """Outcome of one case in this process; `plain`: what it raises is not caught."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        case = target.make(Path(folder))
        if plain:
            case(rng_of(target.name, seed))
        return outcome_of(target, case, seed)


def table(scores: Sequence[Score]) -> str:
    """The rows of all targets and their sum, as Markdown."""
    whole = Score("all")
    for score in scores:
        whole.add(score)
    rows = [score.row() for score in (*scores, whole)]
    heads = list(rows[0])
    cells = [heads, ["-" * len(head) for head in heads], *([str(row[h]) for h in heads] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=20_000, help="of all targets together")
    parser.add_argument("--targets", default="all", help="names, with commas between, or all")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--minutes", type=float, help="begin no process after these")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--replay", metavar="TARGET:SEED")
    given = parser.parse_args()
    if given.replay:
        name, _, seed = given.replay.partition(":")
        print(*replay(TARGETS[name], int(seed), plain=True))
        return 0
    names = list(TARGETS) if given.targets == "all" else given.targets.split(",")
    until = None if given.minutes is None else time.time() + 60 * given.minutes
    started = time.monotonic()
    scores = list(run_batches(plan(names, given.cases, given.seed), given.jobs, until_s=until).values())
    print(table(scores))
    print(f"{time.monotonic() - started:.0f} s on {given.jobs} processes, seed {given.seed}")
    for score in scores:
        for f in score.findings:
            print(f"{f.kind:8} {score.target}:{f.seed}  {f.message[:300]}")
    if given.json is not None:
        found = [
            {"target": s.target, "seed": f.seed, "kind": f.kind, "message": f.message}
            for s in scores
            for f in s.findings
        ]
        content = {"seed": given.seed, "rows": [s.row() for s in scores], "findings": found}
        given.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 1 if any(score.findings for score in scores) else 0


if __name__ == "__main__":
    sys.exit(main())
