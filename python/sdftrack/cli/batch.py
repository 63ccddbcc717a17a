# SPDX-License-Identifier: MIT
"""``sdftrack batch``: commands over many recordings, on this machine or a cluster; goes on after a crash."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    check_common,
)
from sdftrack.cli.options import Usage

__all__ = ["batch"]


def batch(
    plan: Annotated[
        list[str], typer.Argument(metavar="PLAN.toml | status DIR", help="Jobs; or how far a batch is.")
    ],
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Dask scheduler of a cluster; otherwise processes on this machine."
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=0, help="Processes on this machine; 0: as many as cores and memory allow.")
    ] = 0,
    retries: Annotated[int, typer.Option(min=0, help="How often a call is repeated whose process died.")] = 3,
    again: Annotated[
        bool, typer.Option("--again", help="Also repeat what was refused, or died, in an earlier run.")
    ] = False,
    cache: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Keep copies of recordings from addresses such as s3://bucket/run_1."
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Only read the plan and show the calls that it stands for.")
    ] = False,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: Annotated[
        int, typer.Option(min=0, help="Threads of each call, where the plan does not say; 0: all cores.")
    ] = 1,
    quiet: QuietOption = False,
) -> None:
    """Run the calls of a plan, each once; a second run goes on where an earlier one ended.

    The results of a call are the folder DIR/JOB/RECORDING, as the command alone writes it; it is absent until it is
    whole. Beside them are summary.csv, summary.parquet, journal.jsonl and logs/. --config and --device are for jobs
    that do not set them.
    """
    from sdftrack.cli.batch_plan import read_plan
    from sdftrack.cli.batch_run import Running, run_items, show_plan, show_status

    check_common(config, device)
    if plan[0] == "status":
        if len(plan) != 2:
            raise Usage("expected the folder of a batch: sdftrack batch status DIR", "status")
        show_status(Path(plan[1]), quiet)
        return
    if len(plan) != 1:
        raise Usage(f"expected one plan, got {len(plan)}", "PLAN.toml")
    if scheduler is not None and jobs:
        raise Usage("expected one of --scheduler and --jobs", "--jobs")
    common = {
        "threads": threads,
        "device": device,
        "config": None if config is None else str(config.resolve()),
    }
    items = read_plan(
        Path(plan[0]), {key: value for key, value in common.items() if value not in (None, "auto")}
    )
    if check:
        show_plan(items)
        return
    if out is None:
        raise Usage("expected a folder for the results: --out DIR", "--out")
    settings = Running(scheduler, jobs, retries, again, overwrite, cache, quiet)
    failed = run_items(items, out, settings)
    if failed:
        raise RuntimeError(f"{failed} of {len(items)} calls failed: see {out / 'summary.csv'}")
