# SPDX-License-Identifier: MIT
"""A Dask cluster, and tasks on it, each until it has an outcome; a Python function over many items."""

from __future__ import annotations

import contextlib
import re
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar, cast

from sdftrack import _core
from sdftrack._internal.extras import need
from sdftrack._internal.validation import whole

Connect = Callable[[float], Any]  # a connected distributed.Client; waits for a scheduler so many seconds
CONNECT_S = 10.0  # of one try to reach a scheduler
PATIENCE_S = 300.0  # until a scheduler that has gone is given up
RESULT_S = 60.0  # to fetch a result that is there
MEMORY_SHARE = 0.9  # of the machine's, for all workers together
WINDOW = 1000  # tasks that the scheduler holds at once: a million of them would fill its memory
ADDRESS = re.compile(r"^(?:[a-z][a-z0-9+.-]*://)?[^\s:/]+:\d{1,5}$")
LOCAL = {
    "distributed.scheduler.allowed-failures": 0,  # deaths are counted for each task alone
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.admin.tick.limit": "60s",
}


class Died(RuntimeError):
    """The worker of a task died, each time that it was tried."""


class _Lost(Exception):
    """The connection to the scheduler."""


@dataclass(frozen=True)
class Task:
    """A call of a function: a unique name, the argument (pickled), and what a worker must offer, as Dask names it."""

    name: str
    argument: Any
    resources: dict[str, float] = field(default_factory=dict)


@contextlib.contextmanager
def cluster(
    scheduler: str | None, jobs: int = 0, *, memory_bytes: int | None = None, threads: int = 1
) -> Iterator[Connect]:
    """What connects to the workers: those of a Dask scheduler, or processes of this machine that end with the context.
    `jobs` is the number of these processes, 0: as many as cores, memory and threads of a task allow."""
    distributed, dask = need("distributed", "batch"), need("dask", "batch")
    if scheduler is not None:
        if not ADDRESS.match(scheduler):
            raise ValueError(f"scheduler: expected an address such as tcp://node1:8786, got {scheduler!r}")
        yield lambda patience_s: _reached(distributed, scheduler, patience_s)
        return
    with dask.config.set(LOCAL):
        # One thread each: a task's log and its interrupts belong to a process.
        local = distributed.LocalCluster(
            n_workers=workers_for(jobs, memory_bytes, threads), threads_per_worker=1, processes=True,
            silence_logs=50, dashboard_address="127.0.0.1:0",  # without a host the network could reach it
        )  # fmt: skip
    with local:
        yield lambda patience_s: distributed.Client(local)


def workers_for(jobs: int, memory_bytes: int | None, threads: int) -> int:
    count = whole(jobs, "jobs", 0, 10_000) or max(1, _core.thread_count(0) // _core.thread_count(threads))
    # Of the machine, or of the control group that this process may use; 0: not known.
    total = int(need("distributed.system", "batch").MEMORY_LIMIT or 0)
    if memory_bytes is None or not total:
        return count
    room = int(MEMORY_SHARE * total // memory_bytes)
    if room < 1:
        raise ValueError(
            f"memory_gb: expected at most {MEMORY_SHARE * total / 1e9:.1f} on this machine, got {memory_bytes / 1e9:g}"
        )
    return min(count, room)


def _reached(distributed: Any, address: str, patience_s: float) -> Any:
    """A client of the scheduler; waits for one that has gone to come back."""
    end = time.monotonic() + patience_s
    while True:
        try:
            return distributed.Client(address, timeout=CONNECT_S)
        except (OSError, TimeoutError) as error:
            if time.monotonic() >= end:
                after = f" within {patience_s:.0f} s" if patience_s else ""
                told = f"scheduler: cannot reach {address}{after}; is `dask scheduler` running there?"
                raise ConnectionError(told) from error
            time.sleep(1.0)


def outcomes(
    connect: Connect, function: Callable[[Any], Any], tasks: Iterable[Task], *, retries: int = 3
) -> Iterator[tuple[Task, Any]]:
    """(task, outcome) as they end: what the function returned, the exception that it raised, or `Died`. A task whose
    worker died is repeated up to `retries` times; a function that raised is not called again. If the scheduler is lost,
    what had no outcome is submitted anew: the function may run twice."""
    left, deaths, patience_s = {task.name: task for task in tasks}, Counter[str](), 0.0
    while left:
        client = connect(patience_s)
        patience_s = PATIENCE_S
        try:
            _check_resources(client, left.values())
            for task, outcome in _run(client, function, left.values(), deaths, retries):
                yield left.pop(task.name), outcome
        except _Lost:
            continue
        finally:
            with contextlib.suppress(Exception):  # of a scheduler that has gone
                client.close(timeout=2)


def _run(
    client: Any, function: Any, tasks: Iterable[Task], deaths: Counter[str], retries: int
) -> Iterator[tuple[Task, Any]]:
    distributed = need("distributed", "batch")
    ready, running = deque(tasks), dict[str, Task]()
    ended = distributed.as_completed(loop=client.loop)
    while ready or running:
        while ready and len(running) < WINDOW:
            task = ready[0]
            key = f"{task.name}-{uuid.uuid4().hex}"  # of its own: Dask remembers the outcome of a key
            about = {"key": key, "pure": False, "resources": task.resources or None}
            try:
                ended.add(client.submit(function, task.argument, **about))
            except Exception as error:
                if client.status in ("running", "connecting"):
                    raise
                raise _Lost from error
            running[key] = ready.popleft()
        future = next(ended)
        outcome = _outcome(distributed, future)
        task = running.pop(future.key)
        if isinstance(outcome, distributed.KilledWorker):
            deaths[task.name] += 1
            if deaths[task.name] <= retries:
                ready.appendleft(task)
                continue
            outcome = Died(f"its worker died ({deaths[task.name]} times): out of memory, or a crash")
        yield task, outcome


def _outcome(distributed: Any, future: Any) -> Any:
    if future.status in ("cancelled", "lost"):
        raise _Lost
    try:
        error = future.exception(timeout=RESULT_S)
        return error if error is not None else future.result(timeout=RESULT_S)
    except (distributed.CancelledError, distributed.TimeoutError, OSError) as error:
        raise _Lost from error


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


T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class Outcome(Generic[R]):
    """Of one call: what the function returned, None if it raised or its worker died; and that error, or None."""

    value: R | None
    error: Exception | None = None


def map(
    function: Callable[[T], R],
    items: Iterable[T],
    *,
    scheduler: str | None = None,
    jobs: int = 0,
    retries: int = 3,
    progress: Callable[[int, int], object] | None = None,
) -> list[Outcome[R]]:
    """Call `function` for each item in other processes, or on a cluster, and collect what comes back.

    Sequences, frames, trackers, results and shapes can be sent to another process and back. A script that calls this
    needs ``if __name__ == "__main__":`` around it, since each worker imports it.

    Parameters
    ----------
    function : callable
        Of one argument; defined at the top of a module that the workers can import. It may be called twice for an item
        whose worker died.
    items : iterable
        For example sequences or their paths.
    scheduler : str, optional
        Address of a Dask scheduler; None: processes on this machine, which end with the call.
    jobs : int
        Number of these processes; 0: one for each core.
    retries : int
        How often an item is tried again after its worker died. An exception is not repeated.
    progress : callable, optional
        Called with (done, total).

    Returns
    -------
    list of Outcome
        In the order of the items. ImportError without the extra "batch", ConnectionError without that scheduler.
    """
    if not callable(function):
        raise TypeError(f"function: expected a function, got {type(function).__name__}")
    whole(jobs, "jobs", 0, 10_000)
    retries = whole(retries, "retries", 0, 1000)
    tasks = [Task(f"item-{i}", item) for i, item in enumerate(items)]
    out: dict[str, Outcome[R]] = {}
    if not tasks:
        return []
    with cluster(scheduler, min(jobs, len(tasks)) if jobs else 0) as connect:
        for task, result in outcomes(connect, function, tasks, retries=retries):
            failed = isinstance(result, BaseException)
            out[task.name] = Outcome(None, cast(Exception, result)) if failed else Outcome(result)
            if progress is not None:
                progress(len(out), len(tasks))
    return [out[task.name] for task in tasks]
