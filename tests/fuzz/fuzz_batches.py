# SPDX-License-Identifier: MIT
"""Batches of cases in processes of their own: one that dies or hangs is a finding, and its other cases go on."""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from fuzz_targets import outcome_of

HANG_S = 25.0
START_S = 120.0  # to import and make the seeds
MOST_BYTES = 6_000_000_000  # of address space beyond what is taken at the start: more is a MemoryError
CRASH, HANG = "crash", "hang"
PROCESSES = multiprocessing.get_context("spawn")


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
    os.environ.setdefault("PYTHONHASHSEED", "0")  # of the processes: a case is the same wherever it runs
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
        heard, told = PROCESSES.Pipe(duplex=False)
        child = PROCESSES.Process(target=work, args=(target, first, count, Path(name), told))
        child.start()
        told.close()  # where the process ends, so does what it tells
        answers, kind = _answers(heard, count)
        if kind == HANG:
            child.kill()
        child.join()
        done = len(answers) - 1  # the first one says that it is ready
        for seed, answer in enumerate(answers[1:], first):
            _count(answer, seed, score)
        if done == count:
            return first + count
        stderr = Path(name, "stderr")
        said = (
            f"code {child.exitcode}: {stderr.read_text(errors='replace')[-800:] if stderr.exists() else ''}"
        )
    if done < 0:
        raise RuntimeError(f"{target}: the process did not begin ({said})")
    score.counts[kind] += 1
    score.seconds += HANG_S if kind == HANG else 0.0
    score.findings.append(Finding(first + done, kind, said))
    return first + done + 1


def _answers(heard: Connection, count: int) -> tuple[list[Any], str]:
    """None once it is ready, then (outcome, message, seconds) of each case; how it ended where some are missing."""
    answers: list[Any] = []
    for limit_s in (START_S, *[HANG_S] * count):
        if not heard.poll(limit_s):
            return answers, HANG
        try:
            answers.append(heard.recv())
        except EOFError:
            break
    return answers, CRASH


def _count(line: tuple[str, str, float], seed: int, score: Score) -> None:
    outcome, message, seconds = line
    score.counts[outcome] += 1
    score.seconds += seconds
    if outcome in ("unclear", "error"):
        score.findings.append(Finding(seed, outcome, message))


def work(name: str, first: int, count: int, folder: Path, told: Connection) -> None:
    """The process of a batch."""
    with (folder / "stderr").open("wb") as errors:
        os.dup2(errors.fileno(), 1)
        os.dup2(errors.fileno(), 2)
    faulthandler.enable()
    from run import TARGETS

    scratch = folder / "scratch"
    scratch.mkdir()
    os.chdir(scratch)
    target = TARGETS[name]
    case = target.make(scratch)
    _limit_memory()
    told.send(None)
    for seed in range(first, first + count):
        started = time.perf_counter()
        outcome, message = outcome_of(target, case, seed)
        told.send((outcome, message[:600], time.perf_counter() - started))
    os._exit(0)  # without the ends of threads of others


def _limit_memory() -> None:
    try:
        import resource

        with open("/proc/self/statm") as file:
            taken = int(file.read().split()[0]) * resource.getpagesize()
    except (ImportError, OSError):  # elsewhere than on Linux
        return
    resource.setrlimit(resource.RLIMIT_AS, (taken + MOST_BYTES, resource.RLIM_INFINITY))
