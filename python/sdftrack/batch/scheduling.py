# SPDX-License-Identifier: MIT
"""Tasks on a Dask cluster, each until it has an outcome: repeated where a worker died, again after a lost scheduler."""

from __future__ import annotations

import contextlib
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from sdftrack._internal.extras import need
from sdftrack.batch.cluster import Connect

__all__ = ["Died", "Task", "outcomes"]

WINDOW = 1000  # tasks that the scheduler holds at once: a million of them would fill its memory
RESULT_S = 60.0  # to fetch a result that is there


class Died(RuntimeError):
    """The worker of a task died, each time that it was tried."""


class _Lost(Exception):
    """The connection to the scheduler."""


@dataclass(frozen=True)
class Task:
    """A call of a function.

    Attributes
    ----------
    name : str
        Unique.
    argument : object
        Of the function; pickled.
    after : str or None
        The task that must have succeeded before.
    resources : dict
        What a worker must offer, as Dask names it.
    """

    name: str
    argument: Any
    after: str | None = None
    resources: dict[str, float] = field(default_factory=dict)


def outcomes(
    connect: Connect,
    function: Callable[[Any], Any],
    tasks: Iterable[Task],
    *,
    retries: int = 3,
    may_help: Callable[[Task], bool] = lambda task: True,
    succeeded: Callable[[Any], bool] = lambda outcome: not isinstance(outcome, Exception),
) -> Iterator[tuple[Task, Any]]:
    """(task, outcome) as they end: what the function returned, the exception that it raised, or `Died`.

    A task whose worker died is repeated up to `retries` times if `may_help`; a function that raised is not called
    again. A task whose predecessor did not succeed has the outcome None.

    Parameters
    ----------
    connect
        From `cluster`. If the scheduler is lost, it is called again, and what had no outcome is submitted anew: the
        function must be one that may run twice.
    function : callable
        Importable by the workers.
    """
    run = _Run(function, tasks, retries, may_help, succeeded)
    while run.ready:
        client = connect()
        try:
            _check_resources(client, run.ready)
            yield from run.on(client)
        finally:
            with contextlib.suppress(Exception):  # of a scheduler that has gone
                client.close(timeout=2)


class _Run:
    """What is still to be done."""

    def __init__(
        self, function: Any, tasks: Iterable[Task], retries: int, may_help: Any, succeeded: Any
    ) -> None:
        self._function, self._retries, self._may_help, self._succeeded = (
            function,
            retries,
            may_help,
            succeeded,
        )
        self._distributed = need("distributed", "batch")
        self._deaths: Counter[str] = Counter()
        self._submitted = 0
        self._waiting: defaultdict[str, list[Task]] = defaultdict(list)
        self._running: dict[str, Task] = {}  # by the key of its future
        self.ready: deque[Task] = deque()
        for task in tasks:
            (self.ready if task.after is None else self._waiting[task.after]).append(task)

    def on(self, client: Any) -> Iterator[tuple[Task, Any]]:
        """Until all is done, or the scheduler is lost."""
        ended = self._distributed.as_completed(loop=client.loop)
        try:
            while self.ready or self._running:
                self._fill(client, ended)
                future = next(ended)
                outcome = self._outcome(future)
                task = self._running.pop(future.key)
                if isinstance(outcome, self._distributed.KilledWorker):
                    self._deaths[task.name] += 1
                    if self._deaths[task.name] <= self._retries and self._may_help(task):
                        self.ready.appendleft(task)
                        continue
                    outcome = Died(
                        f"its worker died ({self._deaths[task.name]} times): out of memory, or a crash"
                    )
                yield from self._ended(task, outcome)
        except _Lost:
            self.ready.extendleft(self._running.values())
            self._running.clear()

    def _fill(self, client: Any, ended: Any) -> None:
        while self.ready and len(self._running) < WINDOW:
            task = self.ready[0]
            self._submitted += 1  # a key of its own: Dask remembers the outcome of a key
            try:
                future = client.submit(
                    self._function,
                    task.argument,
                    key=f"{task.name}-{self._submitted}",
                    pure=False,
                    resources=task.resources or None,
                )
                ended.add(future)
            except Exception as error:
                if client.status in ("running", "connecting"):
                    raise
                raise _Lost from error
            self._running[future.key] = self.ready.popleft()

    def _outcome(self, future: Any) -> Any:
        """What the function returned, or the exception that there is instead."""
        if future.status in ("cancelled", "lost"):
            raise _Lost
        try:
            error = future.exception(timeout=RESULT_S)
            return error if error is not None else future.result(timeout=RESULT_S)
        except (self._distributed.CancelledError, self._distributed.TimeoutError, OSError) as error:
            raise _Lost from error

    def _ended(self, task: Task, outcome: Any) -> Iterator[tuple[Task, Any]]:
        yield task, outcome
        after = self._waiting.pop(task.name, [])
        if outcome is not None and self._succeeded(outcome):
            self.ready.extend(after)
            return
        for next_task in after:
            yield from self._ended(next_task, None)


def _check_resources(client: Any, tasks: Iterable[Task]) -> None:
    """ValueError if workers are there and none of them offers what a task needs: it would wait for ever."""
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    offered = [w.get("resources") or {} for w in workers]
    for task in tasks:
        for name, amount in task.resources.items():
            if offered and not any(o.get(name, 0) >= amount for o in offered):
                raise ValueError(
                    f"{task.name}: expected a worker with --resources {name}={amount:g}, got none on this cluster"
                )
