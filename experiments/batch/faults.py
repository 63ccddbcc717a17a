# SPDX-License-Identifier: MIT
"""A batch whose workers, scheduler and own process are killed: is every recording done once, with the same results?"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from experiments.batch.recordings import command, make_recordings, quiet, same_results, tables
from experiments.registry import experiment
from experiments.table import Table
from sdftrack.batch.journal import read_journal

WORKERS = 2
GIVE_UP_S = 3600.0


@experiment(
    "batch_faults",
    chosen_on="nothing was chosen",
    reported_on="1,000 rendered recordings of three images",
    short={"recordings": 6, "kill_every_s": 4.0},
)
def batch_faults(*, recordings: int = 1000, kill_every_s: float = 20.0, seed: int = 0) -> list[Table]:
    """Short recordings tracked by two workers, without faults and while processes are killed.

    The first run has no faults. In the second a random worker is killed (SIGKILL) every 20 s. In the third the same
    happens on a cluster of its own whose scheduler is killed once and started again, and in the fourth the batch itself
    is killed and started again.
    """
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plan = make_recordings(folder, recordings)
        reference = folder / "none"
        for label, run in (
            ("none", _undisturbed),
            ("workers", _workers_killed),
            ("workers and the scheduler", _scheduler_killed),
            ("the batch itself", _batch_killed),
        ):
            out = folder / label.replace(" ", "_")
            began = time.monotonic()
            kills = run(plan, out, recordings, kill_every_s, random.Random(seed))
            seconds = time.monotonic() - began
            summary, results, done = tables(out)
            work = sum(row["seconds"] for row in read_journal(out).values())
            overhead = 1e3 * (seconds * WORKERS - work) / recordings
            rows.append(
                [
                    label, str(kills), str(recordings), str(results), str(done),
                    "yes" if summary == tables(reference)[0] else "no", str(same_results(reference, out)),
                    f"{seconds:.0f}", f"{work:.0f}", f"{overhead:.0f}",
                ]
            )  # fmt: skip
    columns = [
        "killed", "kills", "recordings", "results", "in the journal", "same summary", "different poses", "wall s",
        "work s", "overhead ms",
    ]  # fmt: skip
    return [Table("A batch whose processes are killed", columns, rows)]


def _undisturbed(plan: Path, out: Path, recordings: int, every_s: float, rng: random.Random) -> int:
    _wait(quiet(command(plan, out, "--jobs", str(WORKERS))))
    return 0


def _workers_killed(plan: Path, out: Path, recordings: int, every_s: float, rng: random.Random) -> int:
    batch = quiet(command(plan, out, "--jobs", str(WORKERS), "--retries", "20"))
    with _killing(lambda: _workers_of(batch.pid), out, every_s, rng) as kills:
        _wait(batch)
    return len(kills)


def _scheduler_killed(plan: Path, out: Path, recordings: int, every_s: float, rng: random.Random) -> int:
    port = _free_port()
    with contextlib.ExitStack() as stack:
        scheduler = stack.enter_context(
            _kept_alive(_dask("scheduler", "--port", str(port), "--no-dashboard"))
        )
        workers = [
            stack.enter_context(
                _kept_alive(_dask("worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-dashboard"))
            )
            for _ in range(WORKERS)
        ]
        line = command(plan, out, "--scheduler", f"tcp://127.0.0.1:{port}", "--retries", "20")
        batch = _started_when_reached(line, port)
        with _killing(lambda: [pid for w in workers for pid in _workers_of(w())], out, every_s, rng) as kills:
            while len(read_journal(out)) < 0.3 * recordings and batch.poll() is None:
                time.sleep(0.2)
            os.kill(scheduler(), signal.SIGKILL)
            _wait(batch)
        return len(kills) + 1


def _batch_killed(plan: Path, out: Path, recordings: int, every_s: float, rng: random.Random) -> int:
    kills = before = 0
    batch = quiet(command(plan, out, "--jobs", str(WORKERS)))
    while True:
        try:
            batch.wait(timeout=every_s)
            return kills
        except subprocess.TimeoutExpired:
            if (done := len(read_journal(out))) > before:
                before, kills = done, kills + 1
                batch.kill()
                batch.wait()
                batch = quiet(command(plan, out, "--jobs", str(WORKERS)))


def _wait(process: subprocess.Popen[bytes]) -> None:
    if process.wait(timeout=GIVE_UP_S):
        raise RuntimeError(f"expected that the batch succeeds, got exit code {process.returncode}")


@contextlib.contextmanager
def _killing(
    pids: Callable[[], list[int]], out: Path, every_s: float, rng: random.Random
) -> Iterator[list[int]]:
    """Kill a random one of `pids` every so often, in a thread; on a slow machine not before another recording is
    done, or nothing would ever be."""
    killed: list[int] = []
    end = threading.Event()

    def run() -> None:
        before = 0
        while not end.wait(every_s):
            there, done = pids(), len(read_journal(out))
            if there and done > before:
                before = done
                pid = rng.choice(there)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                    killed.append(pid)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield killed
    finally:
        end.set()
        thread.join()


@contextlib.contextmanager
def _kept_alive(line: list[str]) -> Iterator[Callable[[], int]]:
    """A program that is started again when it ends, as a service manager does; yields its process number."""
    end = threading.Event()
    process = [quiet(line)]

    def run() -> None:
        while not end.is_set():
            process[0].wait()
            if not end.wait(0.5):
                process[0] = quiet(line)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield lambda: process[0].pid
    finally:
        end.set()
        process[0].terminate()
        thread.join(timeout=10)


def _dask(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "distributed.cli.dask_" + arguments[0], *arguments[1:]]


def _started_when_reached(line: list[str], port: int) -> subprocess.Popen[bytes]:
    for _ in range(300):
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1):
            break
        time.sleep(0.1)
    return quiet(line)


def _workers_of(pid: int) -> list[int]:
    """Processes below `pid` that run tasks."""
    found, queue = [], [pid]
    while queue:
        with contextlib.suppress(OSError):
            parent = queue.pop()
            # Each thread has its own children.
            lists = Path(f"/proc/{parent}/task").glob("*/children")
            for child in (int(text) for path in lists for text in path.read_text(encoding="ascii").split()):
                queue.append(child)
                if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                    found.append(child)
    return found


def _free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])
