# SPDX-License-Identifier: MIT
"""A Python function over many items."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar, cast

from sdftrack._internal.validation import whole
from sdftrack.batch.cluster import Task, cluster, outcomes

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class Outcome(Generic[R]):
    """Of one call.

    Attributes
    ----------
    value
        What the function returned; None if it raised, or its worker died.
    error : Exception or None
    """

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
        In the order of the items.

    Raises
    ------
    ImportError
        The extra "batch" is not installed.
    ConnectionError
        No scheduler at that address.
    """
    if not callable(function):
        raise TypeError(f"function: expected a function, got {type(function).__name__}")
    given = list(items)
    whole(jobs, "jobs", 0, 10_000)
    retries = whole(retries, "retries", 0, 1000)
    tasks = [Task(f"item-{i}", item) for i, item in enumerate(given)]
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
