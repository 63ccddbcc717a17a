# SPDX-License-Identifier: MIT
"""``sdftrack info``: version, build, CPU features, GPU, threads."""

from __future__ import annotations

from typing import Annotated

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    Usage,
)


def info(
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
    self_test: Annotated[
        bool,
        typer.Option(
            "--self-test", help='Compare a GPU with the CPU; device="auto" uses one that has passed.'
        ),
    ] = False,
) -> None:
    """Print version, build options, CPU features in use, GPU and threads; also written to DIR/info.json."""
    from sdftrack import _core
    from sdftrack.cli.common import check_common
    from sdftrack.device import info as collect

    check_common(config, device)
    tested, passed = _self_test(device) if self_test else ([], True)
    # After the self-test, which decides what "auto" is.
    facts = {**collect(), "device": check_common(config, device), "threads": int(_core.thread_count(threads))}
    if self_test:
        facts["self_test"] = tested
    if out is not None:
        from sdftrack._internal.files import write_json
        from sdftrack.recorder import prepare_folder

        prepare_folder(out, overwrite)
        write_json(out / "info.json", facts)
    if not quiet:
        width = max(map(len, facts))
        for name, value in facts.items():
            between = f"\n{'':{width}s}  " if name == "self_test" else ", "
            shown = between.join(map(str, value)) if isinstance(value, list) else value
            print(f"{name:{width}s}  {'none' if shown in (None, '') else shown}")
    if not passed:
        raise typer.Exit(1)


def _self_test(device: str) -> tuple[list[str], bool]:
    """A line for each comparison of the GPU with the CPU, and whether all agree."""
    from sdftrack.device import CPU, device_number
    from sdftrack.testing.self_test import run_self_test

    number = device_number("cuda" if device == "auto" else device)
    if number == CPU:
        raise Usage("expected cuda or cuda:N, got cpu: the self-test compares a GPU with the CPU", "--device")
    checks = run_self_test(number)
    lines = [f"{c.name}: {'agrees' if c.agrees else 'DIFFERS'} ({c.detail})" for c in checks]
    return lines, all(c.agrees for c in checks)
