# SPDX-License-Identifier: MIT
"""The options of ``sdftrack batch``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from sdftrack.cli.batch.commands import Commands
from sdftrack.cli.common import Common, check_common
from sdftrack.cli.options import Usage, argument, option

__all__ = ["Batch", "batch"]


@dataclass(frozen=True, kw_only=True)
class Batch(Common):
    """Run the calls of a plan, each once; a second run goes on where an earlier one ended.

    The results of a call are the folder DIR/JOB/RECORDING, as the command alone writes it; it is absent until it is
    whole. Beside them are summary.csv, summary.parquet, journal.jsonl and logs/. --config and --device are for jobs
    that do not set them.
    """

    plan: Annotated[tuple[str, ...], argument("Jobs; or how far a batch is.", "PLAN.toml | status DIR")]
    scheduler: Annotated[
        str | None,
        option("Dask scheduler of a cluster; otherwise processes on this machine.", metavar="ADDRESS"),
    ] = None
    jobs: Annotated[
        int, option("Processes on this machine; 0: as many as cores and memory allow.", min=0)
    ] = 0
    retries: Annotated[int, option("How often a call is repeated whose process died.", min=0)] = 3
    again: Annotated[bool, option("Also repeat what was refused, or died, in an earlier run.")] = False
    cache: Annotated[
        Path | None,
        option("Keep copies of recordings from addresses such as s3://bucket/run_1.", metavar="DIR"),
    ] = None
    check: Annotated[bool, option("Only read the plan and show the calls that it stands for.")] = False
    threads: Annotated[
        int, option("Threads of each call, where the plan does not say; 0: all cores.", min=0)
    ] = 1


def batch(commands: Commands, job: Batch) -> None:
    """`commands`: all those of the program, of which a plan names some."""
    from sdftrack.cli.batch.plan import read_plan
    from sdftrack.cli.batch.run import run_items, show_plan, show_status

    check_common(job.config, job.device)
    if job.plan[0] == "status":
        if len(job.plan) != 2:
            raise Usage("expected the folder of a batch: sdftrack batch status DIR", "status")
        show_status(Path(job.plan[1]), job.quiet)
        return
    if len(job.plan) != 1:
        raise Usage(f"expected one plan, got {len(job.plan)}", "PLAN.toml")
    if job.scheduler is not None and job.jobs:
        raise Usage("expected one of --scheduler and --jobs", "--jobs")
    config = None if job.config is None else str(job.config.resolve())
    common = {"threads": job.threads, "device": job.device, "config": config}
    given = {key: value for key, value in common.items() if value not in (None, "auto")}
    items = read_plan(Path(job.plan[0]), given, commands)
    if job.check:
        show_plan(items)
        return
    failed = run_items(items, job, commands)
    if failed:
        raise RuntimeError(f"{failed} of {len(items)} calls failed: see {job.folder / 'summary.csv'}")
