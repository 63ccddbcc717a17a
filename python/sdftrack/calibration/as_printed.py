# SPDX-License-Identifier: MIT
"""The registration of depth and colour as the thesis prints it, section 3.7: Hough circle, 3-DoF tracker, 2-norm."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sdftrack import _core
from sdftrack.calibration.color_result import BallPairs, ColorMapping, Fit
from sdftrack.calibration.observe import ball_model, guessed_camera, samples_of, usable
from sdftrack.camera import Camera
from sdftrack.energy.energy import Energy, minimize
from sdftrack.frame import Frame
from sdftrack.geometry import pose
from sdftrack.options import TrackerOptions
from sdftrack.sdf.volume import SDF

Array = NDArray[np.float64]
VOXELS = 64
TRANSLATION_ONLY = (False, False, False, True, True, True)
SMALLEST_PX = 5  # radius of a circle


def pairs_as_printed(
    frames: Any, depth_camera: Camera, radius_m: float, ball_color: Any, seed: int
) -> tuple[BallPairs, tuple[int, int]]:
    """The ball's centre in every frame that shows it in both images, and the (width, height) of the colour images.

    The tracker in depth begins each frame where the search finds the ball, in the place of a click in the first one.
    """
    samples = samples_of(frames)
    h, w = samples[0].color.shape[:2]
    model = ball_model([f.color for f in samples], ball_color, guessed_camera(w, h), seed)
    recording = _core.BallRecording()
    finder = _core.BallFinder(depth_camera._core, radius_m)
    for i in range(len(frames)):
        if usable(frames[i]):
            balls = finder.search(np.ascontiguousarray(frames[i].depth))
            recording.add(_core.ObservedFrame(i, float("nan"), balls, []))
    recording.sort_moving_first(radius_m)
    sdf = SDF.sphere(radius_m, voxels=VOXELS)
    found = []
    for seen in recording.frames:
        frame = frames[seen.index]
        circle = hough_circle(model.mask(np.ascontiguousarray(frame.color)))
        if seen.balls and circle is not None:
            center = tracked_center(sdf, depth_camera, frame, seen.balls[0].center_cam)
            found.append((seen.index, center, circle, frame.timestamp))
    n = len(found)
    unknown = np.full((n, 2, 2), np.nan)  # the printed method states no uncertainty of a centre
    pairs = BallPairs(
        np.array([i for i, *_ in found], np.int64),
        np.array([center for _, center, _, _ in found]).reshape(n, 3),
        np.zeros((n, 3, 3)),
        np.array([circle[:2] for _, _, circle, _ in found]).reshape(n, 2),
        unknown,
        np.array([circle[2] for _, _, circle, _ in found]),
        np.array([np.nan if t is None else t for *_, t in found]),
        np.full((n, 2), np.nan),
        np.ones(n, bool),
    )
    return pairs, (w, h)


def hough_circle(mask: NDArray[np.uint8]) -> tuple[float, float, float] | None:
    """(x, y, radius), px, of the strongest circle of a ball / not-ball mask (h, w) by the Hough transform."""
    picture = cv2.GaussianBlur(255 * (mask != 0).astype(np.uint8), (5, 5), 0)
    circles = cv2.HoughCircles(
        picture,
        cv2.HOUGH_GRADIENT,
        dp=1,
        minDist=max(mask.shape),
        param1=100,
        param2=10,
        minRadius=SMALLEST_PX,
    )
    if circles is None:
        return None
    x, y, radius = (float(v) for v in circles[0, 0])
    return x, y, radius


def tracked_center(sdf: SDF, camera: Camera, frame: Frame, start_cam: Array) -> Array:
    """The centre (3,) of a sphere's SDF in the depth camera, m: Eq. 3.12 with the translation as the only unknown."""
    printed = TrackerOptions.printed()
    options = {name: getattr(printed, name) for name in ("residual", "curvature", "outlier_floor")}
    energy = Energy(sdf, camera, frame, pose((0, 0, 0), start_cam), **options)
    return minimize(energy, fixed=TRANSLATION_ONLY).x.poses[0][:3, 3].copy()


def fit_as_printed(pairs: BallPairs, depth_camera: Camera, size: tuple[int, int]) -> Fit:
    """P and q by the 2-norm of the reprojection error (Eq. 3.26); every pair counts the same.

    It begins with a guessed colour camera of this (width, height) in the place of the depth camera.
    """
    start = np.c_[guessed_camera(*size).K, np.zeros(3)].ravel()

    def residuals(x: Array) -> Array:
        return (pairs.color_px - _mapping(x, depth_camera).predict(pairs.center_cam)[0]).ravel()

    def jacobian(x: Array) -> Array:
        return -_mapping(x, depth_camera).predict(pairs.center_cam)[1].reshape(-1, 12)

    found = least_squares(residuals, start, jacobian, x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15)
    scale = np.linalg.norm(found.x.reshape(3, 4)[2, :3])
    x = found.x / scale
    J, freedom = jacobian(x), max(1, 2 * len(pairs) - 11)
    left = residuals(x)
    covariance = np.zeros((13, 13))
    covariance[:12, :12] = float(left @ left) / freedom * np.linalg.pinv(J.T @ J, rcond=1e-12)
    return Fit(
        _mapping(x, depth_camera), 0.0, covariance, left.reshape(-1, 2), np.ones(len(pairs), bool), freedom
    )


def _mapping(x: Array, depth_camera: Camera) -> ColorMapping:
    return ColorMapping(depth_camera, M=np.ascontiguousarray(x.reshape(3, 4)))
