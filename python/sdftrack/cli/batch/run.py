# SPDX-License-Identifier: MIT
"""The work of ``sdftrack batch``: calls to workers, outcomes to the journal, a table at the end."""

from __future__ import annotations

import contextlib
import itertools
import logging
import shutil
from collections import Counter
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdftrack._internal.text_files import reason_of
from sdftrack.batch.cluster import Task, cluster, outcomes
from sdftrack.cli.batch.commands import Commands
from sdftrack.cli.batch.journal import (
    FAILED,
    JOURNAL,
    SUCCEEDED,
    Journal,
    read_items,
    read_journal,
    write_items,
)
from sdftrack.cli.batch.plan import Item
from sdftrack.cli.batch.summary import summary_rows, write_summary
from sdftrack.cli.batch.task import PART, Call, Result, call, read_record
from sdftrack.cli.common import show_table
from sdftrack.cli.progress import progress_counter
from sdftrack.io.folder_lock import lock_folder
from sdftrack.io.out_folder import refuse_folder

if TYPE_CHECKING:
    from sdftrack.cli.batch.command import Batch

__all__ = ["run_items", "show_plan", "show_status"]

SHOWN, SHOWN_CALLS = 10, 1000  # failures at the end, calls of a plan


def run_items(items: list[Item], job: Batch, commands: Commands) -> int:
    """Run what has no result yet; returns the number of failures."""
    out = job.folder.resolve()
    if not (out / JOURNAL).is_file():
        refuse_folder(out, job.overwrite)
    out.mkdir(parents=True, exist_ok=True)
    lock = lock_folder(out)
    with contextlib.ExitStack() as stack:
        if lock is not None:
            stack.callback(lock.release)
        if job.overwrite:
            (out / JOURNAL).unlink(missing_ok=True)
            for item in items:
                shutil.rmtree(out / item.name, ignore_errors=True)
        journal = Journal(out, items)
        with contextlib.closing(journal):
            _adopt(items, out, journal)
            write_items(out, items)
            _run(items, out, journal, job, commands)
        names = write_summary(out, summary_rows(out, items, journal.ended))
    if not job.quiet:
        _show([item.name for item in items], journal.ended, out)
        print(f"written to {out}: {', '.join(names)}")
    return sum(journal.status(item) in FAILED for item in items)


def _adopt(items: list[Item], out: Path, journal: Journal) -> None:
    """Results that were finished when an earlier run ended without noting them; and what it left unfinished."""
    for job in {item.job for item in items}:
        for part in (out / job).rglob(f".*{PART}"):
            shutil.rmtree(part, ignore_errors=True)
    for item in items:
        there = read_record(out / item.name)
        if there is None and journal.status(item) in SUCCEEDED:
            del journal.ended[item.name]  # its folder was removed: to be done again
        elif there is not None and journal.status(item) not in SUCCEEDED:
            journal.check(item, there.digest)
            journal.add(item, there)


def _run(items: list[Item], out: Path, journal: Journal, job: Batch, commands: Commands) -> None:
    """Run what has no result yet, one job of the plan after the other: a later one may take results of an earlier."""
    left = _left(items, journal, job.again)
    for item in left:
        _log(out, item.name).unlink(missing_ok=True)
    if not left:
        return
    jobs = min(job.jobs, len(left)) if job.jobs else 0
    memory = max(item.memory_gb or 0.0 for item in left)
    threads = max(item.threads for item in left)
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it would tell is in the outcomes
    workers = cluster(job.scheduler, jobs, memory_bytes=int(1e9 * memory) or None, threads=threads)
    with workers as connect, progress_counter(job.quiet) as tell:
        done = failures = 0

        def note(item: Item, result: Result) -> None:
            nonlocal done, failures
            journal.add(item, result)
            done, failures = done + 1, failures + (result.status in FAILED)
            tell(done, len(left), "batch", f"{failures} failed" if failures else "")

        linked: set[str] = set()

        def connected(patience_s: float) -> Any:
            client = connect(patience_s)
            if not job.quiet and client.dashboard_link not in linked and find_spec("bokeh"):
                linked.add(client.dashboard_link)
                print(f"dashboard: {client.dashboard_link}")
            return client

        for _, stage in itertools.groupby(left, lambda item: item.job):
            tasks = {}
            for item in stage:
                if item.after is None or _has_results(item.after, journal):
                    tasks[item.name] = item
                else:
                    note(item, Result("skipped", f"{item.after} has no results"))
            calls = [_task(item, out, job, commands) for item in tasks.values()]
            for task, outcome in outcomes(connected, call, calls, retries=job.retries):
                died = not isinstance(outcome, Result)
                note(tasks[task.name], Result("died", reason_of(outcome)) if died else outcome)


def _left(items: list[Item], journal: Journal, again: bool) -> list[Item]:
    """What is to be done; what was skipped only if its predecessor may have results now."""
    open_ = (None, *(FAILED if again else ("skipped",)))
    names: set[str] = set()
    for item in items:
        ready = item.after is None or item.after in names or _has_results(item.after, journal)
        if journal.status(item) in open_ and (ready or journal.status(item) is None):
            names.add(item.name)
    return [item for item in items if item.name in names]


def _has_results(name: str, journal: Journal) -> bool:
    return journal.ended.get(name, {}).get("status") in SUCCEEDED


def _task(item: Item, out: Path, job: Batch, commands: Commands) -> Task:
    inputs = [item.source]
    if item.after is not None:
        results = str(out / item.after)
        inputs = [results, item.source] if item.command == "evaluate" else [results]
    what = Call(
        run=commands.run,
        command=[item.command, *inputs],
        words=item.options,
        files=item.files,
        digest=item.digest,
        folder=str(out / item.name),
        log=str(_log(out, item.name)),
        cache=None if job.cache is None else str(job.cache.resolve()),
        timeout_s=item.timeout_s,
    )
    resources: dict[str, float] = {}
    if job.scheduler is not None:  # on this machine the number of processes sees to it
        resources = {k: v for k, v in (("MEMORY", 1e9 * (item.memory_gb or 0)), ("GPU", item.gpus)) if v}
    return Task(item.name, what, resources)


def _log(out: Path, name: str) -> Path:
    return out / "logs" / f"{name}.log"


def show_plan(items: list[Item]) -> None:
    """The calls that a plan stands for."""
    rows = [
        (i.name, i.command, " ".join([i.source if i.after is None else i.after, *i.options])) for i in items
    ]
    show_table(f"{len(items)} calls", ("results", "command", "inputs and options"), rows[:SHOWN_CALLS])


def show_status(out: Path, quiet: bool) -> None:
    """How far a batch is, and what failed."""
    names = read_items(out)
    if not quiet:
        _show(names, read_journal(out), out)


def _show(names: list[str], ended: Mapping[str, Mapping[str, Any]], out: Path) -> None:
    jobs: dict[str, list[str]] = {}
    for name in names:
        jobs.setdefault(name.split("/")[0], []).append(name)
    columns = ("done", "lost", "refused", "died", "skipped", "open")
    rows = []
    for job, own in jobs.items():
        counts = Counter(ended[n]["status"] if n in ended else "open" for n in own)
        seconds = [float(ended[n]["seconds"]) for n in own if n in ended and ended[n]["status"] in SUCCEEDED]
        mean = f"{sum(seconds) / len(seconds):.2f}" if seconds else ""
        rows.append((job, *(str(counts[c]) for c in columns), mean))
    show_table(str(out), ("job", *columns, "mean s"), rows)
    failed = [n for n in names if ended.get(n, {}).get("status") in FAILED]
    for name in failed[:SHOWN]:
        log = f" (log: {_log(out, name)})" if _log(out, name).is_file() else ""
        print(f"{name}: {ended[name]['status']}: {ended[name]['reason']}{log}")
    if len(failed) > SHOWN:
        print(f"... and {len(failed) - SHOWN} more: see summary.csv")
