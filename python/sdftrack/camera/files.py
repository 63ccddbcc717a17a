# SPDX-License-Identifier: MIT
"""Camera files and messages of other programs. `make` is the camera class to create."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sdftrack._internal.files import write_json
from sdftrack._internal.text_files import contents, read_json, read_text

if TYPE_CHECKING:
    from sdftrack.camera.pinhole import Camera

KINDS = "our camera.json, Open3D intrinsic.json, BOP camera.json, ROS camera_info yaml, cam_K.txt"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


def save_camera(path: str | os.PathLike[str], camera: Camera) -> None:
    names = ("fx", "fy", "cx", "cy", "width", "height")
    values = {name: getattr(camera, name) for name in names}
    write_json(path, {**values, "distortion": list(camera.distortion)})


def load_camera(make: type[Camera], path: Path, width: int | None, height: int | None) -> Camera:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such camera file; expected {KINDS}")
    if path.suffix.lower() == ".json":
        camera = _from_json(make, path, width, height)
    elif path.suffix.lower() in (".yaml", ".yml"):
        camera = _from_yaml(make, path)
    else:
        camera = _from_matrix(make, path, width, height)
    for name, wanted in (("width", width), ("height", height)):
        if wanted is not None and wanted != getattr(camera, name):
            raise ValueError(
                f"{name}: {path} has {name} {getattr(camera, name)}, got {wanted}; "
                "omit it, or use .scaled() or .cropped()"
            )
    return camera


def _from_json(make: type[Camera], path: Path, width: int | None, height: int | None) -> Camera:
    d = read_json(path)
    if not isinstance(d, dict):
        raise ValueError(f"{path}: expected a JSON object ({KINDS})")
    with contents(path, KINDS):
        if "intrinsic_matrix" in d:  # Open3D stores the matrix column by column
            K = np.asarray(d["intrinsic_matrix"], dtype=float).reshape(3, 3).T
            return make._from_K(K, d["width"], d["height"])
        if "K_depth" in d:
            k = d["K_depth"]
            w, h = d["image_size"]
            return make(k["fx"], k["fy"], k["cx"], k["cy"], w, h, tuple(k.get("distortion") or ()))
        w, h = d.get("width", width), d.get("height", height)
        if w is None or h is None:
            raise KeyError("width" if w is None else "height")
        return make(d["fx"], d["fy"], d["cx"], d["cy"], w, h, tuple(d.get("distortion") or ()))


def _from_yaml(make: type[Camera], path: Path) -> Camera:
    """The camera_info files of ROS' calibrator, parsed without a YAML library."""
    text = read_text(path)

    def scalar(name: str) -> str | None:
        found = re.search(rf"^\s*{name}\s*:\s*[\"']?([\w.+-]+)", text, re.MULTILINE)
        return found.group(1) if found else None

    def numbers(name: str) -> list[float]:
        block = re.search(rf"^{name}\s*:(.*?)(?=^\S|\Z)", text, re.MULTILINE | re.DOTALL)
        data = re.search(r"data\s*:(.*)", block.group(1), re.DOTALL) if block else None
        return [float(n) for n in re.findall(_NUMBER, data.group(1))] if data else []

    width, height, K = scalar("image_width"), scalar("image_height"), numbers("camera_matrix")
    if width is None or height is None or len(K) != 9:
        raise ValueError(
            f"{path}: expected ROS' camera_info fields image_width, image_height and camera_matrix with "
            "9 numbers in data"
        )
    with contents(path, "ROS' camera_info"):
        lens = distortion_from_ros(scalar("distortion_model") or "", numbers("distortion_coefficients"))
        return make._from_K(np.reshape(K, (3, 3)), int(width), int(height), lens)


def _from_matrix(make: type[Camera], path: Path, width: int | None, height: int | None) -> Camera:
    try:
        values = [float(v) for v in read_text(path).replace(",", " ").split()]
    except ValueError:
        raise ValueError(f"{path}: expected {KINDS}") from None
    if len(values) != 9:
        raise ValueError(f"{path}: expected the 9 numbers of K, got {len(values)}; known files: {KINDS}")
    if width is None or height is None:
        raise ValueError(f"width, height: {path} holds K alone; pass width= and height= of its images")
    with contents(path, "the 9 numbers of K"):
        return make._from_K(np.reshape(values, (3, 3)), width, height)


def distortion_from_ros(model: str, D: Any) -> tuple[float, ...]:
    """OpenCV's coefficients of a lens; ValueError for a model that they do not describe.

    A fisheye lens (equidistant) is refused also with coefficients of zero, because it is no pinhole then either. An
    empty name stands for a pinhole, as drivers without a calibration leave it.
    """
    lens = tuple(float(k) for k in D)
    sizes = {"plumb_bob": (4, 5), "rational_polynomial": (8,)}
    if not any(lens) and (model in sizes or model.lower() in ("", "none")):
        return ()
    if len(lens) not in sizes.get(model, ()):
        raise ValueError(
            f"distortion_model: expected plumb_bob (4 or 5 numbers) or rational_polynomial (8), got "
            f"{model!r} with {len(lens)}; rectify the images and use their rectified camera"
        )
    return lens


def camera_from_ros(make: type[Camera], info: Any) -> Camera:
    K = np.asarray(info.K if hasattr(info, "K") else info.k, dtype=float).reshape(3, 3)
    D = info.D if hasattr(info, "D") else info.d
    roi = getattr(info, "roi", None)
    offset = (getattr(roi, "x_offset", 0), getattr(roi, "y_offset", 0))
    binning = (getattr(info, "binning_x", 0), getattr(info, "binning_y", 0))
    if any(offset) or any(b > 1 for b in binning):
        raise ValueError(
            f"camera_info: expected a full image, got roi offset {offset} and binning {binning}; "
            "build the full camera and use .cropped() and .scaled()"
        )
    lens = distortion_from_ros(str(info.distortion_model), D)
    return make._from_K(K, info.width, info.height, lens)
