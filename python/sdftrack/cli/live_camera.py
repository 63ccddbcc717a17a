# SPDX-License-Identifier: MIT
"""Options of commands that read a camera."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from sdftrack.cli.common import Usage

__all__ = ["FpsOption", "HeightOption", "WidthOption", "open_from"]

WidthOption = Annotated[int | None, typer.Option(min=1, help="Width of the depth image, px.")]
HeightOption = Annotated[int | None, typer.Option(min=1, help="Height of the depth image, px.")]
FpsOption = Annotated[float | None, typer.Option(help="Frames per second.")]


def open_from(
    address: str, width: int | None, height: int | None, fps: float | None, waiting: int, **options: Any
) -> Any:
    """`open_camera` with the options that were given."""
    from sdftrack.live import open_camera

    if address.partition(":")[0] == "webcam":
        raise Usage(
            "expected a camera with depth, got a webcam; from Python, st.open_camera('webcam:0') gives its images "
            "for st.contour.ContourTracker and Tracker(mode='rgb')"
        )
    if fps is not None and not fps > 0:
        raise Usage(f"expected frames per second above 0, got {fps:g}", "--fps")
    given = {"width": width, "height": height, "fps": fps, **options}
    return open_camera(address, waiting=waiting, **{k: v for k, v in given.items() if v is not None})
