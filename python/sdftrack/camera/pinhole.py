# SPDX-License-Identifier: MIT
"""Cameras: pixel centres at integers, x right, y down, z forward; depth is z, not ray length."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import INT_MAX, detached, number, numbers, shown

_DISTORTION_LENGTHS = (0, 4, 5, 8)
NORMALISED, PICTURE = 4.0, 32  # all intrinsics below this are no pixels of an image with sides above that
LENS_TOLERANCE_PX = 0.01  # rays are float32 and the inverse is iterated: 1e-4 px where it converges


@dataclass(frozen=True)
class Camera:
    """Pinhole camera with OpenCV's Brown-Conrady lens, immutable.

    Parameters
    ----------
    fx, fy, cx, cy : float
        Focal lengths and principal point in pixels; the centre of the first pixel is (0, 0).
    width, height : int
        Size of the image in pixels.
    distortion : sequence of float, optional
        4, 5 or 8 numbers in OpenCV's order: k1 k2 p1 p2 [k3 [k4 k5 k6]]. All zero is the same as None.

    Raises
    ------
    ValueError
        fx or fy not positive, a non-finite value, a size below 1, normalised intrinsics, a wrong number of distortion
        coefficients, a lens polynomial that folds over inside the image.

    Examples
    --------
    >>> Camera(525, 525, 319.5, 239.5, 640, 480).project([[0.0, 0.0, 1.0]]).tolist()
    [[319.5, 239.5]]
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name in ("fx", "fy", "cx", "cy"):
            object.__setattr__(self, name, _finite(name, getattr(self, name)))
        for name in ("fx", "fy"):
            value = getattr(self, name)
            if value <= 0:
                raise ValueError(
                    f"{name}: expected a focal length above 0 px, got {value:g}; "
                    "a mirrored image has positive focal lengths too, with its own cx"
                )
        for name in ("width", "height"):
            object.__setattr__(self, name, _pixels(name, getattr(self, name)))
        if max(self.fx, self.fy, abs(self.cx), abs(self.cy)) < NORMALISED and min(self.shape) > PICTURE:
            raise ValueError(
                f"fx, fy, cx, cy: expected pixels, got {self.fx:g}, {self.fy:g}, {self.cx:g}, {self.cy:g} for "
                f"{self.width} x {self.height}; normalised intrinsics are multiplied by the image's width (fx, cx) and "
                "height (fy, cy)"
            )
        given = () if self.distortion is None else tuple(np.ravel(np.asarray(self.distortion)).tolist())
        if len(given) not in _DISTORTION_LENGTHS:
            raise ValueError(
                f"distortion: expected 4, 5 or 8 numbers (k1 k2 p1 p2 [k3 [k4 k5 k6]]), got {len(given)}"
            )
        lens = tuple(_finite(f"distortion[{i}]", k) for i, k in enumerate(given))
        object.__setattr__(self, "distortion", lens if any(lens) else ())
        if self.distortion:
            self._check_lens()

    def _check_lens(self) -> None:
        """Reject a polynomial that folds over inside the image: its border pixels would have no ray."""
        right, bottom = self.width - 1, self.height - 1
        for u in (0, right / 2, right):
            for v in (0, bottom / 2, bottom):
                # The one pixel of this camera is the pixel (u, v).
                one = _core.Camera(self.fx, self.fy, self.cx - u, self.cy - v, 1, 1, list(self.distortion))
                x, y = one.rays()[0, 0].astype(np.float64)
                px = one.project(np.array([[x, y, 1.0]]))
                if not np.abs(px).max() < LENS_TOLERANCE_PX:
                    raise ValueError(
                        f"distortion: expected a lens that gives every pixel a ray, but {self.distortion} "
                        f"folds over before pixel ({u:g}, {v:g}); crop the image, or calibrate again with fewer "
                        "numbers and views that reach the corners"
                    )

    @cached_property
    def _core(self) -> Any:
        return _core.Camera(
            self.fx, self.fy, self.cx, self.cy, self.width, self.height, list(self.distortion)
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return Camera, (self.fx, self.fy, self.cx, self.cy, self.width, self.height, self.distortion)

    def __repr__(self) -> str:
        lens = f", distortion={self.distortion}" if self.distortion else ""
        return (
            f"Camera({self.width} x {self.height}, fx={self.fx:g}, fy={self.fy:g}, "
            f"cx={self.cx:g}, cy={self.cy:g}{lens})"
        )

    @property
    def K(self) -> NDArray[np.float64]:
        """(3, 3) float64 matrix of the pinhole, pixels."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width), the shape of this camera's images."""
        return self.height, self.width

    @classmethod
    def from_K(cls, K: ArrayLike, width: int, height: int, distortion: ArrayLike | None = None) -> Camera:
        """Camera from a (3, 3) matrix without skew; warns where it is likely that of an image of another size."""
        from sdftrack.camera.files import warn_if_doubtful

        camera = cls._from_K(K, width, height, distortion)
        warn_if_doubtful(camera, "K")
        return camera

    @classmethod
    def _from_K(cls, K: ArrayLike, width: int, height: int, distortion: ArrayLike | None = None) -> Camera:
        M = numbers(K, "K")
        if M.shape != (3, 3):
            raise ValueError(f"K: expected a 3 x 3 matrix, got shape {M.shape}")
        if not np.isfinite(M).all():
            raise ValueError("K: expected finite numbers, got NaN or infinity")
        if M[2, 2] != 1.0 or M[2, 0] != 0.0 or M[2, 1] != 0.0 or M[1, 0] != 0.0:
            raise ValueError(f"K: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels, got {M.tolist()}")
        if abs(M[0, 1]) > 1e-9 * abs(M[0, 0]):
            raise ValueError(f"K: expected no skew (K[0][1] = 0), got {M[0, 1]:g}; rectify the images first")
        lens = () if distortion is None else tuple(np.ravel(np.asarray(distortion, dtype=float)).tolist())
        return cls(M[0, 0], M[1, 1], M[0, 2], M[1, 2], width, height, lens)

    @classmethod
    def from_fov(cls, fov_x_rad: float, width: int, height: int) -> Camera:
        """Ideal camera with square pixels and a horizontal field of view of `fov_x_rad` radians, edge to edge."""
        fov_x_rad = _finite("fov_x_rad", fov_x_rad)
        width, height = _pixels("width", width), _pixels("height", height)
        if not 0.0 < 0.5 * fov_x_rad < 0.5 * math.pi:  # nor so small that its tangent is 0
            raise ValueError(f"fov_x_rad: expected radians between 0 and pi, got {fov_x_rad:g}")
        f = 0.5 * width / math.tan(0.5 * fov_x_rad)
        return cls(f, f, 0.5 * (width - 1), 0.5 * (height - 1), width, height)

    @classmethod
    def from_realsense(cls, intrinsics: Any) -> Camera:
        """Camera from a RealSense `intrinsics` object (by attributes; the SDK is not required). RealSense's
        `inverse_brown_conrady` maps distorted to ideal coordinates; it and `modified_brown_conrady` are converted by a
        fit that must agree within 0.3 px over the whole image, else ValueError. Lens models without such a conversion
        (f-theta, Kannala-Brandt) raise ValueError."""
        from sdftrack.camera.files import opencv_distortion_from_realsense

        i = intrinsics
        bare = cls(i.fx, i.fy, i.ppx, i.ppy, i.width, i.height)
        lens = opencv_distortion_from_realsense(str(i.model), tuple(float(c) for c in i.coeffs), bare)
        return cls(bare.fx, bare.fy, bare.cx, bare.cy, bare.width, bare.height, lens)

    @classmethod
    def from_ros(cls, camera_info: Any) -> Camera:
        """Camera of a ROS 1 or ROS 2 `sensor_msgs/CameraInfo` (read by attributes: K, D, sizes)."""
        from sdftrack.camera.files import camera_from_ros

        return camera_from_ros(cls, camera_info)

    def scaled(self, s: float) -> Camera:
        """Camera of the image resized by `s`: pixel (u, v) moves to s (u + 0.5) - 0.5; sizes are rounded."""
        s = _finite("s", s)
        sizes = self.width * s, self.height * s
        width, height = (round(size) if abs(size) <= INT_MAX else 0 for size in sizes)
        if s <= 0 or width < 1 or height < 1:
            raise ValueError(
                f"s: expected a factor that leaves 1 to 2^31 pixels a side, got {s:g} for {self!r}"
            )
        cx, cy = s * (self.cx + 0.5) - 0.5, s * (self.cy + 0.5) - 0.5
        return Camera(s * self.fx, s * self.fy, cx, cy, width, height, self.distortion)

    def cropped(self, x: int, y: int, w: int, h: int) -> Camera:
        """Camera of the crop `image[y:y + h, x:x + w]`, which must lie inside the image."""
        if not (
            0 <= x < self.width
            and 0 <= y < self.height
            and 1 <= w <= self.width - x
            and 1 <= h <= self.height - y
        ):
            raise ValueError(
                f"x, y, w, h: expected a rectangle inside {self.width} x {self.height}, got {shown((x, y, w, h))}"
            )
        return Camera(self.fx, self.fy, self.cx - x, self.cy - y, w, h, self.distortion)

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Pixels of points in this camera's frame.

        Parameters
        ----------
        points : (..., 3) array, m

        Returns
        -------
        (..., 2) float64 pixels (u, v); NaN where z is not positive. May lie outside the image.
        """
        p = np.asarray(detached(points), dtype=np.float64)
        if p.ndim == 0 or p.shape[-1] != 3:
            raise ValueError(f"points: expected shape (..., 3) in metres, got {p.shape}")
        flat = np.ascontiguousarray(p.reshape(-1, 3))
        front = flat[:, 2] > 0
        px = np.full((len(flat), 2), np.nan)
        px[front] = self._core.project(np.ascontiguousarray(flat[front]))
        return px.reshape(*p.shape[:-1], 2)

    @cached_property
    def rays(self) -> NDArray[np.float32]:
        """(H, W, 2) float32, read-only: x / z and y / z of every pixel's ray, distortion removed."""
        table: NDArray[np.float32] = self._core.rays()
        table.flags.writeable = False
        return table

    def back_project(self, depth: ArrayLike) -> NDArray[np.float64]:
        """Points of a depth image.

        Parameters
        ----------
        depth : (H, W) float array, m; 0 = no measurement

        Returns
        -------
        (H, W, 3) float64 points in this camera's frame, m; (0, 0, 0) where there is no depth.

        Raises
        ------
        TypeError
            An integer dtype: raw sensor units are not metres.
        ValueError
            The size differs from the camera's.
        """
        d = np.asarray(detached(depth))
        if d.dtype.kind != "f":
            raise TypeError(f"depth: expected float metres, got {d.dtype}; multiply by the depth scale first")
        if d.shape != self.shape:
            raise ValueError(f"depth: expected the camera's (height, width) = {self.shape}, got {d.shape}")
        points = np.empty((*self.shape, 3))
        points[..., 2] = np.where(np.isfinite(d) & (d > 0), d, 0.0)
        points[..., :2] = self.rays * points[..., 2:]
        return points

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a JSON file, completely or not at all."""
        from sdftrack.camera.files import save_camera

        save_camera(path, self)

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], width: int | None = None, height: int | None = None
    ) -> Camera:
        """Read a camera of our JSON, Open3D, BOP, RealSense, nerfstudio, ROS, Kalibr, OpenCV, or from cam_K.txt. The
        contents tell which; docs/data.md has the fields. `width` and `height` are required for a file that does not
        contain them; if it does, they must agree. FileNotFoundError, or ValueError stating what the file lacks. A
        warning where the intrinsics are likely those of an image of another size."""
        from sdftrack.camera.files import load_camera, warn_if_doubtful

        camera = load_camera(cls, Path(path), width, height)
        warn_if_doubtful(camera, os.fspath(path))
        return camera


def _pixels(name: str, value: Any) -> int:
    try:
        if not isinstance(value, bool) and int(value) == value and 0 < value <= INT_MAX:
            return int(value)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"{name}: expected a whole number of pixels above 0, got {value!r}")


def _finite(name: str, value: Any) -> float:
    out = number(value, name)
    if not math.isfinite(out):
        raise ValueError(f"{name}: expected a finite number, got {out}")
    return out
