# SPDX-License-Identifier: MIT
"""Conversion of RealSense's lens models to OpenCV's, by a fit over the image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sdftrack.camera.pinhole import Camera

FIT_TOLERANCE_PX = 0.3  # at the worst pixel, a corner; a strong tangential part does not convert exactly

Array = NDArray[np.float64]


def opencv_distortion_from_realsense(
    model: str, coefficients: tuple[float, ...], camera: Camera
) -> tuple[float, ...]:
    """OpenCV's coefficients for a RealSense lens: `model` by name, `coefficients` k1 k2 p1 p2 k3."""
    kind = model.rsplit(".", 1)[-1].strip().lower().replace(" ", "_").replace("-", "_")
    if kind == "none" or not any(coefficients):
        return ()
    if kind == "brown_conrady":
        return tuple(coefficients[:5])
    xy = _image_grid(camera)
    if kind == "inverse_brown_conrady":  # its polynomial takes distorted coordinates to ideal ones
        ideal, distorted = _polynomial(xy, coefficients, radial_first=False), xy
    elif kind == "modified_brown_conrady":  # its tangential part uses the radially distorted point
        ideal = xy
        for _ in range(50):
            ideal = ideal + xy - _polynomial(ideal, coefficients, radial_first=True)
        distorted = _polynomial(ideal, coefficients, radial_first=True)
    else:
        raise ValueError(
            f"model: expected a RealSense lens none, brown_conrady, inverse_brown_conrady or "
            f"modified_brown_conrady, got {model!r}; rectify the images first"
        )
    lens = _fit(ideal, distorted)
    try:
        fitted = type(camera)(camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, lens)
    except ValueError:  # it folds over: no fit at all
        fitted = camera
    rays = np.column_stack([ideal, np.ones(len(ideal))])
    wanted = distorted * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    error = np.abs(fitted.project(rays) - wanted).max()
    if not error <= FIT_TOLERANCE_PX:
        raise ValueError(
            f"model: {kind} with coefficients {coefficients} differs from any Brown-Conrady lens by "
            f"{error:.2g} px, expected at most {FIT_TOLERANCE_PX}; rectify the images first"
        )
    return lens


def _image_grid(camera: Camera) -> Array:
    u, v = np.meshgrid(np.linspace(0, camera.width - 1, 33), np.linspace(0, camera.height - 1, 25))
    return np.column_stack([(u.ravel() - camera.cx) / camera.fx, (v.ravel() - camera.cy) / camera.fy])


def _polynomial(xy: Array, c: tuple[float, ...], radial_first: bool) -> Array:
    r2 = (xy**2).sum(1, keepdims=True)
    radial = xy * (1 + r2 * (c[0] + r2 * (c[1] + r2 * c[4])))
    x, y = (radial if radial_first else xy).T
    # RealSense takes r^2 of the undistorted point in both models.
    return radial + np.column_stack(
        [
            2 * c[2] * x * y + c[3] * (r2[:, 0] + 2 * x * x),
            2 * c[3] * x * y + c[2] * (r2[:, 0] + 2 * y * y),
        ]
    )


def _fit(ideal: Array, distorted: Array) -> tuple[float, ...]:
    """k1 k2 p1 p2 k3 k4 k5 k6 by least squares.

    distorted = ideal N / D + t with N, D polynomials in r^2; multiplied by D, it is linear in all unknowns except the
    product D t, where D is taken from the previous iteration.
    """
    r2 = (ideal**2).sum(1, keepdims=True)
    x, y = ideal.T
    k1, k2, p1, p2, k3, k4, k5, k6 = np.zeros(8)
    for _ in range(10):
        D = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        columns = [
            *(ideal * r2**n for n in (1, 2, 3)),
            *(-distorted * r2**n for n in (1, 2, 3)),
            D * np.column_stack([2 * x * y, r2[:, 0] + 2 * y * y]),
            D * np.column_stack([r2[:, 0] + 2 * x * x, 2 * x * y]),
        ]
        A = np.column_stack([c.ravel() for c in columns])
        k1, k2, k3, k4, k5, k6, p1, p2 = np.linalg.lstsq(A, (distorted - ideal).ravel(), rcond=1e-12)[0]
    return tuple(float(k) for k in (k1, k2, p1, p2, k3, k4, k5, k6))
