# SPDX-License-Identifier: MIT
"""``sdftrack calibrate``: camera calibration from recordings."""

from __future__ import annotations

import typer

from sdftrack.cli.calibrate_color import color
from sdftrack.cli.calibrate_depth import depth
from sdftrack.cli.calibrate_intrinsics import intrinsics

__all__ = ["calibrate"]

calibrate = typer.Typer(
    name="calibrate", help="Calibrate cameras from recorded sequences.", no_args_is_help=True
)
calibrate.command("intrinsics")(intrinsics)
calibrate.command("color")(color)
calibrate.command("depth")(depth)
