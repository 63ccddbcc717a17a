# SPDX-License-Identifier: MIT
"""Cameras on a command line: running ones, and intrinsics of a file or of four numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from sdftrack.cli.common import above_zero, floats
from sdftrack.cli.objects import about_file
from sdftrack.cli.options import Usage, option

__all__ = ["CameraSize", "is_webcam", "load_camera", "parse_intrinsics"]

SIZED = (".json", ".yaml", ".yml")  # camera files that may hold the size of the image


@dataclass(frozen=True, kw_only=True)
class CameraSize:
    """What is asked of a running camera."""

    width: Annotated[int | None, option("Width of the images (of depth if any), px.", min=1)] = None
    height: Annotated[int | None, option("Height of the images (of depth if any), px.", min=1)] = None
    fps: Annotated[float | None, option("Frames per second."), above_zero("frames per second")] = None

    def opened(
        self, address: str, waiting: int, *, color_alone: bool = False, camera: Path | None = None
    ) -> Any:
        """`open_camera` with the options that were given. `color_alone`: a camera without depth is enough."""
        from sdftrack.live import open_camera

        if is_webcam(address) and not color_alone:
            raise Usage(
                "expected a camera with depth, got a webcam; sdftrack live --camera webcam:0 follows an outline "
                "(--contour) or a known shape (--mode rgb)"
            )
        given = {"width": self.width, "height": self.height, "fps": self.fps, "camera": camera}
        return open_camera(address, waiting=waiting, **{k: v for k, v in given.items() if v is not None})


def is_webcam(address: str) -> bool:
    """Whether the address is one of a camera without depth."""
    return address.partition(":")[0] == "webcam"


def parse_intrinsics(text: str, name: str) -> tuple[float, float, float, float]:
    """The numbers of an option ``fx,fy,cx,cy``."""
    fx, fy, cx, cy = floats(text, 4) or (0.0,) * 4
    if not (fx > 0 and fy > 0):
        raise Usage(f"expected fx,fy,cx,cy in pixels, fx and fy above 0, got {text!r}", name)
    return fx, fy, cx, cy


def load_camera(file: Path, shape: tuple[int, int], what: str) -> Any:
    """The pinhole camera of a file, for images of that shape (rows, columns); `what`: "the depth image"."""
    from sdftrack.camera import Camera

    height, width = shape
    with about_file("--camera", file):
        camera = Camera.load(file, *(() if file.suffix.lower() in SIZED else (width, height)))
    if camera.shape != (height, width):
        raise ValueError(
            f"--camera {file}: expected the size of {what} {width} x {height}, got {camera.width} x {camera.height}"
        )
    return camera
