# SPDX-License-Identifier: MIT
"""``sdftrack batch``: commands over many recordings, on this machine or a cluster; goes on after a crash."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdftrack.cli.common import Common, show_table
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.progress import progress_counter

if TYPE_CHECKING:
    from sdftrack.batch.plan import Commands, Item

SHOWN, SHOWN_CALLS = 10, 1000  # failures at the end, calls of a plan


@dataclass(frozen=True, kw_only=True)
class Batch(Common):
    """Run the calls of a plan, each once; a second run goes on where an earlier one ended.

    The results of a call are the folder DIR/JOB/RECORDING, as the command alone writes it; it is absent until it is
    whole. Beside them are summary.csv, summary.parquet, journal.jsonl and logs/. --config and --device are for jobs
    that do not set them.
    """

    plan: tuple[str, ...] = argument("Jobs; or how far a batch is.", "PLAN.toml | status DIR")
    scheduler: str | None = option(
        None, "Dask scheduler of a cluster; otherwise processes on this machine.", metavar="ADDRESS"
    )
    jobs: int = option(0, "Processes on this machine; 0: as many as cores and memory allow.", min=0)
    retries: int = option(3, "How often a call is repeated whose process died.", min=0)
    again: bool = option(False, "Also repeat what was refused, or died, in an earlier run.")
    cache: Path | None = option(
        None, "Keep copies of recordings from addresses such as s3://bucket/run_1.", metavar="DIR"
    )
    check: bool = option(False, "Only read the plan and show the calls that it stands for.")
    threads: int = option(1, "Threads of each call, where the plan does not say; 0: all cores.", min=0)


def batch(commands: Callable[[], Commands], job: Batch) -> None:
    from sdftrack.batch.journal import FAILED, read_items, read_journal
    from sdftrack.batch.plan import read_plan

    job.on_device()
    if job.plan[0] == "status":
        if len(job.plan) != 2:
            raise Usage("expected the folder of a batch: sdftrack batch status DIR", "status")
        out = Path(job.plan[1])
        names = read_items(out)
        if not job.quiet:
            _show(names, read_journal(out), out)
        return
    if len(job.plan) != 1:
        raise Usage(f"expected one plan, got {len(job.plan)}", "PLAN.toml")
    if job.scheduler is not None and job.jobs:
        raise Usage("expected one of --scheduler and --jobs", "--jobs")
    config = None if job.config is None else str(job.config.resolve())
    common = {"threads": job.threads, "device": job.device, "config": config}
    given = {key: value for key, value in common.items() if value not in (None, "auto")}
    items = read_plan(Path(job.plan[0]), given, commands())
    if job.check:
        rows = [
            (i.name, i.command, " ".join([i.source if i.after is None else i.after, *i.words])) for i in items
        ]
        show_table(f"{len(items)} calls", ("results", "command", "inputs and options"), rows[:SHOWN_CALLS])
        return
    ended = _run(job, items, commands())
    failed = sum(ended[item.name]["status"] in FAILED for item in items)
    if failed:
        raise RuntimeError(f"{failed} of {len(items)} calls failed: see {job.folder / 'summary.csv'}")


def _run(job: Batch, items: list[Item], commands: Commands) -> dict[str, dict[str, Any]]:
    from sdftrack.batch.run import Running

    out = job.folder.resolve()
    with progress_counter(job.quiet) as tell:

        def progress(done: int, total: int, failures: int) -> None:
            tell(done, total, "batch", f"{failures} failed" if failures else "")

        def page(address: str) -> None:
            if not job.quiet:
                print(f"dashboard: {address}")

        ended, names = Running(items, out, job, commands, progress, page).run()
    if not job.quiet:
        _show([item.name for item in items], ended, out)
        print(f"written to {out}: {', '.join(names)}")
    return ended


def _show(names: list[str], ended: Mapping[str, Mapping[str, Any]], out: Path) -> None:
    from sdftrack.batch.journal import FAILED, SUCCEEDED
    from sdftrack.batch.task import log_of

    jobs: dict[str, list[str]] = {}
    for name in names:
        jobs.setdefault(name.split("/")[0], []).append(name)
    columns = ("done", "lost", "refused", "died", "skipped", "open")
    rows = []
    for job, own in jobs.items():
        counts = Counter(ended[n]["status"] if n in ended else "open" for n in own)
        seconds = [float(ended[n]["seconds"]) for n in own if n in ended and ended[n]["status"] in SUCCEEDED]
        mean = f"{sum(seconds) / len(seconds):.2f}" if seconds else ""
        rows.append((job, *(str(counts[c]) for c in columns), mean))
    show_table(str(out), ("job", *columns, "mean s"), rows)
    failed = [n for n in names if ended.get(n, {}).get("status") in FAILED]
    for name in failed[:SHOWN]:
        log = f" (log: {log_of(out, name)})" if log_of(out, name).is_file() else ""
        print(f"{name}: {ended[name]['status']}: {ended[name]['reason']}{log}")
    if len(failed) > SHOWN:
        print(f"... and {len(failed) - SHOWN} more: see summary.csv")
