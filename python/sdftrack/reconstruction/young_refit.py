# SPDX-License-Identifier: MIT
"""Re-estimation of the early shape and its poses on a separate thread while tracking continues."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.reconstruction.colors import learn_colors
from sdftrack.reconstruction.keyframe import Keyframe
from sdftrack.reconstruction.misfit import Judge
from sdftrack.reconstruction.refining import refine, track_again
from sdftrack.reconstruction.volume import Lattice, Volume
from sdftrack.tracking import Tracker

__all__ = ["AGAIN", "YoungRefit", "frames_taken"]

Pose = NDArray[np.float64]

ROUNDS = 2
AGAIN = 2.7  # a second refit begins after so many times the frames of the first
POSE_VOXELS = 200  # at most along a side, of the volume in which poses are found
EVERY = 2  # of the frames, fused into the new volume: on another core it has to keep pace with the camera
USUAL_VOXELS = 128  # at which a refit of n frames takes about as long as tracking n more
# A correction is small; another pose of a shape that has several that look alike is none.
MAX_MOVED_M, MAX_TURNED_RAD = 0.01, np.deg2rad(8.0)


def frames_taken(frames: int, voxels: int) -> int:
    """Number of further frames after which a refit is adopted: fixed in advance, independent of the thread's timing."""
    return max(1, round(frames * (voxels / USUAL_VOXELS) ** 2))


def coarser(lattice: Lattice, voxels: int) -> Lattice:
    """The same extent with at most this many voxels along a side."""
    scale = max(1.0, (max(lattice.voxels) - 1) / (voxels - 1))
    x, y, z = (int(np.ceil((n - 1) / scale)) + 1 for n in lattice.voxels)
    return Lattice((x, y, z), scale * lattice.voxel_m, lattice.origin)


class Refitted(NamedTuple):
    """The new volume, the pose of each frame, and `correction`, by which the last pose must be multiplied."""

    volume: Volume
    poses: dict[int, Pose]
    correction: Pose


class YoungRefit:
    """Re-estimates poses and shape of the first frames, then tracks the frames received meanwhile.

    It works on private copies, so neither side changes the other's data. The result depends on the given frames, not on
    timing.

    Parameters
    ----------
    keyframes : list of Keyframe
        The frames so far.
    volume : Volume
        The volume into which they were fused; only its grid and settings are used.
    new_tracker : callable
        Creates a tracker for this object.
    reshape : callable
        Sets a tracker's shape to that of a volume.
    index : int
        Index of the last frame.
    """

    def __init__(
        self,
        keyframes: list[Keyframe],
        volume: Volume,
        new_tracker: Callable[[], Tracker],
        reshape: Callable[[Tracker, Volume], None],
        index: int,
    ) -> None:
        self._keyframes = [replace(k, T_cam_obj=k.T_cam_obj.copy()) for k in keyframes]
        self._before = {k.index: k.T_cam_obj for k in keyframes}
        self._place, self._camera, self._index = volume.lattice, volume.camera, index
        self._empty = volume.emptied
        self._new_tracker, self._reshape = new_tracker, reshape
        self._tracker: Any = None
        self._volume: Any = None
        self._cancelled = False
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="sdftrack-refit")
        self._work: list[Future[None]] = [self._pool.submit(self._refit)]

    def add(self, keyframe: Keyframe) -> None:
        """Add a frame that was fused meanwhile, to be tracked against the new shape too."""
        self._before[keyframe.index] = keyframe.T_cam_obj
        copy = replace(keyframe, T_cam_obj=keyframe.T_cam_obj.copy())
        self._work.append(self._pool.submit(self._follow, copy))

    def finish(self) -> Refitted | None:
        """The result; None if it does not explain the frames better. Waits for the thread."""
        try:
            for work in self._work:
                work.result()
        finally:
            self.cancel()
        if self._volume is None:
            return None
        return Refitted(self._volume, {k.index: k.T_cam_obj for k in self._keyframes}, self._correction())

    def cancel(self) -> None:
        """Cancel: the thread ends after its current frame; does not wait for it."""
        self._cancelled = True
        self._pool.shutdown(wait=False, cancel_futures=True)

    # -- on the thread

    @property
    def _size(self) -> tuple[int, int]:
        return self._camera.height, self._camera.width

    def _go_on(self) -> None:
        if self._cancelled:
            raise CancelledError

    def _correction(self) -> Pose:
        last = self._keyframes[-1]
        return np.asarray(np.linalg.solve(self._before[last.index], last.T_cam_obj))

    def _fused(self, lattice: Lattice, every: int) -> Volume:
        volume = self._empty(lattice)
        for keyframe in self._keyframes[::every]:
            self._go_on()
            volume.fuse(keyframe, keyframe.full_depth(*self._size))
        return volume

    def _refit(self) -> None:
        place = coarser(self._place, POSE_VOXELS)
        coarse = self._fused(place, 1)
        tracker = self._tracker = self._new_tracker()
        self._reshape(tracker, coarse)
        learn_colors(tracker, self._keyframes, self._camera, self._index)
        before = [k.T_cam_obj.copy() for k in self._keyframes]
        shape = coarse.shape(1)
        judge = Judge(self._keyframes, shape, self._camera)
        was_m = judge.misfit_m(shape)

        def fuse_all(progress: Callable[[float], None]) -> None:
            nonlocal coarse
            coarse = self._fused(place, 1)
            self._reshape(tracker, coarse)

        refine(self._keyframes, tracker, self._size, fuse_all, ROUNDS, lambda share: self._go_on())
        better = judge.misfit_m(coarse.shape(1)) < was_m
        if not better or _far(before, [k.T_cam_obj for k in self._keyframes]):
            self._tracker = None
            return
        self._volume = self._fused(self._place, EVERY)
        self._reshape(tracker, self._volume)

    def _follow(self, keyframe: Keyframe) -> None:
        if self._volume is None:
            return
        keyframe.T_cam_obj = keyframe.T_cam_obj @ self._correction()
        track_again(keyframe, self._tracker, self._size)
        self._keyframes.append(keyframe)
        if len(self._keyframes) % EVERY:
            return
        self._volume.fuse(keyframe, keyframe.full_depth(*self._size))
        self._volume.grow_if_needed()
        self._reshape(self._tracker, self._volume)


def _far(before: list[Pose], now: list[Pose]) -> bool:
    from sdftrack.metrics import pose_error

    off = np.array([pose_error(a, b) for a, b in zip(now, before, strict=True)])
    return bool((off.max(axis=0) > (MAX_MOVED_M, MAX_TURNED_RAD)).any())
