# SPDX-License-Identifier: MIT
"""The factory calibration of an Azure Kinect for the image size of a recording."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera, RGBDCamera

__all__ = ["azure_cameras"]

# Size of the depth image -> (side of the sensor's image at this binning, offset of the crop). The calibration is
# in fractions of the sensor's image.
DEPTH_MODES = {
    (320, 288): (512, (96, 90)),
    (640, 576): (1024, (192, 180)),
    (512, 512): (512, (0, 0)),
    (1024, 1024): (1024, (0, 0)),
}
COLOR_SIZES = ((1280, 720), (1920, 1080), (2560, 1440), (2048, 1536), (3840, 2160), (4096, 3072))
DEPTH_AT, COLOR_AT = "CALIBRATION_CameraLocationD0", "CALIBRATION_CameraLocationPV0"
BROWN_CONRADY = "CALIBRATION_LensDistortionModelBrownConrady"


def azure_cameras(
    calibration: dict[str, Any], depth_size: tuple[int, int], color_size: tuple[int, int] | None
) -> RGBDCamera:
    """Cameras of a recording.

    Parameters
    ----------
    calibration : dict
        The recording's calibration.json.
    depth_size, color_size : (width, height)

    Raises
    ------
    ValueError
        A size of no mode, a lens model other than Brown-Conrady, or a wide view whose polynomial folds over.
    KeyError, TypeError
        A field is missing, or not of its kind.
    """
    cameras = {entry["Location"]: entry for entry in calibration["CalibrationInformation"]["Cameras"]}
    if depth_size not in DEPTH_MODES:
        known = ", ".join(f"{w} x {h}" for w, h in DEPTH_MODES)
        raise ValueError(f"depth of {depth_size[0]} x {depth_size[1]} pixels, expected one of {known}")
    side, offset = DEPTH_MODES[depth_size]
    depth = _camera(cameras[DEPTH_AT], (side, side), offset, depth_size)
    if color_size is None:
        return RGBDCamera(depth)
    if color_size not in COLOR_SIZES:
        known = ", ".join(f"{w} x {h}" for w, h in COLOR_SIZES)
        raise ValueError(f"colour of {color_size[0]} x {color_size[1]} pixels, expected one of {known}")
    full = (color_size[0], color_size[0] * 3 // 4)  # 16:9 modes are the middle of a 4:3 image
    color = _camera(cameras[COLOR_AT], full, (0, (full[1] - color_size[1]) // 2), color_size)
    T = _pose(cameras[COLOR_AT]["Rt"]) @ np.linalg.inv(_pose(cameras[DEPTH_AT]["Rt"]))
    return RGBDCamera(depth, color, T_color_depth=T)


def _camera(
    entry: dict[str, Any], full: tuple[int, int], offset: tuple[int, int], size: tuple[int, int]
) -> Camera:
    lens = entry["Intrinsics"]
    values = [float(value) for value in lens["ModelParameters"]]
    cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, codx, cody, p2, p1 = (*values, *[0.0] * 14)[:14]
    # The two models differ in the tangential part only, the other one by a factor of 2 of its mixed terms.
    if (lens["ModelType"] != BROWN_CONRADY and (p1 or p2)) or codx or cody:
        raise ValueError(f"lens model {lens['ModelType']}, expected {BROWN_CONRADY} about the image's centre")
    return Camera(
        fx * full[0],
        fy * full[1],
        cx * full[0] - offset[0] - 0.5,  # there, the first pixel's corner is 0; here, its centre
        cy * full[1] - offset[1] - 0.5,
        *size,
        (k1, k2, p1, p2, k3, k4, k5, k6),
    )


def _pose(Rt: dict[str, Any]) -> NDArray[np.float64]:
    """Maps points of the calibration's reference frame to the camera, m."""
    T = np.eye(4)
    T[:3, :3] = np.array(Rt["Rotation"], dtype=float).reshape(3, 3)
    T[:3, 3] = np.array(Rt["Translation"], dtype=float)
    return T
