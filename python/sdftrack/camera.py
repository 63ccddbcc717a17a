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
from sdftrack.checks import numbers

__all__ = ["Camera", "RGBDCamera", "depth_camera"]

_DISTORTION_LENGTHS = (0, 4, 5, 8)
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
        fx or fy not positive, a number not finite, a size below 1, another count of distortion numbers,
        a lens polynomial that folds over inside the image.

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
            value = getattr(self, name)
            if isinstance(value, bool) or int(value) != value or value < 1:
                raise ValueError(f"{name}: expected a whole number of pixels above 0, got {value!r}")
            object.__setattr__(self, name, int(value))
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
        """Refuse a polynomial that folds over inside the image: its border pixels would have no ray."""
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
        """Camera of a (3, 3) matrix without skew."""
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
        """Ideal camera with square pixels that sees `fov_x_rad` radians from edge to edge of the image."""
        if not 0.0 < fov_x_rad < math.pi:
            raise ValueError(f"fov_x_rad: expected radians between 0 and pi, got {fov_x_rad:g}")
        f = 0.5 * width / math.tan(0.5 * fov_x_rad)
        return cls(f, f, 0.5 * (width - 1), 0.5 * (height - 1), width, height)

    @classmethod
    def from_realsense(cls, intrinsics: Any) -> Camera:
        """Camera of a RealSense `intrinsics` object (read by attributes: the SDK is not needed).

        Their `inverse_brown_conrady` maps distorted coordinates to ideal ones; it and
        `modified_brown_conrady` are converted by a fit that must agree to 0.3 px over the whole image, else
        ValueError. Lens models without such a conversion (f-theta, Kannala-Brandt) raise ValueError.
        """
        from sdftrack.io.lenses import opencv_distortion_from_realsense

        i = intrinsics
        bare = cls(i.fx, i.fy, i.ppx, i.ppy, i.width, i.height)
        lens = opencv_distortion_from_realsense(str(i.model), tuple(float(c) for c in i.coeffs), bare)
        return cls(bare.fx, bare.fy, bare.cx, bare.cy, bare.width, bare.height, lens)

    @classmethod
    def from_ros(cls, camera_info: Any) -> Camera:
        """Camera of a ROS 1 or ROS 2 `sensor_msgs/CameraInfo` (read by attributes: K, D, sizes)."""
        from sdftrack.io.cameras import camera_from_ros

        return camera_from_ros(camera_info)

    def scaled(self, s: float) -> Camera:
        """Camera of this image resized by `s`: pixel (u, v) goes to s (u + 0.5) - 0.5, sizes are rounded."""
        s = _finite("s", s)
        width, height = round(self.width * s), round(self.height * s)
        if s <= 0 or width < 1 or height < 1:
            raise ValueError(f"s: expected a factor that leaves at least one pixel, got {s:g} for {self!r}")
        cx, cy = s * (self.cx + 0.5) - 0.5, s * (self.cy + 0.5) - 0.5
        return Camera(s * self.fx, s * self.fy, cx, cy, width, height, self.distortion)

    def cropped(self, x: int, y: int, w: int, h: int) -> Camera:
        """Camera of the part `image[y:y + h, x:x + w]`, which must lie inside the image."""
        if x < 0 or y < 0 or w < 1 or h < 1 or x + w > self.width or y + h > self.height:
            raise ValueError(
                f"x, y, w, h: expected a rectangle inside {self.width} x {self.height}, got {(x, y, w, h)}"
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
        p = np.asarray(points, dtype=np.float64)
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
            Whole numbers: raw sensor units are not metres.
        ValueError
            A size other than the camera's.
        """
        d = np.asarray(depth)
        if d.dtype.kind != "f":
            raise TypeError(f"depth: expected float metres, got {d.dtype}; multiply by the depth scale first")
        if d.shape != self.shape:
            raise ValueError(f"depth: expected the camera's (height, width) = {self.shape}, got {d.shape}")
        points = np.empty((*self.shape, 3))
        points[..., 2] = np.where(np.isfinite(d) & (d > 0), d, 0.0)
        points[..., :2] = self.rays * points[..., 2:]
        return points

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a small JSON file, whole or not at all."""
        from sdftrack.io.cameras import save_camera

        save_camera(path, self)

    @classmethod
    def load(
        cls, path: str | os.PathLike[str], width: int | None = None, height: int | None = None
    ) -> Camera:
        """Read a camera: our JSON, Open3D's intrinsic.json, BOP's camera.json, a ROS yaml or cam_K.txt.

        `width` and `height` are needed for cam_K.txt, which does not hold them; where the file does, they
        must agree. FileNotFoundError, or ValueError that says what the file lacks.
        """
        from sdftrack.io.cameras import load_camera

        return load_camera(Path(path), width, height)


@dataclass(frozen=True, eq=False)
class RGBDCamera:
    """A depth camera and the colour camera beside it.

    Parameters
    ----------
    depth : Camera
        The camera of the depth image; poses T_cam_obj are in its frame.
    color : Camera, optional
        The colour camera; None with no mapping: colour images are aligned to depth pixel by pixel.
    T_color_depth : (4, 4) array, optional
        Maps points of the depth camera to the colour camera, metres.
    projective : (P, q), optional
        The other form of the mapping: (y0, y1, y2) = P (u Z, v Z, Z) + q for depth pixel (u, v) and depth Z
        in metres; the colour pixel is (y0 / y2, y1 / y2). P is (3, 3), q is (3,).
    """

    depth: Camera
    color: Camera | None = None
    T_color_depth: NDArray[np.float64] | None = None
    projective: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    def __post_init__(self) -> None:
        for name in ("depth", "color"):
            value = getattr(self, name)
            if not isinstance(value, Camera) and not (name == "color" and value is None):
                raise TypeError(f"{name}: expected a Camera, got {type(value).__name__}")
        if self.T_color_depth is not None and self.projective is not None:
            raise ValueError("T_color_depth, projective: expected one of them, got both")
        if self.T_color_depth is not None:
            if self.color is None:
                raise ValueError("color: expected a Camera beside T_color_depth, got None")
            T = np.ascontiguousarray(self.T_color_depth, dtype=np.float64)
            object.__setattr__(self, "T_color_depth", _frozen(_core.nearest_rigid(T, "T_color_depth")))
        elif self.projective is not None:
            P, q = (np.array(a, dtype=np.float64) for a in self.projective)
            if P.shape != (3, 3) or q.shape != (3,) or not (np.isfinite(P).all() and np.isfinite(q).all()):
                raise ValueError(
                    f"projective: expected finite (P, q) of shapes (3, 3) and (3,), got {P.shape}, {q.shape}"
                )
            object.__setattr__(self, "projective", (_frozen(P), _frozen(q)))
        elif self.color is not None and self.color != self.depth:
            raise ValueError(
                "T_color_depth: expected the mapping to a colour camera that differs from the depth camera; "
                "pass T_color_depth= or projective=, or color=None for aligned images"
            )

    @classmethod
    def from_realsense(cls, profile: Any) -> RGBDCamera:
        """Cameras of a running RealSense pipeline's `profile` (depth and, if streamed, colour)."""
        from sdftrack.io.cameras import rgbd_camera_from_realsense

        return rgbd_camera_from_realsense(profile)

    @property
    def aligned(self) -> bool:
        """True where a colour pixel belongs to the depth pixel with the same coordinates."""
        return self.T_color_depth is None and self.projective is None

    @property
    def _core(self) -> Any:
        return self.depth._core

    def project_to_color(self, points: ArrayLike) -> NDArray[np.float64]:
        """Colour pixels (..., 2) of points (..., 3) in the depth camera's frame, m; NaN behind it."""
        p = np.asarray(points, dtype=np.float64)
        if self.T_color_depth is not None:
            assert self.color is not None
            return self.color.project(p @ self.T_color_depth[:3, :3].T + self.T_color_depth[:3, 3])
        px = self.depth.project(p)
        if self.projective is None:
            return px
        P, q = self.projective
        z = p[..., 2:3]
        y = np.concatenate([px * z, z], axis=-1) @ P.T + q
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(y[..., 2:3] > 0, y[..., :2] / y[..., 2:3], np.nan)

    def _key(self) -> tuple[Any, ...]:
        T = None if self.T_color_depth is None else self.T_color_depth.tobytes()
        Pq = None if self.projective is None else tuple(a.tobytes() for a in self.projective)
        return self.depth, self.color, T, Pq

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, RGBDCamera) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        if self.aligned:
            return f"RGBDCamera({self.depth!r}, colour aligned)"
        how = "T_color_depth" if self.projective is None else "projective"
        return f"RGBDCamera({self.depth!r}, color={self.color!r}, {how})"


def depth_camera(camera: Camera | RGBDCamera, name: str = "camera") -> Camera:
    """The camera of the depth image, from either kind; TypeError for anything else."""
    if isinstance(camera, RGBDCamera):
        return camera.depth
    if isinstance(camera, Camera):
        return camera
    raise TypeError(f"{name}: expected st.Camera or st.RGBDCamera, got {type(camera).__name__}")


def _finite(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number, got {type(value).__name__}") from None
    if not math.isfinite(number):
        raise ValueError(f"{name}: expected a finite number, got {number}")
    return number


def _frozen(a: NDArray[np.float64]) -> NDArray[np.float64]:
    a.flags.writeable = False
    return a
