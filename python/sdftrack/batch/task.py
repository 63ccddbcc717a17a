# SPDX-License-Identifier: MIT
"""One call of a command on a worker, into a hidden folder that gets its name when the results are whole."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from sdftrack.batch.addresses import fetched
from sdftrack.batch.plan import Item

RECORD = ".batch.json"  # in each folder of results
PART = ".part"
STATUS = {0: "done", 3: "lost"}  # by exit code: objects lost in all frames are a result
ERROR = "sdftrack: error: "
TIMED_OUT = "timed out after"


@dataclass(frozen=True)
class Call:
    """What a worker needs to know: what runs a command line, the folder of the batch, a folder for copies of files."""

    run: Callable[[list[str]], int]
    item: Item
    out: Path
    cache: Path | None = None


@dataclass(frozen=True)
class Result:
    """How it ended: "done", "lost" or "refused", why, and after how many seconds; `digest`: of the call."""

    status: str
    reason: str = ""
    seconds: float = 0.0
    digest: str = ""


def call(what: Call) -> Result:
    folder, log, digest = what.out / what.item.name, log_of(what.out, what.item.name), what.item.digest
    there = read_record(folder)
    if there is not None:
        return there
    late = late_reason(log)
    if late:
        return Result("refused", late, digest=digest)
    folder.parent.mkdir(parents=True, exist_ok=True)
    part = folder.parent / f".{folder.name}.{uuid.uuid4().hex[:8]}{PART}"
    began = time.monotonic()
    try:
        code, reason = _run(what, part, log)
        seconds = round(time.monotonic() - began, 3)
        result = Result(STATUS.get(code, "refused"), reason, seconds, digest)
        return result if result.status == "refused" else _placed(part, folder, result)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def read_record(folder: Path) -> Result | None:
    """How the call that wrote a folder ended; None if there is no such folder, ValueError if no batch wrote it."""
    if not folder.exists():
        return None
    try:
        return Result(**json.loads((folder / RECORD).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise ValueError(
            f"{folder}: expected results of an earlier batch, got another folder; move it away ({error})"
        ) from None


def _placed(part: Path, folder: Path, result: Result) -> Result:
    """Give the finished folder its name, which only the first one gets."""
    part.mkdir(exist_ok=True)
    (part / RECORD).write_text(json.dumps(asdict(result)), encoding="utf-8")
    try:
        os.rename(part, folder)
    except OSError:
        there = read_record(folder)
        if there is None:
            raise
        return there
    return result


def log_of(out: Path, name: str) -> Path:
    return out / "logs" / f"{name}.log"


def _run(what: Call, part: Path, log: Path) -> tuple[int, str]:
    """Exit code and the last error of the command; its output goes to the log."""
    # The standard output and the warnings of this process belong to the call.
    with contextlib.suppress(ImportError, ValueError):  # not on a worker
        from distributed import get_worker

        if int(get_worker().state.nthreads) > 1:
            raise RuntimeError("expected workers with one thread each: dask worker --nthreads 1")
    item = what.item
    inputs = [item.source] if item.after is None else [str(what.out / item.after)]
    if item.after is not None and item.command == "evaluate":
        inputs.append(item.source)
    log.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(log.open("w", encoding="utf-8", errors="replace"))
        stack.enter_context(contextlib.redirect_stdout(file))
        stack.enter_context(contextlib.redirect_stderr(file))
        try:
            paths = [str(stack.enter_context(fetched(place, what.cache))) for place in inputs]
            words = item.words
            for i in item.files:
                words[i] = str(stack.enter_context(fetched(words[i], what.cache)))
        except (OSError, ValueError, ImportError) as error:
            print(f"{ERROR}{error}")
            return 1, str(error)
        stack.enter_context(_time_limit(item.timeout_s, log))
        code = what.run([item.command, *paths, *words, "--out", str(part)])
    return code, _last_error(log) if code else ""


@contextlib.contextmanager
def _time_limit(seconds: float | None, log: Path) -> Iterator[None]:
    """End this process if the call takes longer: one that hangs in the core cannot be interrupted."""

    def end() -> None:
        with log.open("a", encoding="utf-8") as file:
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


def late_reason(log: Path) -> str:
    """Why an earlier try of the same run ended its process, or ""."""
    told = _last_error(log) if log.is_file() else ""
    return told if told.startswith(TIMED_OUT) else ""


def _last_error(log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    told = [line for line in lines if line.startswith("sdftrack: ")]
    return told[-1].removeprefix(ERROR).removeprefix("sdftrack: ") if told else (lines[-1] if lines else "")
