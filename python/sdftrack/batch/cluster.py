# SPDX-License-Identifier: MIT
"""A Dask cluster: processes on this machine, or one that is there already."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Callable, Iterator
from typing import Any

from sdftrack import _core
from sdftrack._internal.extras import need
from sdftrack._internal.validation import whole

__all__ = ["Connect", "cluster", "workers_for"]

Connect = Callable[[], Any]  # a connected distributed.Client, each time it is called
CONNECT_S = 10.0  # of one try to reach a scheduler
PATIENCE_S = 300.0  # until a scheduler that has gone is given up
MEMORY_SHARE = 0.9  # of the machine's, for all workers together
ADDRESS = re.compile(r"^(?:[a-z][a-z0-9+.-]*://)?[^\s:/]+:\d{1,5}$")


@contextlib.contextmanager
def cluster(
    scheduler: str | None, jobs: int = 0, *, memory_bytes: int | None = None, threads: int = 1
) -> Iterator[Connect]:
    """What connects to the workers; workers on this machine end with the context.

    Parameters
    ----------
    scheduler : str or None
        Address of a running Dask scheduler; None: worker processes on this machine.
    jobs : int
        Number of these processes; 0: as many as the cores, and the memory that each needs, allow.
    memory_bytes, threads
        Memory and threads that a task needs.
    """
    distributed = need("distributed", "batch")
    if scheduler is None:
        count = workers_for(jobs, memory_bytes, threads)
        with _local(distributed, count) as local:
            yield lambda: distributed.Client(local)
        return
    if not ADDRESS.match(scheduler):
        raise ValueError(f"scheduler: expected an address such as tcp://node1:8786, got {scheduler!r}")
    known = False  # whether it was ever reached

    def connect() -> Any:
        nonlocal known
        client = _reached(distributed, scheduler, PATIENCE_S if known else 0.0)
        known = True
        return client

    yield connect


def workers_for(jobs: int, memory_bytes: int | None, threads: int) -> int:
    """Number of workers on this machine."""
    count = whole(jobs, "jobs", 0, 10_000) or max(1, _core.thread_count(0) // _core.thread_count(threads))
    total = _memory()
    if memory_bytes is None or total is None:
        return count
    room = int(MEMORY_SHARE * total // memory_bytes)
    if room < 1:
        raise ValueError(
            f"memory_gb: expected at most {MEMORY_SHARE * total / 1e9:.1f} on this machine, got {memory_bytes / 1e9:g}"
        )
    return min(count, room)


def _memory() -> int | None:
    """Bytes of memory of this machine, or of the control group that this process may use; None: not known."""
    system = need("distributed.system", "batch")
    return int(system.MEMORY_LIMIT) or None


def _local(distributed: Any, count: int) -> Any:
    """Workers with one thread each: a task's log and its interrupts belong to a process."""
    dask = need("dask", "batch")
    with dask.config.set(
        {
            # Deaths are counted by the caller, for each task alone.
            "distributed.scheduler.allowed-failures": 0,
            "distributed.scheduler.worker-saturation": 1.0,
            "distributed.admin.tick.limit": "60s",
        }
    ):
        return distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            dashboard_address=":0",
            silence_logs=50,
        )


def _reached(distributed: Any, address: str, patience_s: float) -> Any:
    """A client of the scheduler; waits for one that has gone to come back."""
    end = time.monotonic() + patience_s
    while True:
        try:
            return distributed.Client(address, timeout=CONNECT_S)
        except (OSError, TimeoutError) as error:
            if time.monotonic() < end:
                time.sleep(1.0)
                continue
            after = f" within {patience_s:.0f} s" if patience_s else ""
            raise ConnectionError(
                f"scheduler: cannot reach {address}{after}; is `dask scheduler` running there?"
            ) from error
