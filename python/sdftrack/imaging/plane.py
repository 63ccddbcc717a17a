# SPDX-License-Identifier: MIT
"""Planes of a depth image: the dominant one (a table, a floor), and the three of a corner."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.validation import THREADS, number, of_kind, whole
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame

METHODS = ("rigid", "bent", "printed")
KINECT = (0.0012, 0.0019, 0.5)  # near_m, per_m, lateral_px of the law; Nguyen, Izadi and Lovell 2012
WIDEST_M = 0.5  # a tolerance beyond this is one in millimetres


def remove_plane(
    frame: Frame,
    camera: Camera | RGBDCamera | None = None,
    start_px: tuple[float, float] | None = None,
    tolerance: float = 0.01,
    *,
    method: str = "rigid",
    noise: str | float | None = None,
    feet: bool = True,
    threads: int = 0,
) -> tuple[NDArray[np.bool_], tuple[NDArray[np.float64], float]]:
    """Find the dominant plane, and mark the pixels that are not on it (thesis, section 3.8 and Fig. 3.15).

    A patch is fitted, extended over the image, refitted to all measurements near it, and a slab around it is removed.
    Among close parallel planes (a table, the top of a box on it) the one behind is selected. docs/math/planes.md
    derives the tests.

    Parameters
    ----------
    frame : Frame
        With a depth image.
    camera : Camera or RGBDCamera, optional
        None: the frame's own.
    start_px : (x, y), optional
        A pixel on the plane, whose neighbourhood initialises the fit; None: local patches all over the image are
        tested.
    tolerance : float
        Half thickness of the slab around the plane, m; at least three sd of the sensor's noise along the normal.
    method : "rigid", "bent" or "printed"
        "bent" models the surface with a cubic in image coordinates, for sensors with depth distortion towards the
        borders. "printed" is that of the thesis: the patch is extended without refitting, and the slab is `tolerance`
        everywhere.
    noise : None, "kinect" or float
        Depth noise. None: grows like that of a structured-light sensor, scaled to the noise measured on the plane;
        "kinect": that noise model without scaling; a number: this sd (m) at all depths.
    feet : bool
        Keep measurements in the slab that are above two sd and connected to something above the slab: the lower edges
        of objects.
    threads : int
        0: all cores. The result is the same, bit by bit.

    Returns
    -------
    mask : (H, W) bool
        True: a measurement that is not on the plane. False on the plane and where depth is missing.
    plane : ((3,) float64, float)
        Unit normal ``n`` towards the camera and offset ``d`` (m) in the camera's frame: ``n . p + d = 0``.

    Raises
    ------
    ValueError
        No depth, no camera, too few measurements, ``start_px`` outside the image, without a measurement or not on a
        plane, ``tolerance`` not within 0..0.5 m, or no plane with a tenth of the measurements.

    >>> mask, (n, d) = remove_plane(frame, camera)  # doctest: +SKIP
    """
    pinhole = _camera_of(frame, camera)
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"method: expected one of {', '.join(METHODS)}, got {method!r}")
    if not isinstance(feet, (bool, np.bool_)):
        raise TypeError(f"feet: expected True or False, got {feet!r}")
    assert frame.depth is not None
    x, y = _start(start_px, frame.depth.shape)
    tolerance = _tolerance(tolerance)
    found = _core.remove_plane(
        frame.depth, pinhole._core, pinhole.rays if pinhole.distortion is not None else None, x, y, tolerance,
        method, _law(noise), noise is None, bool(feet), whole(threads, "threads", 0, what=THREADS),
    )  # fmt: skip
    if isinstance(found, str):
        raise ValueError(_miss(found, start_px, tolerance))
    return found[0], (np.array(found[1]), float(found[2]))


def _camera_of(frame: Any, camera: Any) -> Camera:
    of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
    if frame.depth is None:
        raise ValueError("frame: expected a depth image, got none")
    if camera is None and frame.camera is None:
        raise ValueError("camera: expected the depth camera, got None, and the frame has none of its own")
    return depth_camera(camera if camera is not None else frame.camera)


def _start(start_px: tuple[float, float] | None, shape: tuple[int, ...]) -> tuple[int, int]:
    """Column and row; -1, -1 for None."""
    if start_px is None:
        return -1, -1
    height, width = shape
    try:
        u, v = (number(c, "start_px") for c in start_px)
    except (TypeError, ValueError):
        raise TypeError(f"start_px: expected a pixel (x, y), got {start_px!r}") from None
    if not (-0.5 <= u < width - 0.5 and -0.5 <= v < height - 0.5):
        raise ValueError(f"start_px: expected a pixel of the {width} x {height} image, got {start_px}")
    return min(max(round(u), 0), width - 1), min(max(round(v), 0), height - 1)


def _tolerance(tolerance: Any) -> float:
    value = number(tolerance, "tolerance")
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"tolerance: expected a length in metres > 0, got {tolerance!r}")
    if value > WIDEST_M:
        raise ValueError(
            f"tolerance: expected at most {WIDEST_M:g} m, got {tolerance!r}; in millimetres? pass {value / 1e3:g}"
        )
    return value


def _law(noise: str | float | None) -> tuple[float, float, float]:
    if noise is None or (isinstance(noise, str) and noise == "kinect"):
        return KINECT
    if isinstance(noise, str):
        raise ValueError(f'noise: expected None, "kinect" or a standard deviation in metres, got {noise!r}')
    sigma_m = number(noise, "noise")
    if not 0 < sigma_m <= WIDEST_M:
        raise ValueError(f"noise: expected a standard deviation of 0 to {WIDEST_M:g} m, got {noise!r}")
    return sigma_m, 0.0, 0.0


def _miss(why: str, start_px: tuple[float, float] | None, tolerance: float) -> str:
    if why == "few readings":
        return "frame: expected depth measurements of a plane, got almost none (no plane can be fitted)"
    if why == "no start":
        return f"start_px: expected a pixel with a depth measurement, got none at {start_px}; choose one beside it"
    if why == "start not flat":
        return (
            f"start_px: expected a pixel on a plane, got one at {start_px} around which the depth is not planar or "
            "too sparse; choose one farther from edges"
        )
    if start_px is not None:
        return (
            f"start_px: the plane at {start_px} contains less than a tenth of the depth measurements; choose a pixel "
            "on the table or floor, or omit start_px"
        )
    return (
        f"frame: no plane contains a tenth of its depth measurements within {tolerance:g} m; pass start_px or a larger "
        "tolerance"
    )


# -- Three planes that meet in a corner, each fitted to all of its measurements


Array = NDArray[np.float64]
APART = 3.0  # slabs: measurements nearer to a second plane are of an edge, where the sensor mixes both
ROUNDS = 2  # of sharing out and fitting: after the first one nothing moves by more than its own error


def three_planes(frame: Frame, camera: Any, tolerance: float) -> tuple[Array, Array]:
    """The three largest planes of a depth image: (3, 3) unit normals (rows) towards the camera, and (3,) offsets, m.
    They are found sequentially. Then each is refitted to all measurements within its slab that are not near the other
    planes, weighted by the sensor's noise along the ray: a linear fit of inverse depth over pixels, which does not
    depend on the focal length or the principal point (docs/math/planes.md, section 6)."""
    found, rest = [], frame
    for _ in range(3):
        off_plane, plane = remove_plane(rest, camera, tolerance=tolerance, feet=False)
        found.append(plane)
        assert rest.depth is not None  # remove_plane has looked
        rest = rest.replace(depth=np.where(off_plane, rest.depth, np.float32(0)))
    n, d = np.array([normal for normal, _ in found]), np.array([offset for _, offset in found])
    for _ in range(ROUNDS):
        n, d = _refitted(frame, _camera_of(frame, camera), n, d, tolerance)
    return n, d


def _refitted(frame: Frame, camera: Camera, n: Array, d: Array, tolerance: float) -> tuple[Array, Array]:
    assert frame.depth is not None
    z = frame.depth.astype(np.float64)
    height = np.abs(camera.back_project(frame.depth) @ n.T + d)
    # The slab of measurements at their depth and angle, as remove_plane has it: three sd along the normal.
    rays = np.concatenate([camera.rays, np.ones((*camera.shape, 1), np.float32)], axis=-1)
    sigma = (KINECT[0] + KINECT[1] * (z - 0.4) ** 2)[..., None] * np.abs(rays @ n.T)
    near = height / np.maximum(tolerance, 3 * sigma)
    out_n, out_d = [], []
    for k in range(3):
        others = [j for j in range(3) if j != k]
        own = (z > 0) & (near[..., k] < 1) & (near[..., others] > APART).all(axis=-1)
        fitted = _core.fit_plane(
            frame.depth, camera._core, camera.rays if camera.distortion is not None else None,
            own.view(np.uint8), n[k], d[k], tolerance, KINECT,
        )  # fmt: skip
        out_n.append(n[k] if fitted is None else np.array(fitted[0]))
        out_d.append(d[k] if fitted is None else float(fitted[1]))
    return np.array(out_n), np.array(out_d)
