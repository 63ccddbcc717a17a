# SPDX-License-Identifier: MIT
"""A depth camera with a colour camera, and the mapping from depth to colour pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.rotations import rigid_pose
from sdftrack.camera.pinhole import Camera


@dataclass(frozen=True, eq=False)
class RGBDCamera:
    """A depth camera and a colour camera in a fixed relative pose.

    Parameters
    ----------
    depth : Camera
        Camera of the depth image; poses T_cam_obj are in its frame.
    color : Camera, optional
        The colour camera; None with no mapping: colour images are aligned to depth pixel by pixel.
    T_color_depth : (4, 4) array, optional
        Maps points of the depth camera to the colour camera, metres.
    projective : (P, q), optional
        Alternative form of the mapping: (y0, y1, y2) = P (u Z, v Z, Z) + q for depth pixel (u, v) and depth Z in
        metres; the colour pixel is (y0 / y2, y1 / y2). P is (3, 3), q is (3,).
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
            object.__setattr__(self, "T_color_depth", _frozen(rigid_pose(T, "T_color_depth")))
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
        streams = {}
        for stream in profile.get_streams():
            kind = str(stream.stream_type()).rsplit(".", 1)[-1]
            if kind in ("depth", "color"):
                streams[kind] = stream.as_video_stream_profile()
        if "depth" not in streams:
            raise ValueError("profile: expected a pipeline that streams depth; enable rs.stream.depth")
        depth = Camera.from_realsense(streams["depth"].get_intrinsics())
        if "color" not in streams:
            return cls(depth)
        extrinsics = streams["depth"].get_extrinsics_to(streams["color"])
        T = np.eye(4)
        T[:3, :3] = np.asarray(extrinsics.rotation, dtype=float).reshape(3, 3).T  # stored column by column
        T[:3, 3] = extrinsics.translation
        return cls(depth, Camera.from_realsense(streams["color"].get_intrinsics()), T_color_depth=T)

    @property
    def aligned(self) -> bool:
        """Whether colour and depth pixels with the same coordinates correspond."""
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
    """The camera of the depth image, from either type; TypeError for other types."""
    if isinstance(camera, RGBDCamera):
        return camera.depth
    if isinstance(camera, Camera):
        return camera
    raise TypeError(f"{name}: expected st.Camera or st.RGBDCamera, got {type(camera).__name__}")


def color_map(camera: Camera | RGBDCamera, color: NDArray[np.uint8]) -> Any:
    """The core's mapping from depth pixels to the pixels of `color`, (h, w, 3). A Camera, or an RGBDCamera without a
    mapping, means that colour is aligned to depth. ValueError if `color` does not have the size of the camera (for
    aligned colour: of the depth image)."""
    depth, size = depth_camera(camera), color.shape[:2]
    rig = camera if isinstance(camera, RGBDCamera) and not camera.aligned else None
    if rig is None:
        if size != depth.shape:
            raise ValueError(
                f"color: expected the size of the depth image, {depth.width} x {depth.height}, because the camera "
                f"says that colour is aligned to depth, got {size[1]} x {size[0]}; give the tracker an RGBDCamera "
                "with T_color_depth or projective, or resize the colour image"
            )
        return _core.ColorMap.aligned(depth.width, depth.height)
    if rig.color is not None and size != rig.color.shape:
        raise ValueError(
            f"color: expected the colour camera's size {rig.color.width} x {rig.color.height}, got "
            f"{size[1]} x {size[0]}; scale the colour camera with Camera.scaled"
        )
    if rig.T_color_depth is not None:
        assert rig.color is not None
        return _core.ColorMap.rigid(depth._core, rig.color._core, rig.T_color_depth)
    assert rig.projective is not None
    P, q = rig.projective
    return _core.ColorMap.projective(np.ascontiguousarray(P), np.ascontiguousarray(q), size[1], size[0])


def _frozen(a: NDArray[np.float64]) -> NDArray[np.float64]:
    a.flags.writeable = False
    return a
