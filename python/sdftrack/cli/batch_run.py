# SPDX-License-Identifier: MIT
"""The work of ``sdftrack batch``: calls to workers, outcomes to the journal, a table at the end."""

from __future__ import annotations

import contextlib
import logging
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from sdftrack._internal.text_files import reason_of
from sdftrack.batch.cluster import cluster
from sdftrack.batch.scheduling import Task, outcomes
from sdftrack.cli.batch_files import JOURNAL, Journal, counts, read_items, read_journal, write_items
from sdftrack.cli.batch_plan import Item
from sdftrack.cli.batch_summary import summary_rows, write_summary
from sdftrack.cli.batch_task import PART, TIMED_OUT, Call, Result, call, read_record
from sdftrack.cli.common import show_table
from sdftrack.cli.progress import progress_counter
from sdftrack.io.folder_lock import lock_folder
from sdftrack.io.out_folder import refuse_folder

__all__ = ["Running", "run_items", "show_plan", "show_status"]

SHOWN, SHOWN_CALLS = 10, 1000  # failures at the end, calls of a plan
SUCCEEDED = ("done", "lost")
FAILED = ("refused", "died", "skipped")


@dataclass(frozen=True)
class Running:
    """How the calls are run: the options of the command."""

    scheduler: str | None
    jobs: int
    retries: int
    again: bool
    overwrite: bool
    cache: Path | None
    quiet: bool


def run_items(items: list[Item], out: Path, settings: Running) -> int:
    """Run what has no result yet; returns the number of failures."""
    out = out.resolve()
    _refuse_folder(out, settings.overwrite)
    out.mkdir(parents=True, exist_ok=True)
    with _held(out):
        if settings.overwrite:
            _remove(items, out)
        journal = Journal(out, items)
        try:
            _adopt(items, out, journal)
            write_items(out, items)
            left = _left(items, journal, settings.again)
            if left:
                _run(left, out, journal, settings)
        finally:
            journal.close()
        names = write_summary(out, summary_rows(out, items, journal.ended))
    if not settings.quiet:
        _show([item.name for item in items], journal.ended, out)
        print(f"written to {out}: {', '.join(names)}")
    return sum(journal.status(item) in FAILED for item in items)


def _left(items: list[Item], journal: Journal, again: bool) -> list[Item]:
    """What is to be done; items whose predecessor has failed for good are noted as skipped."""
    by_name = {item.name: item for item in items}
    left: dict[str, Item] = {}
    for item in items:
        if journal.status(item) not in (None, "skipped", *(FAILED if again else ())):
            continue
        if item.after is None or item.after in left or journal.status(by_name[item.after]) in SUCCEEDED:
            left[item.name] = item
        elif journal.status(item) is None:
            journal.add(item, _skipped(item.after))
    return list(left.values())


def _skipped(after: str) -> Result:
    return Result("skipped", f"{after} has no results")


def _refuse_folder(out: Path, overwrite: bool) -> None:
    """FileExistsError if the folder holds files, and not those of a batch."""
    if not (out / JOURNAL).is_file():
        refuse_folder(out, overwrite)


def _remove(items: list[Item], out: Path) -> None:
    """Results of earlier runs."""
    (out / JOURNAL).unlink(missing_ok=True)
    for item in items:
        shutil.rmtree(out / item.name, ignore_errors=True)


@contextlib.contextmanager
def _held(out: Path) -> Iterator[None]:
    lock = lock_folder(out)
    try:
        yield
    finally:
        if lock is not None:
            lock.release()


def _adopt(items: list[Item], out: Path, journal: Journal) -> None:
    """Results that were finished when an earlier run ended without noting them; and what it left unfinished."""
    for job in {item.job for item in items}:
        for part in (out / job).rglob(f".*{PART}"):
            shutil.rmtree(part, ignore_errors=True)
    for item in items:
        there = read_record(out / item.name)
        if there is None and journal.status(item) in SUCCEEDED:
            journal.forget(item)  # its folder was removed: to be done again
        elif there is not None and journal.status(item) not in SUCCEEDED:
            journal.check(item, there.digest)
            journal.add(item, there)


def _run(left: list[Item], out: Path, journal: Journal, settings: Running) -> None:
    by_name = {item.name: item for item in left}
    tasks = [_task(item, out, settings, by_name) for item in left]
    memory = max((item.memory_gb or 0.0 for item in left), default=0.0)
    threads = max(item.threads for item in left)
    jobs, quiet = min(settings.jobs, len(left)) if settings.jobs else 0, settings.quiet
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it would tell is in the outcomes
    workers = cluster(settings.scheduler, jobs, memory_bytes=int(1e9 * memory) or None, threads=threads)
    with workers as connect, progress_counter(quiet) as tell:
        linked: list[str] = []

        def connected() -> Any:
            client = connect()
            if not quiet and client.dashboard_link not in linked and find_spec("bokeh"):
                linked.append(client.dashboard_link)
                print(f"dashboard: {client.dashboard_link}")
            return client

        failures = 0
        ended = outcomes(
            connected,
            call,
            tasks,
            retries=settings.retries,
            may_help=lambda task: _reason_of_death(out, task.name) is None,
            succeeded=lambda outcome: isinstance(outcome, Result) and outcome.status in SUCCEEDED,
        )
        for number, (task, outcome) in enumerate(ended, 1):
            result = _result(outcome, out, task)
            journal.add(by_name[task.name], result)
            failures += result.status in FAILED
            tell(number, len(left), "batch", f"{failures} failed" if failures else "")


def _task(item: Item, out: Path, settings: Running, left: Mapping[str, Item]) -> Task:
    inputs = [item.source]
    if item.after is not None:
        results = str(out / item.after)
        inputs = [results, item.source] if item.command == "evaluate" else [results]
    what = Call(
        command=[item.command, *inputs],
        words=item.options,
        files=item.files,
        digest=item.digest,
        folder=str(out / item.name),
        log=str(_log(out, item.name)),
        cache=None if settings.cache is None else str(settings.cache.resolve()),
        timeout_s=item.timeout_s,
    )
    resources: dict[str, float] = {}
    if settings.scheduler is not None:  # on this machine the number of processes sees to it
        resources = {k: v for k, v in (("MEMORY", 1e9 * (item.memory_gb or 0)), ("GPU", item.gpus)) if v}
    after = item.after if item.after in left else None
    return Task(item.name, what, after, resources)


def _log(out: Path, name: str) -> Path:
    return out / "logs" / f"{name}.log"


def _result(outcome: Any, out: Path, task: Task) -> Result:
    if outcome is None:
        assert task.after is not None
        return _skipped(task.after)
    if isinstance(outcome, Result):
        return outcome
    told = _reason_of_death(out, task.name) or reason_of(outcome)
    return Result("refused" if told.startswith(TIMED_OUT) else "died", told)


def _reason_of_death(out: Path, name: str) -> str | None:
    """The last line of a log if it says why the process ended itself."""
    with contextlib.suppress(OSError):
        lines = _log(out, name).read_text(encoding="utf-8", errors="replace").split()
        text = " ".join(lines)
        at = text.rfind(TIMED_OUT)
        return text[at:] if at >= 0 else None
    return None


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
        number = counts(own, ended)
        seconds = [float(ended[n]["seconds"]) for n in own if n in ended and ended[n]["status"] in SUCCEEDED]
        mean = f"{sum(seconds) / len(seconds):.2f}" if seconds else ""
        rows.append((job, *(str(number[c]) for c in columns), mean))
    show_table(str(out), ("job", *columns, "mean s"), rows)
    failed = [n for n in names if ended.get(n, {}).get("status") in FAILED]
    for name in failed[:SHOWN]:
        log = f" (log: {_log(out, name)})" if _log(out, name).is_file() else ""
        print(f"{name}: {ended[name]['status']}: {ended[name]['reason']}{log}")
    if len(failed) > SHOWN:
        print(f"... and {len(failed) - SHOWN} more: see summary.csv")
