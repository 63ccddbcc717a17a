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
from sdftrack.batch.journal import FAILED, JOURNAL, Journal, write_items, write_summary
from sdftrack.batch.plan import Commands, Item
from sdftrack.batch.task import PART, Call, Result, call, late_reason, log_of, read_record
from sdftrack.io.out_folder import lock_folder, refuse_folder


@dataclass
class Running:
    """The calls of a plan, and the folder of the batch. `job`: the options of the command; `tell`: called with (done,
    total, failures); `tell_page`: with the address of Dask's own page."""

    items: list[Item]
    out: Path
    job: Any
    commands: Commands
    tell: Callable[[int, int, int], None]
    tell_page: Callable[[str], None]

    def run(self) -> tuple[dict[str, dict[str, Any]], list[str]]:
        """Run what has no result yet; returns the last event of each item, and the names of the summary's files."""
        out, items = self.out, self.items
        if not (out / JOURNAL).is_file():
            refuse_folder(out, self.job.overwrite)
        out.mkdir(parents=True, exist_ok=True)
        lock_folder(out)  # until the end of the command
        if self.job.overwrite:
            earlier = [out / item.name for item in items if read_record(out / item.name) is not None]
            (out / JOURNAL).unlink(missing_ok=True)
            for folder in earlier:
                shutil.rmtree(folder, ignore_errors=True)
        with contextlib.closing(Journal(out, items)) as journal:
            self._adopt(journal)
            write_items(out, items)
            if left := self._left(journal):
                self._run(left, journal)
        return journal.ended, write_summary(out, items, journal.ended)

    def _adopt(self, journal: Journal) -> None:
        for job in {item.job for item in self.items}:
            for part in (self.out / job).rglob(f".*{PART}"):
                shutil.rmtree(part, ignore_errors=True)
        for item in self.items:
            there = read_record(self.out / item.name)
            if there is None and journal.succeeded(item.name):
                del journal.ended[item.name]  # its folder was removed: to be done again
            elif there is not None and not journal.succeeded(item.name):
                journal.check(item, there.digest)
                journal.add(item, there)

    def _left(self, journal: Journal) -> list[Item]:
        """What is to be done; what was skipped only if its predecessor may have results now."""
        open_ = (None, *(FAILED if self.job.again else ("skipped",)))
        left: dict[str, Item] = {}
        for item in self.items:
            status = journal.status(item.name)
            ready = item.after is None or item.after in left or journal.succeeded(item.after)
            if status in open_ and (ready or status is None):
                left[item.name] = item
        return list(left.values())

    def _run(self, left: list[Item], journal: Journal) -> None:
        """One job of the plan after the other: a later one may take results of an earlier."""
        for item in left:
            log_of(self.out, item.name).unlink(missing_ok=True)
        done = failures = 0

        def note(item: Item, result: Result) -> None:
            nonlocal done, failures
            journal.add(item, result)
            done, failures = done + 1, failures + (result.status in FAILED)
            self.tell(done, len(left), failures)

        jobs = min(self.job.jobs, len(left)) if self.job.jobs else 0
        memory = int(1e9 * max(item.memory_gb or 0.0 for item in left)) or None
        threads = max(item.threads for item in left)
        linked: set[str] = set()
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it would tell is in the outcomes
        with cluster(self.job.scheduler, jobs, memory_bytes=memory, threads=threads) as connect:

            def connected(patience_s: float) -> Any:
                client = connect(patience_s)
                if client.dashboard_link not in linked and find_spec("bokeh"):
                    linked.add(client.dashboard_link)
                    self.tell_page(client.dashboard_link)
                return client

            for _, stage in itertools.groupby(left, lambda item: item.job):
                tasks = {}
                for item in stage:
                    if item.after is None or journal.succeeded(item.after):
                        tasks[item.name] = item
                    else:
                        note(item, Result("skipped", f"{item.after} has no results"))
                calls = [self._task(item) for item in tasks.values()]
                for task, outcome in outcomes(connected, call, calls, retries=self.job.retries):
                    if not isinstance(outcome, Result):  # an error, or the end of its process
                        late = late_reason(log_of(self.out, task.name))
                        outcome = Result("refused", late) if late else Result("died", reason_of(outcome))
                    note(tasks[task.name], outcome)

    def _task(self, item: Item) -> Task:
        cache, resources = self.job.cache, {"MEMORY": 1e9 * (item.memory_gb or 0), "GPU": item.gpus}
        what = Call(self.commands.run, item, self.out, None if cache is None else cache.resolve())
        if self.job.scheduler is None:  # on this machine the number of processes sees to it
            return Task(item.name, what)
        return Task(item.name, what, {name: amount for name, amount in resources.items() if amount})
