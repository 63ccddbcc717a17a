# SPDX-License-Identifier: MIT
"""One call of a command on a worker, into a hidden folder that gets its name when the results are whole."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

__all__ = ["PART", "RECORD", "TIMED_OUT", "Call", "Result", "call", "read_record"]

RECORD = ".batch.json"  # in each folder of results
PART = ".part"
LOST = 3  # exit code: objects lost in all frames, which is a result
ERROR = "sdftrack: error: "
TIMED_OUT = "timed out after"


@dataclass(frozen=True)
class Call:
    """What a worker needs to know; paths are whole.

    Attributes
    ----------
    command : list of str
        Name of the command and its inputs, paths or addresses.
    words : list of str
        Options.
    files : tuple of int
        Which of these are addresses.
    digest : str
    folder, log : str
    cache : str or None
        Folder for copies of what lies at addresses.
    timeout_s : float or None
    """

    command: list[str]
    words: list[str]
    files: tuple[int, ...]
    digest: str
    folder: str
    log: str
    cache: str | None = None
    timeout_s: float | None = None


@dataclass(frozen=True)
class Result:
    """How it ended.

    Attributes
    ----------
    status : "done", "lost", "refused"
    reason : str
    seconds : float
        Of the command.
    digest : str
        Of the call that wrote results which were there already.
    """

    status: str
    reason: str = ""
    seconds: float = 0.0
    digest: str = ""


def call(what: Call) -> Result:
    """Run the command unless its results are there."""
    folder = Path(what.folder)
    there = read_record(folder)
    if there is not None:
        return there
    folder.parent.mkdir(parents=True, exist_ok=True)
    part = folder.parent / f".{folder.name}.{uuid.uuid4().hex[:8]}{PART}"
    began = time.monotonic()
    try:
        code, reason = _run(what, part)
        result = Result(
            {0: "done", LOST: "lost"}.get(code, "refused"), reason, round(time.monotonic() - began, 3)
        )
        if result.status == "refused":
            return result
        return _placed(part, folder, what, result)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def read_record(folder: Path) -> Result | None:
    """How the call that wrote a folder ended; None if there is no such folder.

    Raises
    ------
    ValueError
        A folder that no batch has written.
    """
    if not folder.exists():
        return None
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        return Result(record["status"], record["reason"], record["seconds"], record["digest"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{folder}: expected results of an earlier batch, got another folder; move it away ({error})"
        ) from None


def _placed(part: Path, folder: Path, what: Call, result: Result) -> Result:
    """Give the finished folder its name, which only the first one gets."""
    record = {
        "digest": what.digest,
        "status": result.status,
        "reason": result.reason,
        "seconds": result.seconds,
    }
    part.mkdir(exist_ok=True)
    (part / RECORD).write_text(json.dumps(record), encoding="utf-8")
    try:
        os.rename(part, folder)
    except OSError:
        there = read_record(folder)
        if there is None:
            raise
        return there
    return result


def _run(what: Call, part: Path) -> tuple[int, str]:
    """Exit code and the last error of the command; its output goes to the log."""
    from sdftrack.batch.addresses import fetched

    cache = None if what.cache is None else Path(what.cache)
    Path(what.log).parent.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as stack:
        log = stack.enter_context(Path(what.log).open("w", encoding="utf-8", errors="replace"))
        try:
            name, *inputs = what.command
            paths = [str(stack.enter_context(fetched(place, cache))) for place in inputs]
            words = list(what.words)
            for i in what.files:
                words[i] = str(stack.enter_context(fetched(words[i], cache)))
        except (OSError, ValueError, ImportError) as error:
            print(f"{ERROR}{error}", file=log)
            return 1, str(error)
        stack.enter_context(_time_limit(what.timeout_s, what.log))
        line = [name, *paths, *words, "--out", str(part)]
        code = _in_this_process(line, log) if _alone() else _in_another_process(line, log)
    return code, _last_error(Path(what.log)) if code else ""


def _alone() -> bool:
    """Whether nothing else runs in this process: its standard output and warnings belong to the task."""
    with contextlib.suppress(ImportError, ValueError):
        from distributed import get_worker

        return int(get_worker().state.nthreads) == 1
    return True


def _in_this_process(line: list[str], log: TextIO) -> int:
    from sdftrack.cli.command_line import run_line

    with contextlib.redirect_stdout(log), contextlib.redirect_stderr(log):
        return run_line(line)


def _in_another_process(line: list[str], log: TextIO) -> int:
    log.flush()
    command = [sys.executable, "-m", "sdftrack", *line]
    return subprocess.run(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL, check=False).returncode


@contextlib.contextmanager
def _time_limit(seconds: float | None, log: str) -> Iterator[None]:
    """End this process if the task takes longer: a call that hangs in the core cannot be interrupted."""

    def end() -> None:
        with open(log, "a", encoding="utf-8") as file:
            file.write(f"\n{ERROR}{TIMED_OUT} {seconds:g} s\n")
        os._exit(1)

    if seconds is None:
        yield
        return
    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _last_error(log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    told = [line for line in lines if line.startswith("sdftrack: ")]
    return told[-1].removeprefix(ERROR).removeprefix("sdftrack: ") if told else (lines[-1] if lines else "")
