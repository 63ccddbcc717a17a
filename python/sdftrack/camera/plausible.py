# SPDX-License-Identifier: MIT
"""Intrinsics that are unlikely those of the image: of another size, or not in pixels."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdftrack.camera.pinhole import Camera
    from sdftrack.camera.rgbd import RGBDCamera

MIN_FOCAL = 0.1  # of the width: a field of view of 157 degrees, beyond what a pinhole model describes
OTHER_SCALE = 1.5  # times the middle of the image, or less than 1 / 1.5 of it
EQUAL = 0.12  # by which both coordinates of the principal point may differ in that ratio
OFF_MIDDLE = 0.1  # of the half image; calibrated principal points are nearer to the middle
NEAR_SIZE = 0.05  # of twice the principal point, to the size of a common image
# Width and height of the images of common cameras, colour and depth.
SIZES = (
    (320, 240), (424, 240), (480, 270), (512, 424), (640, 360), (640, 400), (640, 480), (640, 576), (800, 600),
    (848, 480), (960, 540), (1024, 768), (1024, 1024), (1280, 720), (1280, 800), (1280, 960), (1280, 1024),
    (1440, 1080), (1600, 1200), (1920, 1080), (1920, 1200), (1920, 1440), (2048, 1536), (2560, 1440), (3840, 2160),
    (4032, 3024), (4096, 3072),
)  # fmt: skip


def doubt_of(camera: Camera) -> str:
    """Why the intrinsics are unlikely those of an image of this size, in one sentence; "" where they may be.

    A principal point off the middle is right in a crop, as :meth:`Camera.cropped` makes it; to be asked only of cameras
    from files and of matrices.
    """
    width, height = camera.width, camera.height
    if min(camera.fx / width, camera.fy / height) < MIN_FOCAL:
        return (
            f"the focal lengths ({camera.fx:.4g}, {camera.fy:.4g}) are below a tenth of the {width} x {height} image; "
            "expected pixels of this image"
        )
    u, v = camera.cx + 0.5, camera.cy + 0.5
    x, y = 2 * u / width, 2 * v / height  # 1: in the middle
    other = _other_size(camera, x, y)
    outside = not (0 < u < width and 0 < v < height)
    if not other and not outside:
        return ""
    at_corner = abs(x - 2) < OFF_MIDDLE and abs(y - 2) < OFF_MIDDLE
    where = (
        "outside" if outside and not at_corner else "at the corner of" if at_corner else "off the middle of"
    )
    text = f"the principal point ({camera.cx:g}, {camera.cy:g}) lies {where} the {width} x {height} image"
    if not other:
        return text + ", which is right only for a crop of a larger one"
    ratios = " x ".join(f"{ratio:.3g}" for ratio in dict.fromkeys((other[0] / width, other[1] / height)))
    return (
        f"{text}: the intrinsics look like those of a {other[0]} x {other[1]} image, {ratios} times as large; scale "
        "them, or take those of this image"
    )


def _other_size(camera: Camera, x: float, y: float) -> tuple[int, int] | None:
    """The image size in whose middle the principal point lies, if it is in the middle of no image of this size."""
    if x <= 0 or y <= 0 or max(abs(x - 1), abs(y - 1)) < OFF_MIDDLE:
        return None
    width, height = camera.width * x, camera.height * y
    for common in SIZES:
        if abs(width / common[0] - 1) < NEAR_SIZE and abs(height / common[1] - 1) < NEAR_SIZE:
            return common
    scale = (x * y) ** 0.5
    if abs(x / y - 1) < EQUAL and not 1 / OTHER_SCALE < scale < OTHER_SCALE:
        return round(camera.width * scale), round(camera.height * scale)
    return None


def warn_if_doubtful(camera: Camera | RGBDCamera, name: str, stacklevel: int = 3) -> None:
    """One warning for each camera whose intrinsics are unlikely those of its image."""
    both: Any = camera
    pair = {"depth": both.depth, "colour": both.color} if hasattr(both, "depth") else {"": both}
    for kind, one in pair.items():
        if one is not None and (doubt := doubt_of(one)):
            warnings.warn(f"{name}{kind and ', ' + kind + ' camera'}: {doubt}", stacklevel=stacklevel)
