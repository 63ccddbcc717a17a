# SPDX-License-Identifier: MIT
"""A single depth image and its camera, for ``sdftrack fit``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdftrack.cli.common import Usage

if TYPE_CHECKING:
    from sdftrack.frame import Frame

IMAGES = (".png", ".tif", ".tiff")
SIZED = (".json", ".yaml", ".yml")  # camera files that may hold the size of the image
MILLIMETRE = 0.001
HOW = "give its intrinsics by --camera FILE or --intrinsics fx,fy,cx,cy"


def is_depth_image(source: Path) -> bool:
    """Whether a file is a depth image: an image file, or a .npy of images, not of points (N, 3)."""
    if not source.is_file():
        return False
    if source.suffix.lower() != ".npy":
        return source.suffix.lower() in IMAGES
    shape = _array(source).shape
    return len(shape) > 1 and shape[1:] != (3,)


def parse_intrinsics(text: str | None, camera: Path | None) -> tuple[float, ...] | None:
    """The numbers of ``--intrinsics fx,fy,cx,cy``."""
    if text is None:
        return None
    if camera is not None:
        raise Usage("expected one of --intrinsics and --camera, got both", "--intrinsics")
    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        values = ()
    if len(values) != 4 or not all(map(math.isfinite, values)) or min(values[:2]) <= 0:
        raise Usage(f"expected fx,fy,cx,cy in pixels, fx and fy above 0, got {text!r}", "--intrinsics")
    return values


def read_depth_image(
    source: Path, camera: Path | None, values: tuple[float, ...] | None, scale: float | None
) -> Frame:
    """The depth image as a frame with its camera. `scale`: m per unit; None: mm of integers, m of floats."""
    from sdftrack.camera import Camera
    from sdftrack.frame import Frame
    from sdftrack.io.frames import read_depth_units

    if camera is None and values is None:
        raise Usage(f"expected the camera of a single depth image, got none: {HOW}", "--camera")
    depth: Any = _array(source) if source.suffix.lower() == ".npy" else read_depth_units(source)
    if depth.ndim != 2 or depth.dtype.kind not in "uif" or not depth.size:
        raise ValueError(
            f"{source}: expected depth (H, W) or points (N, 3) of numbers, got {depth.dtype} {depth.shape}"
        )
    height, width = depth.shape
    if values is not None:
        fx, fy, cx, cy = values
        pinhole = Camera(fx, fy, cx, cy, width, height)
    else:
        assert camera is not None
        size = () if camera.suffix.lower() in SIZED else (width, height)
        pinhole = Camera.load(camera, *size)
        if pinhole.shape != depth.shape:
            raise ValueError(
                f"--camera {camera}: expected the size of the depth image {width} x {height}, got "
                f"{pinhole.width} x {pinhole.height}"
            )
    if scale is None:
        scale = 1.0 if depth.dtype.kind == "f" else MILLIMETRE
    return Frame(depth.astype("float32") * scale, camera=pinhole)


def _array(source: Path) -> Any:
    from sdftrack._internal.array_archive import read_array

    try:
        with source.open("rb") as opened:
            return read_array(opened, source.stat().st_size)
    except ValueError as error:
        raise ValueError(f"{source}: not a readable .npy file ({' '.join(str(error).split())})") from None
