# SPDX-License-Identifier: MIT
"""Batches of cases in processes of their own: one that dies or hangs is a finding, and its other cases go on."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HANG_S = 25.0
START_S = 120.0  # to import and make the seeds
POLL_S = 0.05
CHILD = Path(__file__).resolve().parent / "fuzz_child.py"
CRASH, HANG = "crash", "hang"


@dataclass
class Finding:
    seed: int
    kind: str
    message: str


@dataclass
class Score:
    """Outcomes of one target."""

    target: str
    counts: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0
    findings: list[Finding] = field(default_factory=list)

    @property
    def cases(self) -> int:
        return sum(self.counts.values())

    def add(self, other: Score) -> None:
        self.counts += other.counts
        self.seconds += other.seconds
        self.findings += other.findings

    def row(self) -> dict[str, object]:
        rate = self.cases / self.seconds if self.seconds else 0.0
        return {
            "target": self.target, "cases": self.cases, "refused": self.counts["refused"],
            "accepted": self.counts["accepted"], "crashes": self.counts[CRASH], "hangs": self.counts[HANG],
            "unclear errors": self.counts["unclear"] + self.counts["error"], "cases/s": round(rate, 1),
        }  # fmt: skip


def run_batches(
    plan: Sequence[tuple[str, int, int]], jobs: int, most_findings: int = 200, until_s: float | None = None
) -> dict[str, Score]:
    """Run (target, first seed, count) batches; scores by target, in the order of the plan."""
    scores = {name: Score(name) for name, _, _ in plan}
    with ThreadPoolExecutor(jobs) as pool:
        for score in pool.map(lambda batch: _batch(*batch, until_s=until_s), plan):
            scores[score.target].add(score)
            del scores[score.target].findings[most_findings:]
    return scores


def _batch(target: str, first: int, count: int, until_s: float | None) -> Score:
    score, end = Score(target), first + count
    while first < end and not (until_s is not None and time.time() > until_s):
        first = _process(target, first, end - first, score)
    return score


def _process(target: str, first: int, count: int, score: Score) -> int:
    """Run until the end or a finding that ends the process; the seed to go on with."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name)
        with (folder / "stderr").open("wb") as errors:
            child = subprocess.Popen(
                [sys.executable, str(CHILD), target, str(first), str(count), name],
                stdout=errors, stderr=errors, env={**os.environ, "PYTHONHASHSEED": "0"},
            )  # fmt: skip
            hung = _wait(child, folder)
        lines = _lines(folder)
        done = [line for line in lines if "outcome" in line]
        for line in done:
            score.counts[line["outcome"]] += 1
            score.seconds += line["seconds"]
            if line["outcome"] in ("unclear", "error"):
                score.findings.append(Finding(line["seed"], line["outcome"], line["message"]))
        if len(done) == count:
            return first + count
        told = (folder / "stderr").read_text(errors="replace")[-800:]
        if not lines:
            raise RuntimeError(f"{target}: the process did not begin (code {child.returncode}): {told}")
        kind, at = HANG if hung else CRASH, first + len(done)
        score.counts[kind] += 1
        score.seconds += HANG_S if hung else 0.0
        score.findings.append(Finding(at, kind, f"code {child.returncode}: {told}"))
        return at + 1


def _wait(child: subprocess.Popen[bytes], folder: Path) -> bool:
    """Wait for the end; True if it had to be killed because a case did not end."""
    last, since = 0, time.monotonic()
    while child.poll() is None:
        time.sleep(POLL_S)
        length = len(_lines(folder))
        if length != last:
            last, since = length, time.monotonic()
        elif time.monotonic() - since > (HANG_S if length else START_S):
            child.kill()
            child.wait()
            return True
    return False


def _lines(folder: Path) -> list[dict[str, Any]]:
    """What the process has told: each case as it begins, and its outcome."""
    path = folder / "outcomes"
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text().split("\n") if line.endswith("}")]
