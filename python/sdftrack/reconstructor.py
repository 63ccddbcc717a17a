# SPDX-License-Identifier: MIT
"""Reconstruct an unknown object while it is tracked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.places import one_place
from sdftrack.results import TrackResult
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker

__all__ = ["Reconstructor"]


class Reconstructor:
    def __init__(
        self,
        camera: Camera | RGBDCamera,
        initial: SDF | None = None,
        voxels: int = 200,
        extent: float | None = None,
        device: str = "auto",
        *,
        threads: int = 0,
        mode: str = "auto",
        evidence: str = "smooth",
        shape_every: int = 5,
        seen_least: float = 0.3,
        prior: float = 0.4,
        padding_m: float = 0.02,
        tracking: dict[str, Any] | None = None,
        **options: Any,
    ) -> None:
        self.camera = camera
        self._camera = depth_camera(camera)
        self.voxels, self.extent, self.threads, self.mode = voxels, extent, threads, mode
        self.shape_every, self.seen_least, self.prior, self.padding_m = (
            shape_every,
            seen_least,
            prior,
            padding_m,
        )
        self.tracking = tracking or {}
        self.options = _core.ReconstructionOptions()
        self.options.printed = evidence == "printed"
        for k, v in options.items():
            setattr(self.options, k, v)

    def start(self, frame: Frame, mask: ArrayLike | None = None) -> TrackResult:
        place = one_place(None, mask, None, self._camera)
        T, radius = _ball(frame.depth, place != 0, self._camera)
        extent = self.extent or 1.8 * 2 * radius
        n = self.voxels
        h = extent / (n - 1)
        origin = np.full(3, -extent / 2)
        g = origin[0] + h * np.arange(n, dtype=np.float32)
        inside = radius - np.sqrt(g[:, None, None] ** 2 + g[None, :, None] ** 2 + g[None, None, :] ** 2)
        prior = (self.prior * np.tanh(inside / (4 * h))).astype(np.float32)
        self._core = _core.Reconstruction([n] * 3, h, origin.tolist(), prior, self.options, self.threads)
        self._h, self._origin = h, origin
        ys, xs = np.nonzero(place)
        region = [
            max(0, int(xs.min()) - 25),
            max(0, int(ys.min()) - 25),
            min(self._camera.width, int(xs.max()) + 26),
            min(self._camera.height, int(ys.max()) + 26),
        ]
        rgb = None
        if frame.color is not None:
            rgb = np.ascontiguousarray(frame.color[region[1] : region[3], region[0] : region[2]])
        self._core.fuse(frame.depth, self._camera._core, T, region, np.ascontiguousarray(place), None, rgb)
        self._tracker = Tracker(
            SDF(np.array(self._core.phi), h, origin),
            self.camera,
            mode=self.mode,
            threads=self.threads,
            **self.tracking,
        )
        self._reshape()
        result = self._tracker.start(frame, poses=T)
        self._tracker.set_pose(0, T)
        self.index = 0
        return result

    def _reshape(self) -> None:
        self._tracker._core.reshape(
            0,
            (self._core.phi, self._h, self._origin.tolist()),
            self._core.seen,
            int(256 * self.seen_least),
            self._core.surface_boxes,
        )

    def track(self, frame: Frame) -> TrackResult:
        result = self._tracker.track(frame)
        self.index += 1
        if result.status[0] == "ok" or getattr(self, "fuse_weak", False):
            self.add(frame, result.poses[0])
            if self.index % self.shape_every == 0 or self.index < 10:
                self._reshape()
        return result

    def add(self, frame: Frame, T: NDArray[np.float64]) -> None:
        core = self._tracker._core
        region = core.region(0, T, self.padding_m)
        if region[2] - region[0] < 8 or region[3] - region[1] < 8:
            return
        foreground, rgb = core.look_at(frame.depth, *self._tracker._colors_of(frame), 0, region)
        self._core.fuse(frame.depth, self._camera._core, T, region, None, foreground, rgb)


def _ball(
    depth: NDArray[np.float32], mask: NDArray[np.bool_], camera: Camera
) -> tuple[NDArray[np.float64], float]:
    ys, xs = np.nonzero(mask & (depth > 0))
    z = float(np.median(depth[ys, xs]))
    radius = 0.5 * max(np.ptp(xs) / camera.fx, np.ptp(ys) / camera.fy) * z
    T = np.eye(4)
    zc = z + 0.6 * radius
    T[:3, 3] = [
        (0.5 * (xs.min() + xs.max()) - camera.cx) / camera.fx * zc,
        (0.5 * (ys.min() + ys.max()) - camera.cy) / camera.fy * zc,
        zc,
    ]
    return T, radius
