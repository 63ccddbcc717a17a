# SPDX-License-Identifier: MIT
"""Camera files and messages of other programs. `make` is the camera class to create."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.files import write_json
from sdftrack._internal.text_files import contents, parsed_json, read_text

if TYPE_CHECKING:
    from sdftrack.camera.pinhole import Camera

KINDS = (
    "our camera.json, Open3D, BOP, RealSense, nerfstudio, ROS camera_info or topic echo, Kalibr, OpenCV FileStorage, "
    "cam_K.txt"
)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LINE = re.compile(r"(\s*(?:- )?)[\"']?([A-Za-z_][\w.-]*)[\"']?\s*:(?:\s+(.*))?$")
MATRICES = (
    "cam_k",
    "camera_matrix",
    "cameramatrix",
    "k",
    "k_depth",
    "intrinsics",
    "camera_intrinsics",
    "intrinsic",
)
LENSES = (
    "distortion",
    "distortion_coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "distcoeffs",
    "d",
    "dist",
)
MODELS = ("distortion_model", "camera_model", "model")
SIZES = (("width", "image_width", "w"), ("height", "image_height", "h"))
PAIRS = ("image_size", "resolution")  # width, height
NO_PINHOLE = ("fisheye", "equidistant", "kannala", "omni", "theta", "fov", "double", "eucm", "ds", "mei")
REALSENSE = (
    "none",
    "modified_brown_conrady",
    "inverse_brown_conrady",
    "ftheta",
    "brown_conrady",
    "kannala_brandt4",
)


def save_camera(path: str | os.PathLike[str], camera: Camera) -> None:
    names = ("fx", "fy", "cx", "cy", "width", "height")
    values = {name: getattr(camera, name) for name in names}
    write_json(path, {**values, "distortion": list(camera.distortion)})


def load_camera(make: type[Camera], path: Path, width: int | None, height: int | None) -> Camera:
    """The camera of a file, whose own size, if it has one, must be `width` x `height` where they are given."""
    camera = read_camera(make, path, width, height)
    for name, wanted in (("width", width), ("height", height)):
        if wanted is not None and wanted != getattr(camera, name):
            raise ValueError(
                f"{name}: {path} has {name} {getattr(camera, name)}, got {wanted}; "
                "omit it, or use .scaled() or .cropped()"
            )
    return camera


def read_camera(make: type[Camera], path: Path, width: int | None, height: int | None) -> Camera:
    """The camera of a file of any of `KINDS`, told by its contents; `width` and `height` where it has no size."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such camera file; expected {KINDS}")
    text = read_text(path)
    fields = _fields(text, path)
    if fields is None:
        return _from_matrix(make, path, text, width, height)
    with contents(path, KINDS):
        return _from_fields(make, _of_one_camera(fields), width, height)


def _fields(text: str, path: Path) -> dict[str, Any] | None:
    """The fields of JSON, XML or YAML; None of other text."""
    if text.lstrip().startswith("{") or path.suffix.lower() == ".json":
        fields = parsed_json(text, path)
        if not isinstance(fields, dict):
            raise ValueError(f"{path}: expected a JSON object ({KINDS})")
        return fields
    if text.lstrip().startswith("<?xml"):
        with contents(path, "XML of OpenCV's FileStorage"):
            return _of_xml(ElementTree.fromstring(text.lstrip()))
    return _of_yaml(text) or None


def _of_xml(element: ElementTree.Element) -> dict[str, Any]:
    return {
        e.tag: _of_xml(e) if len(e) else _value(f"[{e.text}]" if _is_list(e) else e.text or "")
        for e in element
    }


def _is_list(element: ElementTree.Element) -> bool:
    return element.tag == "data"


def _of_yaml(text: str) -> dict[str, Any]:
    """The fields of the first document of a camera's YAML, which needs no library: words, numbers, lists, matrices."""
    root: dict[str, Any] = {}
    open_at: list[tuple[int, dict[str, Any]]] = [(-1, root)]
    for line in text.splitlines():
        if line.strip() in ("---", "...") or line.startswith("%"):
            if root and line.strip() == "---":
                break
            continue
        field = _LINE.match(line)
        if field is None:
            open_at[-1][1][""] = f"{open_at[-1][1].get('', '')}\n{line.partition('#')[0]}"
            continue
        while open_at[-1][0] >= len(field[1]):
            open_at.pop()
        node = {"": re.sub(r"^!!\S+", "", field[3] or "").partition(" #")[0]}
        open_at[-1][1][field[2]] = node
        open_at.append((len(field[1]), node))
    return {key: _plain(node) for key, node in root.items() if key}


def _plain(node: dict[str, Any]) -> Any:
    children = {key: _plain(child) for key, child in node.items() if key}
    return children or _value(node[""])


def _value(text: str) -> Any:
    text = text.strip()
    if text.startswith(("[", "- ")):
        return [float(n) for n in re.findall(_NUMBER, text)]
    try:
        return float(text)
    except ValueError:
        return text.strip("\"'")


def _of_one_camera(fields: dict[str, Any]) -> dict[str, Any]:
    """The fields in small letters: those at the top, or of the only camera there, or of the one called depth."""
    own = {str(key).lower(): value for key, value in fields.items()}
    known = {"fx", "ppx", "fl_x", "intrinsic_matrix", "camera_angle_x", *MATRICES}
    if known & own.keys():
        return own
    cameras = {
        key: v for key, v in own.items() if isinstance(v, dict) and known & {str(k).lower() for k in v}
    }
    if len(cameras) > 1 and "depth" not in cameras:
        raise ValueError(f"several cameras, {', '.join(cameras)}; expected a file of the depth camera alone")
    return _of_one_camera(cameras.get("depth") or next(iter(cameras.values()))) if cameras else own


def _from_fields(make: type[Camera], d: dict[str, Any], width: int | None, height: int | None) -> Camera:
    pair = next((numbers_in(d[name]) for name in PAIRS if name in d), [])
    given = [next((d[name] for name in names if name in d), None) for names in SIZES]
    w, h = (v if v is not None else size for v, size in zip(given, pair or (width, height), strict=True))
    if w is None or h is None:
        raise KeyError("width" if w is None else "height")
    model = str(next((d[name] for name in MODELS if name in d), "")).lower()
    if "ppx" in d:
        kind = REALSENSE[int(model)] if model.isdecimal() else model or "none"
        coeffs = numbers_in(d.get("coeffs", [])) or [0.0] * 5
        return make.from_realsense(
            SimpleNamespace(**{**d, "width": w, "height": h, "model": kind, "coeffs": coeffs})
        )
    told = {
        word for key, value in d.items() if value for word in (str(key).lower(), model) if "fisheye" in word
    }
    if told or any(word in model if len(word) > 3 else word == model for word in NO_PINHOLE):
        raise ValueError(
            f"a fisheye lens ({model or ', '.join(told)}) is no pinhole; rectify the images first"
        )
    roi, binning = d.get("roi"), (d.get("binning_x", 0), d.get("binning_y", 0))
    _check_whole(tuple(roi.get(f"{a}_offset", 0) for a in "xy") if isinstance(roi, dict) else (), binning)
    return make._from_K(_matrix(d, w, h), cast(Any, w), cast(Any, h), _lens(d, model))


def _matrix(d: dict[str, Any], w: float, h: float) -> NDArray[np.float64]:
    if "intrinsic_matrix" in d:  # Open3D stores the matrix column by column
        return np.reshape(numbers_in(d["intrinsic_matrix"]), (3, 3)).T
    value = next((d[name] for name in MATRICES if name in d), d)
    if isinstance(value, dict) and "data" not in value:
        if "fl_x" not in d and "camera_angle_x" in d:
            f = 0.5 * w / math.tan(0.5 * d["camera_angle_x"])
            d = {"fl_x": f, "cx": 0.5 * (w - 1), "cy": 0.5 * (h - 1), **d}
        if "fl_x" in d:
            value = {"fx": d["fl_x"], "fy": d.get("fl_y", d["fl_x"]), **d}
        value = [value[name] for name in ("fx", "fy", "cx", "cy")]
    values = numbers_in(value)
    if len(values) == 4:  # Kalibr
        fx, fy, cx, cy = values
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    return np.reshape(values, (3, 3))


def _lens(d: dict[str, Any], model: str) -> tuple[float, ...]:
    k = d.get("k_depth")
    value = (
        k.get("distortion") if isinstance(k, dict) else next((d[name] for name in LENSES if name in d), None)
    )
    lens = [] if value is None else numbers_in(value)
    if value is None and any(d.get(name) for name in ("k1", "k2", "p1", "p2", "k3")):
        lens = [float(d.get(name, 0.0)) for name in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")]
        lens = lens if any(lens[5:]) else lens[:5]
    if "distortion_model" in d and model != "radtan":
        return distortion_from_ros(model, lens)
    return tuple(lens[:8]) if not any(lens[8:]) else tuple(lens)


def numbers_in(value: Any) -> list[float]:
    """The numbers of a list, of rows of them, or of a matrix with its `data`."""
    value = value.get("data", ()) if isinstance(value, dict) else value
    return [float(v) for v in np.ravel(np.asarray(value, dtype=float))]


def _from_matrix(make: type[Camera], path: Path, text: str, width: int | None, height: int | None) -> Camera:
    try:
        values = [float(v) for v in re.sub(r"[\[\],;]", " ", text).split()]
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
    _check_whole(offset, binning)
    lens = distortion_from_ros(str(info.distortion_model), D)
    return make._from_K(K, info.width, info.height, lens)


def _check_whole(offset: tuple[Any, ...], binning: tuple[Any, ...]) -> None:
    if any(offset) or any(b > 1 for b in binning):
        raise ValueError(
            f"camera_info: expected a full image, got roi offset {offset} and binning {binning}; "
            "build the full camera and use .cropped() and .scaled()"
        )
