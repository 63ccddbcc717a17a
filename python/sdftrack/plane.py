# SPDX-License-Identifier: MIT
"""The dominant plane of a depth image: a table, a floor."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.checks import number, of_kind
from sdftrack.frame import Frame

__all__ = ["remove_plane"]


def remove_plane(
    frame: Frame,
    camera: Camera | RGBDCamera | None = None,
    start_px: tuple[float, float] | None = None,
    tolerance: float = 0.01,
) -> tuple[NDArray[np.bool_], tuple[NDArray[np.float64], float]]:
    """Find the plane that most readings lie on, and mark what is not on it (thesis, section 3.8.3).

    Parameters
    ----------
    frame : Frame
        With a depth image.
    camera : Camera or RGBDCamera, optional
        None: the frame's own.
    start_px : (x, y), optional
        A pixel on the plane, whose neighbourhood starts the fit; None: local patches all over the image are tried.
    tolerance : float
        Half thickness of the slab that counts as the plane, m.

    Returns
    -------
    mask : (H, W) bool
        True: a reading that is not on the plane. False on the plane and where nothing was measured.
    plane : ((3,) float64, float)
        Unit normal ``n`` towards the camera and offset ``d`` (m) in the camera's frame: ``n . p + d = 0``.

    Raises
    ------
    ValueError
        No depth, no camera, ``start_px`` outside the image, or no plane that holds a tenth of the readings.

    >>> mask, (n, d) = remove_plane(frame, camera)  # doctest: +SKIP
    """
    of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
    if frame.depth is None:
        raise ValueError("frame: expected a depth image, got none")
    if camera is None and frame.camera is None:
        raise ValueError("camera: expected the depth camera, got None, and the frame has none of its own")
    if not (math.isfinite(number(tolerance, "tolerance")) and tolerance > 0):
        raise ValueError(f"tolerance: expected a length in metres > 0, got {tolerance!r}")
    pinhole = depth_camera(camera if camera is not None else frame.camera)  # type: ignore[arg-type]
    height, width = frame.depth.shape
    x, y = (-1, -1) if start_px is None else (round(start_px[0]), round(start_px[1]))
    if start_px is not None and not (0 <= x < width and 0 <= y < height):
        raise ValueError(f"start_px: expected a pixel of the {width} x {height} image, got {start_px}")
    found = _core.find_plane(frame.depth, pinhole._core, x, y, float(tolerance))
    if found is None:
        raise ValueError(
            "frame: no plane holds a tenth of its depth readings; pass start_px or a larger tolerance"
        )
    normal, offset = np.array(found[0]), float(found[1])
    points = pinhole.back_project(frame.depth)
    off_plane = np.abs(points @ normal + offset) > tolerance
    return (frame.depth > 0) & off_plane, (normal, offset)
