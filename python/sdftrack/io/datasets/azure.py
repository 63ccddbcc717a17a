# SPDX-License-Identifier: MIT
"""Recordings of an Azure Kinect: a Matroska file with depth, colour and the factory calibration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.text_files import contents, parsed_json
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.io.datasets.pairing import Stream, StreamFrames
from sdftrack.io.datasets.sequence import Sequence, register
from sdftrack.io.datasets.video_images import Track, VideoFile
from sdftrack.io.frames import decode_color

CALIBRATION = "calibration.json"
METRES_PER_UNIT = 0.001
RAW = {"BGRA": 4.0, "NV12": 1.5, "YUY2": 2.0}  # bytes per pixel
MAGIC = b"\x1a\x45\xdf\xa3"
MARKS = (b"K4A_", CALIBRATION.encode())
SEARCHED = 1 << 22  # bytes; the recorder writes its tags and the calibration at the beginning
# Size of the depth image -> (side of the sensor's image at this binning, offset of the crop). The calibration is
# in fractions of the sensor's image.
DEPTH_MODES = {
    (320, 288): (512, (96, 90)),
    (640, 576): (1024, (192, 180)),
    (512, 512): (512, (0, 0)),
    (1024, 1024): (1024, (0, 0)),
}
COLOR_SIZES = ((1280, 720), (1920, 1080), (2560, 1440), (2048, 1536), (3840, 2160), (4096, 3072))
BROWN_CONRADY = "CALIBRATION_LensDistortionModelBrownConrady"


def _detect(root: Path) -> bool:
    if not root.is_file():
        return False
    with root.open("rb") as file:
        start = file.read(len(MAGIC))
        return start == MAGIC and any(mark in file.read(SEARCHED) for mark in MARKS)


@register("azure", "a file .mkv of an Azure Kinect", _detect)
def open_azure(path: Path) -> Sequence:
    with contents(path, f"a recording of an Azure Kinect with {CALIBRATION}"):
        return _sequence(path, VideoFile(path))


def _sequence(path: Path, file: VideoFile) -> Sequence:
    tracks = {track.name: track for track in file.tracks}
    depth, color = tracks.get("DEPTH"), tracks.get("COLOR")
    if depth is None:
        there = ", ".join(tracks) or "none"
        raise ValueError(f"the recording has no depth track, which the trackers require; its tracks: {there}")
    if CALIBRATION not in file.attachments:
        raise ValueError(f"the recording has no attachment {CALIBRATION}, with the cameras' intrinsics")
    calibration = parsed_json(file.attachments[CALIBRATION].rstrip(b"\0"), CALIBRATION)
    start_ns = int(file.tags.get("K4A_START_OFFSET_NS", 0))  # of the device's clock

    def stream(track: Track, decode: Callable[[Track, bytes], NDArray[Any]]) -> Stream:
        times = np.array([start_ns + packet.time_ns for packet in track.packets], dtype=np.float64)
        return Stream(1e-9 * times, lambda i: decode(track, bytes(track.read(i))))

    color_size, colors = None, None
    if color is not None and color.packets:
        color_size = (color.width, color.height)
        if not (_is_jpeg(color) or color.fourcc in RAW):
            codec = f"{color.codec} {color.fourcc}"
            raise ValueError(f"colour of codec {codec}, expected MJPG, BGRA, NV12 or YUY2")
        colors = stream(color, _color)
    camera = azure_cameras(calibration, (depth.width, depth.height), color_size)
    frames = StreamFrames(path.name, stream(depth, _depth), colors, METRES_PER_UNIT)

    def close() -> None:
        for track in file.tracks:
            track.close()

    return Sequence(frames, camera, layout="azure", name=path.stem, close=close)


def _is_jpeg(track: Track) -> bool:
    return track.codec == "mjpeg" or track.fourcc == "MJPG"


def _depth(track: Track, data: bytes) -> NDArray[np.uint16]:
    if len(data) != 2 * track.width * track.height:
        raise ValueError(f"a depth image of {len(data)} bytes, expected {2 * track.width * track.height}")
    return np.frombuffer(data, ">u2").reshape(track.height, track.width).astype(np.uint16)


def _color(track: Track, data: bytes) -> NDArray[Any]:
    import cv2

    w, h = track.width, track.height
    if _is_jpeg(track):
        image = decode_color(data, "the colour image")
        if image.shape != (h, w, 3):
            raise ValueError(f"a colour image of {image.shape[1]} x {image.shape[0]}, expected {w} x {h}")
        return image
    if len(data) != RAW[track.fourcc] * w * h:
        raise ValueError(f"a colour image of {len(data)} bytes, expected {RAW[track.fourcc] * w * h:g}")
    pixels = np.frombuffer(data, np.uint8)
    if track.fourcc == "BGRA":
        return np.ascontiguousarray(pixels.reshape(h, w, 4)[..., 2::-1])
    if track.fourcc == "NV12":
        return np.asarray(cv2.cvtColor(pixels.reshape(h * 3 // 2, w), cv2.COLOR_YUV2RGB_NV12))
    return np.asarray(cv2.cvtColor(pixels.reshape(h, w, 2), cv2.COLOR_YUV2RGB_YUY2))


DEPTH_AT, COLOR_AT = "CALIBRATION_CameraLocationD0", "CALIBRATION_CameraLocationPV0"


def azure_cameras(
    calibration: dict[str, Any], depth_size: tuple[int, int], color_size: tuple[int, int] | None
) -> RGBDCamera:
    """Cameras by the recording's calibration.json, for images of these sizes (width, height). ValueError for a size of
    no mode, a lens model other than Brown-Conrady, or a wide view whose polynomial folds over; KeyError or TypeError
    for a field that is missing, or not of its kind."""
    cameras = {entry["Location"]: entry for entry in calibration["CalibrationInformation"]["Cameras"]}
    for what, size, known in (("depth", depth_size, DEPTH_MODES), ("colour", color_size, COLOR_SIZES)):
        if size is not None and size not in known:
            modes = ", ".join(f"{w} x {h}" for w, h in known)
            raise ValueError(f"{what} of {size[0]} x {size[1]} pixels, expected one of {modes}")
    side, offset = DEPTH_MODES[depth_size]
    depth = _camera(cameras[DEPTH_AT], (side, side), offset, depth_size)
    if color_size is None:
        return RGBDCamera(depth)
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
    T = np.eye(4)
    T[:3, :3] = np.array(Rt["Rotation"], dtype=float).reshape(3, 3)
    T[:3, 3] = np.array(Rt["Translation"], dtype=float)
    return T
