# SPDX-License-Identifier: MIT
"""What other parts of this package ask of a tracker beyond its public methods."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.frame import Frame
from sdftrack.sdf import SDF
from sdftrack.tracking.core_conversion import core_frame

if TYPE_CHECKING:
    from sdftrack.imaging.pose_hint import Place
    from sdftrack.results import TrackResult
    from sdftrack.tracking.start_by_click import StartHypothesis
    from sdftrack.tracking.tracker import Tracker

__all__ = ["PixelEvidence", "TrackerInterface"]

Pose = NDArray[np.float64]


class PixelEvidence(NamedTuple):
    """What a frame shows in a region of depth pixels.

    Attributes
    ----------
    foreground : (h, w) float32
        The chance by colour that a pixel is the object's; NaN: not known.
    rgb : (h, w, 3) uint8 or None
        The colours; None: the frame has none.
    """

    foreground: NDArray[np.float32]
    rgb: NDArray[np.uint8] | None


class TrackerInterface:
    """The inside of one tracker, for shapes that change while they are tracked; objects go by their number."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker

    @property
    def last_poses(self) -> NDArray[np.float64]:
        """(M, 4, 4): the last good ``T_cam_obj``, NaN where there was none yet."""
        return self._tracker._core.best

    @property
    def threads(self) -> int:
        """Of the tracker; 0: all cores."""
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
        least_seen: int,
        boxes: NDArray[np.int32],
    ) -> None:
        """Give the only object another volume, in the object frame as it was.

        Parameters
        ----------
        volume : values, voxel size and origin (m)
        rgb_seen : (z, y, x, 4) uint16
            Colours, and how much of the surface was seen near each voxel; less than `least_seen` is unknown.
        boxes : (n, 6) int32
            Voxels x0 y0 z0 x1 y1 z1 that hold the surface.
        """
        self._tracker._core.reshape(k, volume, rgb_seen[..., 3], least_seen, boxes, rgb_seen)

    def replace_shapes(self, shapes: list[SDF], poses: NDArray[np.float64]) -> None:
        """Give the same objects other volumes; `poses` (M, 4, 4): where they go on from, NaN: not known."""
        self._tracker._replace_shapes(shapes, poses)

    def mark_unfound(self, k: int, kind: str) -> None:
        """Say that object k stands for a primitive of this kind that is not found yet; "": it is found."""
        self._tracker._core.mark_unfound(k, kind)

    # -- starts

    def hypothesis_at_click(
        self, k: int, frame: Frame, px: tuple[float, float], name: str
    ) -> StartHypothesis:
        """Where to look for object k after a click on it; errors begin with `name`."""
        from sdftrack.tracking.start_places import hypothesis_at_click

        return hypothesis_at_click(self._tracker, k, frame, px, name)

    def start_at(self, frame: Frame, places: list[Place]) -> TrackResult:
        """Start with places of mixed kinds: pose, mask, box or None for each object."""
        tracker = self._tracker
        return tracker._start_at(frame, tracker._camera_of(frame), tracker._colors_of(frame), places)

    # -- frames

    def region(self, k: int, T_cam_obj: Pose, padding_m: float) -> tuple[int, int, int, int]:
        """Where object k, padded, may be seen at a pose: depth pixels x0, y0, x1, y1, half open."""
        x0, y0, x1, y1 = self._tracker._core.region(k, T_cam_obj, padding_m)
        return x0, y0, x1, y1

    def pixel_evidence(self, k: int, frame: Frame, region: tuple[int, int, int, int]) -> PixelEvidence:
        """What a frame with depth says in a region by the colours that object k is known by."""
        given = core_frame(frame, *self._tracker._colors_of(frame), sensor=self._tracker.sensor)
        return PixelEvidence(*self._tracker._core.look_at(given, k, region))

    def judge(self, k: int, frame: Frame, T_cam_obj: Pose) -> dict[str, Any]:
        """What would be said of object k at a pose as it is, by depth; empty: too few readings are near."""
        said = self._tracker._core.judge(
            core_frame(frame, None, None, sensor=self._tracker.sensor), k, np.ascontiguousarray(T_cam_obj)
        )
        return {} if said is None else dict(said)

    def revisit(
        self, depth: NDArray[np.float32], color: NDArray[np.uint8] | None, color_map: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Follow the objects into a frame outside of the sequence: poses (M, 4, 4), and whether each is sure."""
        poses, sure = self._tracker._core.revisit(
            core_frame(Frame(depth, check_units=False), color, color_map)
        )
        return poses, sure

    def relearn_colors(self, shown: Iterable[tuple[Frame, Pose]], index: int) -> None:
        """Show a tracker that has its shape but no colours frames with their poses.

        Where it stands afterwards is to be set anew; `index`: of the last frame from then on.
        """
        for n, (frame, T) in enumerate(shown):
            if n == 0:
                self._tracker.start(frame, poses=T)
            else:
                self._tracker.set_pose(0, T)
                self._tracker.track(frame)
        self._tracker._interrupt(index)
