# SPDX-License-Identifier: MIT
"""Interface of a tracker for other parts of this package, beyond its public methods."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.frame import Frame
from sdftrack.sdf import SDF
from sdftrack.tracking.core_conversion import core_frame

if TYPE_CHECKING:
    from sdftrack.imaging.pose_hint import Place
    from sdftrack.results import TrackResult
    from sdftrack.tracking.tracker import Tracker

Pose = NDArray[np.float64]


class ClickedPlace(NamedTuple):
    """Where a clicked object may be: a region (H, W) of the depth image, or a box that is searched in its place."""

    region: NDArray[np.bool_]
    box: tuple[int, int, int, int] | None

    @property
    def place(self) -> Place:
        """The hint of a start."""
        return self.region.view(np.uint8) if self.box is None else self.box


class TrackerInterface:
    """Internal access to a tracker, for shapes that change during tracking; objects are identified by index."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker

    @property
    def last_poses(self) -> NDArray[np.float64]:
        """(M, 4, 4): the last good ``T_cam_obj``, NaN if there was none yet."""
        return self._tracker._core.best

    @property
    def threads(self) -> int:
        """Number of threads of the tracker; 0: all cores."""
        return self._tracker.threads

    # -- shapes

    @property
    def shapes(self) -> list[SDF]:
        """The volumes that are tracked, a new list."""
        return list(self._tracker.shapes)

    def replace_shape(
        self,
        k: int,
        volume: tuple[NDArray[np.float32], float, list[float]],
        rgb_seen: NDArray[np.uint16],
        min_seen: int,
        boxes: NDArray[np.int32],
    ) -> None:
        """Give the only object another volume (values, voxel size and origin, m), in the object frame as it was.

        `rgb_seen` (z, y, x, 4): colours, and the observation weight near each voxel, which below `min_seen` is unknown;
        `boxes` (n, 6): voxels x0 y0 z0 x1 y1 z1 that hold the surface.
        """
        self._tracker._core.reshape(k, volume, rgb_seen[..., 3], min_seen, boxes, rgb_seen)

    def replace_shapes(self, shapes: list[SDF], poses: NDArray[np.float64]) -> None:
        """Replace the volumes of the objects; tracking continues from `poses` (M, 4, 4), NaN: unknown."""
        self._tracker._replace_shapes(shapes, poses)

    def mark_unfound(self, k: int, kind: str) -> None:
        """Mark object k as a placeholder for a primitive of this kind not found yet; "": it was found."""
        self._tracker._core.mark_unfound(k, kind)

    def is_sure(self, k: int) -> bool:
        """Whether object k is ok in the last frame, but for turns that the frame alone does not exclude."""
        return bool(self._tracker._core.is_sure(k))

    def alternative_poses(self, k: int) -> NDArray[np.float64]:
        """Other poses (n, 4, 4) of object k that explain the frames since its start as well."""
        return np.asarray(self._tracker._core.alternative_poses(k))

    def evidence(self, k: int) -> float:
        """Probability that it is object k that the last frame shows there, whatever its covariance leaves open."""
        return float(self._tracker._core.evidence(k))

    # -- starts

    def place_at_click(self, k: int, frame: Frame, px: tuple[float, float], name: str) -> ClickedPlace:
        """Return the search region for object k after a click on it; errors begin with `name`."""
        try:
            region, box = self._tracker._core.place_of_click(self._view(frame), k, px)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
        return ClickedPlace(region.view(bool), box)

    def check_mask_size(self, k: int, frame: Frame, mask: NDArray[np.bool_], name: str) -> None:
        """ValueError, which begins with `name`, if the measurements in a mask have another size than object k."""
        self._tracker._core.check_mask_size(self._view(frame), k, mask.view(np.uint8), name)

    def _view(self, frame: Frame) -> Any:
        tracker = self._tracker
        return tracker._core_frame(frame, tracker._camera_of(frame), tracker._colors_of(frame))

    def start_at(self, frame: Frame, places: list[Place]) -> TrackResult:
        """Start with hints of mixed types: a pose, mask, box or None for each object."""
        tracker = self._tracker
        return tracker._start_at(frame, tracker._camera_of(frame), tracker._colors_of(frame), places)

    # -- frames

    def core_frame(self, frame: Frame) -> _core.TrackerFrame:
        """A frame as the core takes it, with the colours that the tracker uses."""
        tracker = self._tracker
        return tracker._core_frame(frame, tracker._camera_of(frame), tracker._colors_of(frame))

    def wrapped(
        self, frame: Frame, view: _core.TrackerFrame, found: dict[str, Any], begin: float
    ) -> TrackResult:
        """The core's result of a frame, also of a reconstruction session that used this tracker."""
        return self._tracker._finish(frame, view, found, begin)

    def judge(self, k: int, frame: Frame, T_cam_obj: Pose) -> dict[str, Any]:
        """Assess object k at a fixed pose by depth; empty: too few measurements nearby."""
        said = self._tracker._core.judge(
            core_frame(frame, None, None, sensor=self._tracker.sensor), k, np.ascontiguousarray(T_cam_obj)
        )
        return {} if said is None else dict(said)

    def revisit(
        self, depth: NDArray[np.float32], color: NDArray[np.uint8] | None, color_map: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Track the objects in a frame outside the sequence; returns poses (M, 4, 4), and whether each is reliable."""
        poses, sure = self._tracker._core.revisit(
            core_frame(Frame(depth, check_units=False), color, color_map)
        )
        return poses, sure

    def relearn_colors(self, shown: Iterable[tuple[Frame, Pose]], index: int) -> None:
        """Learn the colours of a tracker that has a shape but no colours, from frames with known poses.

        Its pose must be set again afterwards; `index`: the index of the last frame from then on.
        """
        for n, (frame, T) in enumerate(shown):
            if n == 0:
                self._tracker.start(frame, poses=T)
            else:
                self._tracker.set_pose(0, T)
                self._tracker.track(frame)
        self._tracker._interrupt(index)
