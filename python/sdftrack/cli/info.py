# SPDX-License-Identifier: MIT
"""``sdftrack info`` and ``sdftrack config``: what this build is, and every option that it has."""

from __future__ import annotations

from dataclasses import dataclass

import typer

from sdftrack._internal.files import write_json, write_text
from sdftrack.cli.common import Common, contour_settings, reconstructor_settings
from sdftrack.cli.options import Usage, option


@dataclass(frozen=True, kw_only=True)
class Info(Common):
    """Print version, build options, CPU features in use, GPU and threads; also written to DIR/info.json."""

    self_test: bool = option(False, 'Compare a GPU with the CPU; device="auto" uses one that has passed.')


def info(job: Info) -> None:
    from sdftrack import _core
    from sdftrack.device import info as collect

    job.on_device()
    tested, passed = _self_test(job.device) if job.self_test else ([], True)
    # After the self-test, which decides what "auto" is.
    device = job.on_device()
    facts = {**collect(), "device": device, "threads": int(_core.thread_count(job.threads))}
    if job.self_test:
        facts["self_test"] = tested
    if job.out is not None:
        write_json(job.make_out() / "info.json", facts)
    if not job.quiet:
        width = max(map(len, facts))
        for name, value in facts.items():
            between = f"\n{'':{width}s}  " if name == "self_test" else ", "
            shown = between.join(map(str, value)) if isinstance(value, list) else value
            print(f"{name:{width}s}  {'none' if shown in (None, '') else shown}")
    if not passed:
        raise typer.Exit(1)


def _self_test(device: str) -> tuple[list[str], bool]:
    from sdftrack.device import CPU, device_number
    from sdftrack.testing.self_test import run_self_test

    number = device_number("cuda" if device == "auto" else device)
    if number == CPU:
        raise Usage("expected cuda or cuda:N, got cpu: the self-test compares a GPU with the CPU", "--device")
    checks = run_self_test(number)
    lines = [f"{c.name}: {'agrees' if c.agrees else 'DIFFERS'} ({c.detail})" for c in checks]
    return lines, all(c.agrees for c in checks)


@dataclass(frozen=True, kw_only=True)
class Config(Common):
    """Print every option with its default, unit and meaning, as a TOML file for --config."""


def config(job: Config) -> None:
    from sdftrack._internal.option_files import options_as_toml

    job.on_cpu()
    given = reconstructor_settings(job.config)
    text = options_as_toml(given.get("tracker_options"), given.get("options"), contour_settings(job.config))
    if job.out is not None:
        write_text(job.make_out() / "config.toml", text)
    if not job.quiet:
        print(text, end="")
