# SPDX-License-Identifier: MIT
"""``sdftrack info``: version, build, CPU features, GPU, threads."""

from __future__ import annotations

from sdftrack.cli.common import (
    ConfigOption,
    Device,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
)


def info(
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    device: DeviceOption = Device.auto,
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Print version, build options, CPU features in use, GPU and threads; also written to DIR/info.json."""
    from sdftrack import _core
    from sdftrack.cli.common import check_common
    from sdftrack.device import info as collect

    facts = {**collect(), "device": check_common(config, device), "threads": int(_core.thread_count(threads))}
    if out is not None:
        from sdftrack._internal.files import write_json
        from sdftrack.recorder import prepare_folder

        prepare_folder(out, overwrite)
        write_json(out / "info.json", facts)
    if not quiet:
        width = max(map(len, facts))
        for name, value in facts.items():
            shown = ", ".join(map(str, value)) if isinstance(value, list) else value
            print(f"{name:{width}s}  {'none' if shown in (None, '') else shown}")
