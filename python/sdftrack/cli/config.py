# SPDX-License-Identifier: MIT
"""``sdftrack config``: every option, default, unit and meaning, as TOML."""

from __future__ import annotations

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
)


def config(
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Print every option with its default, unit and meaning, as a TOML file for --config."""
    from sdftrack._internal.option_text import options_as_toml
    from sdftrack.cli.common import check_cpu_only, contour_settings, reconstructor_settings

    check_cpu_only(None, device)
    given = reconstructor_settings(config)
    text = options_as_toml(given.get("tracker_options"), given.get("options"), contour_settings(config))
    if out is not None:
        from sdftrack._internal.files import write_text
        from sdftrack.recorder import prepare_folder

        prepare_folder(out, overwrite)
        write_text(out / "config.toml", text)
    if not quiet:
        print(text, end="")
