# SPDX-License-Identifier: MIT
"""Commands in processes of their own, in which something goes wrong at the n-th change of a folder.

A change is that Python opens a file for writing, or makes, renames or removes one. The processes are forked by a server
that has loaded what commands load and has no threads.
"""

import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

LOADED = [
    "fault_runs", "typer", "pydantic.main", "PIL.PngImagePlugin", "cv2", "av", "matplotlib.pyplot",
    "matplotlib.backends.backend_agg", "scipy.optimize", "scipy.spatial", "scipy.signal", "trimesh",
    "sdftrack.cli.app", "sdftrack.cli.track", "sdftrack.viz", "sdftrack.tracking", "sdftrack.motion",
    "sdftrack.evaluation", "sdftrack.reconstruction",
]  # fmt: skip
WAIT_S = 120.0
CHANGES = ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate")
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT


@dataclass(frozen=True)
class Ran:
    """How a command ended: exit code (negative: signal), what it printed on stderr, changes of the folder."""

    code: int
    told: str
    changes: int


def ran(arguments: list[str], place: Path, fault: Callable[[int], None] | None = None, at: int = 0) -> Ran:
    """Run a command; `fault` is called at the `at`-th change within `place`, or with at=0 at the start."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(LOADED)
    about = place.parent / f"{place.name}.log"
    about.mkdir(exist_ok=True)
    for name in ("told", "changes"):
        (about / name).write_text("")
    process = context.Process(target=_run, args=(arguments, place, about, fault, at))
    process.start()
    process.join(WAIT_S)
    if process.is_alive():
        process.kill()
        process.join()
        raise AssertionError(f"{arguments}: expected an end within {WAIT_S} s")
    assert process.exitcode is not None
    return Ran(process.exitcode, (about / "told").read_text(), (about / "changes").stat().st_size)


def kill(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def interrupt(_: int) -> None:
    signal.raise_signal(signal.SIGINT)


def _run(
    arguments: list[str], place: Path, about: Path, fault: Callable[[int], None] | None, at: int
) -> None:
    from sdftrack.cli.app import run

    told = os.open(about / "told", os.O_WRONLY)
    changes = os.open(about / "changes", os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(told if stream == 2 else os.open(os.devnull, os.O_WRONLY), stream)
    sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if fault is not None and at == 0:
        fault(0)
    count, inside = itertools.count(1), f"{place}{os.sep}"

    def watch(event: str, args: tuple) -> None:
        if event == "open":
            if not (isinstance(args[2], int) and args[2] & WRITES):
                return
        elif event not in CHANGES:
            return
        if isinstance(args[0], (str, os.PathLike)) and os.fspath(args[0]).startswith(inside):
            os.write(changes, b".")
            if next(count) == at and fault is not None:
                fault(at)

    sys.addaudithook(watch)
    code = run(arguments)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def stopped(
    arguments: list[str], ready: Callable[[], object], by: signal.Signals = signal.SIGINT
) -> tuple[int, str]:
    """Exit code and errors of a command that gets Ctrl-C, or another signal, as soon as something is ready."""
    command = [sys.executable, "-m", "sdftrack", *arguments]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + WAIT_S
    while not ready() and child.poll() is None and time.monotonic() < end:
        time.sleep(0.02)
    child.send_signal(by)
    return child.wait(timeout=WAIT_S), child.communicate()[1]
