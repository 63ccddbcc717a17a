# SPDX-License-Identifier: MIT
"""Options of commands that read a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import Usage

__all__ = ["FpsOption", "HeightOption", "IntrinsicsOption", "WidthOption", "is_webcam", "open_from"]

WidthOption = Annotated[int | None, typer.Option(min=1, help="Width of the images (of depth if any), px.")]
HeightOption = Annotated[int | None, typer.Option(min=1, help="Height of the images (of depth if any), px.")]
FpsOption = Annotated[float | None, typer.Option(help="Frames per second.")]
IntrinsicsOption = Annotated[
    Path | None,
    typer.Option(
        "--intrinsics", metavar="CAMERA.json", help="Intrinsics of a webcam; other cameras know theirs."
    ),
]


def is_webcam(address: str) -> bool:
    """Whether the address is one of a camera without depth."""
    return address.partition(":")[0] == "webcam"


def open_from(
    address: str,
    width: int | None,
    height: int | None,
    fps: float | None,
    waiting: int,
    *,
    color_alone: bool = False,
    **options: Any,
) -> Any:
    """`open_camera` with the options that were given. `color_alone`: whether a camera without depth is enough."""
    from sdftrack.live import open_camera

    if is_webcam(address) and not color_alone:
        raise Usage(
            "expected a camera with depth, got a webcam; sdftrack live --camera webcam:0 follows an outline "
            "(--contour) or a known shape (--mode rgb)"
        )
    if fps is not None and not fps > 0:
        raise Usage(f"expected frames per second above 0, got {fps:g}", "--fps")
    given = {"width": width, "height": height, "fps": fps, **options}
    return open_camera(address, waiting=waiting, **{k: v for k, v in given.items() if v is not None})
