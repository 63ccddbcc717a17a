# SPDX-License-Identifier: MIT
"""What is computed of one frame for the page, and what it shows over time."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import quaternion
from sdftrack.camera import depth_camera
from sdftrack.contour.drawing import draw_outline
from sdftrack.mesh import Mesh
from sdftrack.viz.overlay import OBJECT_RGB, backdrop, draw

MAX_POINTS = 30_000  # 0.5 MB a frame
FAR = 2.5  # points farther than so many distances of the objects are left out: a hall hides the table
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shown:
    """What one call of `Viewer.show` hands over."""

    frame: Any
    result: Any
    shapes: list[Any]
    names: list[str]
    latency_s: float | None
    dropped: int | None
    mask: NDArray[np.bool_] | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Number of objects."""
        return 0 if self.result is None else len(self.result.poses)


def object_rgb(k: int) -> tuple[int, int, int]:
    """Colour of object `k`, in the overlay and in the 3-D view."""
    return OBJECT_RGB[k % len(OBJECT_RGB)]


def overlay(shown: Shown, camera: Any) -> NDArray[np.uint8]:
    """(H, W, 3) uint8 RGB: the frame with outlines, axes and statuses."""
    if shown.mask is not None and shown.result is not None:
        return draw_outline(backdrop(shown.frame, camera), shown.mask, str(shown.result.status[0]))
    if shown.result is None:
        return backdrop(shown.frame, camera)
    return draw(shown.frame, shown.result, shown.shapes, camera, names=shown.names)


def cloud(frame: Any, camera: Any, distance_m: float) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Points (N, 3) of the depth image, camera frame, m, and their colours (N, 3) RGB; N <= about `MAX_POINTS`."""
    if frame.depth is None:
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8)
    lens = depth_camera(camera)
    step = cloud_step(frame.depth.size)
    z = frame.depth[::step, ::step]
    seen = (z > 0) & (z < FAR * distance_m)
    xy = lens.rays[::step, ::step][seen]
    z = z[seen]
    colors = backdrop(frame, camera)[::step, ::step][seen]
    return np.column_stack([xy * z[:, None], z]).astype(np.float32), colors


def cloud_step(pixels: int) -> int:
    """Every n-th pixel in rows and columns is shown."""
    return max(1, int(np.ceil(np.sqrt(pixels / MAX_POINTS))))


def ellipsoid(covariance: Array) -> tuple[Array, Array] | None:
    """Axes of three standard deviations (3,), m, and rotation (3, 3) of a position's error; None if unknown."""
    # `covariance`: 6 x 6 as in `TrackResult`, of which the position's 3 x 3 are used.
    position = np.asarray(covariance, np.float64)[:3, :3]
    if not np.isfinite(position).all():
        return None
    variances, axes = np.linalg.eigh(position)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return 3 * np.sqrt(np.maximum(variances, 0)), axes


def wxyz(R: Array) -> Array:
    """Unit quaternion (w, x, y, z) of a rotation (3, 3)."""
    return quaternion(R)[[3, 0, 1, 2]]


def trail_segments(positions: Sequence[Array]) -> NDArray[np.float32]:
    """(N, 2, 3) line segments between successive positions; NaN ends a line."""
    p = np.asarray(positions, np.float32).reshape(-1, 3)
    segments = np.stack([p[:-1], p[1:]], axis=1)
    return segments[np.isfinite(segments).all(axis=(1, 2))]


MAX_FACES = 60_000  # a browser turns more, but a page takes seconds to load them
FEWER_FACES = 30_000


class MeshShape:
    """A mesh with what `draw` asks a shape for, so that a result is shown without building volumes."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.bounds = mesh.bounds

    def render(self, camera: Any, T_cam_obj: Any) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        return self.mesh.raycast(camera, T_cam_obj)[:2]

    def to_mesh(self) -> Mesh:
        return self.mesh


def light_mesh(mesh: Mesh) -> Mesh:
    """The mesh, simplified if it is large and the extra ``export`` is there."""
    if len(mesh.faces) <= MAX_FACES:
        return mesh
    try:
        return mesh.decimated(FEWER_FACES)
    except (ImportError, ValueError):
        return mesh


KEPT = 600  # frames: 20 s at 30 Hz
RATE_FRAMES = 30


class History:
    """The last frames of one run; kept while no page is open, so that a page shows them when it opens."""

    def __init__(self) -> None:
        self._rows: deque[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = deque(maxlen=KEPT)
        self._times: deque[float] = deque(maxlen=RATE_FRAMES)
        self._began: float | None = None
        self._filled = False
        self._lock = threading.Lock()

    def add(self, result: Any) -> None:
        """Add a frame's result (None: a frame without one)."""
        now = time.monotonic()
        with self._lock:
            self._began = now if self._began is None else self._began
            self._times.append(now)
            if result is not None and not self._filled:
                self._rows.append(_row(now - self._began, result))

    def fill(self, results: Sequence[Any]) -> None:
        """The results of a finished run, over the number of the frame; later ones are not added."""
        rows = [_row(float(i), result) for i, result in enumerate(results) if result is not None]
        with self._lock:
            self._rows, self._filled = deque(rows), True

    def rate_hz(self) -> float | None:
        """Frames per second of the last frames; None before the second."""
        with self._lock:
            if len(self._times) < 2 or self._times[-1] == self._times[0]:
                return None
            return (len(self._times) - 1) / (self._times[-1] - self._times[0])

    def positions(self, k: int) -> NDArray[np.float64]:
        """(N, 3) m, NaN where object `k` was lost or not there."""
        with self._lock:
            rows = list(self._rows)
        gone = np.full(3, np.nan)
        return np.array([p[k] if k < len(p) else gone for _, p, _ in rows]).reshape(-1, 3)

    def confidences(self, count: int) -> tuple[NDArray[np.float64], ...]:
        """Times (s since the first frame; in a finished run the numbers of frames), and confidences of `count` objects.

        NaN where unknown.
        """
        with self._lock:
            rows = list(self._rows)
        times = np.array([t for t, _, _ in rows], np.float64)
        return times, *(
            np.array([c[k] if k < len(c) else np.nan for _, _, c in rows], np.float64) for k in range(count)
        )


def _row(at: float, result: Any) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    known = np.array([str(s) in ("ok", "weak") for s in result.status])
    return at, np.where(known[:, None], result.poses[:, :3, 3], np.nan), np.array(result.confidence)
