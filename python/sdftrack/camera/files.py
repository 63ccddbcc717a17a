# SPDX-License-Identifier: MIT
"""Cameras of other programs (`make` is the class to create): files, messages, RealSense's lens models; and intrinsics
that are unlikely those of the image."""

from __future__ import annotations

import math
import os
import re
import warnings
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
    from sdftrack.camera.rgbd import RGBDCamera

KINDS = (
    "our camera.json, Open3D, BOP, RealSense, nerfstudio, ROS camera_info or topic echo, Kalibr, OpenCV FileStorage, "
    "cam_K.txt"
)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LINE = re.compile(r"(\s*(?:- )?)[\"']?([A-Za-z_][\w.-]*)[\"']?\s*:(?:\s+(.*))?$")
MATRICES = (
    "cam_k", "camera_matrix", "cameramatrix", "k", "k_depth", "intrinsics", "camera_intrinsics", "intrinsic",
)  # fmt: skip
LENSES = (
    "distortion", "distortion_coefficients", "distortion_coeffs", "dist_coeffs", "distcoeffs", "d", "dist",
)  # fmt: skip
MODELS = ("distortion_model", "camera_model", "model")
SIZES = (("width", "image_width", "w"), ("height", "image_height", "h"))
PAIRS = ("image_size", "resolution")  # width, height
NO_PINHOLE = ("fisheye", "equidistant", "kannala", "omni", "theta", "fov", "double", "eucm", "ds", "mei")
REALSENSE = (
    "none", "modified_brown_conrady", "inverse_brown_conrady", "ftheta", "brown_conrady", "kannala_brandt4",
)  # fmt: skip


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
    if text.lstrip().startswith("{") or path.suffix.lower() == ".json":
        fields = parsed_json(text, path)
        if not isinstance(fields, dict):
            raise ValueError(f"{path}: expected a JSON object ({KINDS})")
    elif text.lstrip().startswith("<?xml"):
        with contents(path, "XML of OpenCV's FileStorage"):
            fields = _of_xml(ElementTree.fromstring(text.lstrip()))
    else:
        fields = _of_yaml(text)
        if not fields:
            return _from_matrix(make, path, text, width, height)
    with contents(path, KINDS):
        return _from_fields(make, _of_one_camera(fields), width, height)


def _of_xml(element: ElementTree.Element) -> dict[str, Any]:
    def value(e: ElementTree.Element) -> Any:
        return _of_xml(e) if len(e) else _value(f"[{e.text}]" if e.tag == "data" else e.text or "")

    return {e.tag: value(e) for e in element}


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
    """OpenCV's coefficients of a lens; ValueError for a model that they do not describe. A fisheye lens (equidistant)
    is refused also with coefficients of zero, because it is no pinhole then either. An empty name stands for a pinhole,
    as drivers without a calibration leave it."""
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
    u, v = np.meshgrid(np.linspace(0, camera.width - 1, 33), np.linspace(0, camera.height - 1, 25))
    xy = np.column_stack([(u.ravel() - camera.cx) / camera.fx, (v.ravel() - camera.cy) / camera.fy])
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


def _polynomial(xy: Array, c: tuple[float, ...], radial_first: bool) -> Array:
    r2 = (xy**2).sum(1, keepdims=True)
    radial = xy * (1 + r2 * (c[0] + r2 * (c[1] + r2 * c[4])))
    x, y = (radial if radial_first else xy).T
    # RealSense takes r^2 of the undistorted point in both models.
    return radial + np.column_stack(
        [2 * c[2] * x * y + c[3] * (r2[:, 0] + 2 * x * x), 2 * c[3] * x * y + c[2] * (r2[:, 0] + 2 * y * y)]
    )


def _fit(ideal: Array, distorted: Array) -> tuple[float, ...]:
    """k1 k2 p1 p2 k3 k4 k5 k6 by least squares. distorted = ideal N / D + t with N, D polynomials in r^2; multiplied by
    D, it is linear in all unknowns except the product D t, where D is taken from the previous iteration."""
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


MIN_FOCAL = 0.1  # of the width: a field of view of 157 degrees, beyond what a pinhole model describes
OTHER_SCALE = 1.5  # times the middle of the image, or less than 1 / 1.5 of it
EQUAL = 0.12  # by which both coordinates of the principal point may differ in that ratio
OFF_MIDDLE = 0.1  # of the half image; calibrated principal points are nearer to the middle
NEAR_SIZE = 0.05  # of twice the principal point, to the size of a common image
# Width and height of the images of common cameras, colour and depth.
COMMON_SIZES = (
    (320, 240), (424, 240), (480, 270), (512, 424), (640, 360), (640, 400), (640, 480), (640, 576), (800, 600),
    (848, 480), (960, 540), (1024, 768), (1024, 1024), (1280, 720), (1280, 800), (1280, 960), (1280, 1024),
    (1440, 1080), (1600, 1200), (1920, 1080), (1920, 1200), (1920, 1440), (2048, 1536), (2560, 1440), (3840, 2160),
    (4032, 3024), (4096, 3072),
)  # fmt: skip


def doubt_of(camera: Camera) -> str:
    """Why the intrinsics are unlikely those of an image of this size, in one sentence; "" where they may be. A
    principal point off the middle is right in a crop, as :meth:`Camera.cropped` makes it; to be asked only of cameras
    from files and of matrices."""
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
    for common in COMMON_SIZES:
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
