# SPDX-License-Identifier: MIT
"""The work of a batch: calls to workers, outcomes to the journal, a summary at the end."""

from __future__ import annotations

import contextlib
import itertools
import logging
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sdftrack._internal.text_files import reason_of
from sdftrack.batch.cluster import Task, cluster, outcomes
from sdftrack.batch.journal import FAILED, JOURNAL, SUCCEEDED, Journal, write_items
from sdftrack.batch.plan import Commands, Item
from sdftrack.batch.summary import summary_rows, write_summary
from sdftrack.batch.task import PART, Call, Result, call, late_reason, read_record
from sdftrack.io.folder_lock import lock_folder
from sdftrack.io.out_folder import refuse_folder


@dataclass(frozen=True)
class Running:
    """How the calls are run: the options of the command.

    `tell`: called with (done, total, failures); `tell_page`: with the address of Dask's own page.
    """

    scheduler: str | None
    jobs: int
    retries: int
    again: bool
    overwrite: bool
    cache: Path | None
    tell: Callable[[int, int, int], None]
    tell_page: Callable[[str], None]


def run_items(
    items: list[Item], out: Path, how: Running, commands: Commands
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Run what has no result yet; returns the last event of each item, and the names of the summary's files."""
    if not (out / JOURNAL).is_file():
        refuse_folder(out, how.overwrite)
    out.mkdir(parents=True, exist_ok=True)
    lock = lock_folder(out)
    with contextlib.ExitStack() as stack:
        if lock is not None:
            stack.callback(lock.release)
        if how.overwrite:
            earlier = [out / item.name for item in items if read_record(out / item.name) is not None]
            (out / JOURNAL).unlink(missing_ok=True)
            for folder in earlier:
                shutil.rmtree(folder, ignore_errors=True)
        journal = Journal(out, items)
        with contextlib.closing(journal):
            _adopt(items, out, journal)
            write_items(out, items)
            _run(items, out, journal, how, commands)
        return journal.ended, write_summary(out, summary_rows(out, items, journal.ended))


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


def _run(items: list[Item], out: Path, journal: Journal, how: Running, commands: Commands) -> None:
    """Run what has no result yet, one job of the plan after the other: a later one may take results of an earlier."""
    left = _left(items, journal, how.again)
    for item in left:
        log_of(out, item.name).unlink(missing_ok=True)
    if not left:
        return
    jobs = min(how.jobs, len(left)) if how.jobs else 0
    memory = max(item.memory_gb or 0.0 for item in left)
    threads = max(item.threads for item in left)
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it would tell is in the outcomes
    workers = cluster(how.scheduler, jobs, memory_bytes=int(1e9 * memory) or None, threads=threads)
    with workers as connect:
        done = failures = 0

        def note(item: Item, result: Result) -> None:
            nonlocal done, failures
            journal.add(item, result)
            done, failures = done + 1, failures + (result.status in FAILED)
            how.tell(done, len(left), failures)

        linked: set[str] = set()

        def connected(patience_s: float) -> Any:
            client = connect(patience_s)
            if client.dashboard_link not in linked and find_spec("bokeh"):
                linked.add(client.dashboard_link)
                how.tell_page(client.dashboard_link)
            return client

        for _, stage in itertools.groupby(left, lambda item: item.job):
            tasks = {}
            for item in stage:
                if item.after is None or _has_results(item.after, journal):
                    tasks[item.name] = item
                else:
                    note(item, Result("skipped", f"{item.after} has no results"))
            calls = [_task(item, out, how, commands) for item in tasks.values()]
            for task, outcome in outcomes(connected, call, calls, retries=how.retries):
                note(tasks[task.name], _result(outcome, log_of(out, task.name)))


def _result(outcome: Any, log: Path) -> Result:
    """Of a call that returned one, raised an error, or whose process ended."""
    if isinstance(outcome, Result):
        return outcome
    late = late_reason(log)
    return Result("refused", late) if late else Result("died", reason_of(outcome))


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


def _task(item: Item, out: Path, how: Running, commands: Commands) -> Task:
    inputs = [item.source]
    if item.after is not None:
        results = str(out / item.after)
        inputs = [results, item.source] if item.command == "evaluate" else [results]
    what = Call(
        run=commands.run,
        command=[item.command, *inputs],
        words=item.words,
        files=item.files,
        digest=item.digest,
        folder=str(out / item.name),
        log=str(log_of(out, item.name)),
        cache=None if how.cache is None else str(how.cache.resolve()),
        timeout_s=item.timeout_s,
    )
    resources: dict[str, float] = {}
    if how.scheduler is not None:  # on this machine the number of processes sees to it
        resources = {k: v for k, v in (("MEMORY", 1e9 * (item.memory_gb or 0)), ("GPU", item.gpus)) if v}
    return Task(item.name, what, resources)


def log_of(out: Path, name: str) -> Path:
    return out / "logs" / f"{name}.log"
