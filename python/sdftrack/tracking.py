# SPDX-License-Identifier: MIT
"""Track known shapes in depth images."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.device import resolve_device
from sdftrack.frame import Frame
from sdftrack.options import TrackerOptions
from sdftrack.results import Status, Step, TrackResult
from sdftrack.sdf import SDF

__all__ = ["Tracker"]


class Tracker:
    """Track one or more known shapes, each from its last pose, by depth.

    Parameters
    ----------
    shapes : SDF or sequence of SDF
        The objects; the same SDF twice is stored once.
    camera : Camera or RGBDCamera
        Of the depth images. A frame's own ``camera`` goes before it.
    mode : {"auto", "depth"}
        ``"auto"`` is ``"depth"`` in this version.
    device : {"auto", "cpu", "cuda"}
        Where the work runs; the tracker itself runs on the CPU in this version.
    threads : int
        0: all cores. The result has the same bits for any number.
    recover : bool
        A lost object is looked for around its last pose in every later frame.
    motion : {"static"}
        Prediction from frame to frame.
    names : sequence of str, optional
        One per shape, for reports.
    options : TrackerOptions, optional
        A whole set of options; single ones may be given as keywords.

    Raises
    ------
    TypeError
        A shape that is not an SDF; an unknown option (the nearest name is suggested).
    ValueError
        No shape, or an option out of range.
    RuntimeError
        ``device="cuda"`` without it; one tracker used by two threads at once.

    Notes
    -----
    The method is derived in docs/math/depth_tracker.md (thesis, section 3.4; ray-hit residual, outlier floor and
    free-space term are additions). ``TrackerOptions.printed()`` selects the source's own form.

    >>> tracker = Tracker(sdf, camera)                              # doctest: +SKIP
    >>> result = tracker.start(frame, poses=[T_cam_obj])            # doctest: +SKIP
    >>> result = tracker.track(next_frame); result.pose, result.status  # doctest: +SKIP
    """

    def __init__(
        self,
        shapes: SDF | Sequence[SDF],
        camera: Camera | RGBDCamera,
        mode: str = "auto",
        device: str = "auto",
        *,
        threads: int = 0,
        recover: bool = True,
        motion: str = "static",
        membership: bool = False,
        names: Sequence[str] | None = None,
        options: TrackerOptions | None = None,
        **single_options: Any,
    ) -> None:
        self.shapes = _shape_list(shapes)
        self.camera = camera
        self.options = (options or TrackerOptions()).replace(**single_options)
        self.names = (
            [f"object {k}" for k in range(len(self.shapes))] if names is None else [str(n) for n in names]
        )
        if len(self.names) != len(self.shapes):
            raise ValueError(f"names: expected one per shape ({len(self.shapes)}), got {len(self.names)}")
        _expect("mode", mode, ("auto", "depth"))
        _expect("motion", motion, ("static",))
        if membership:
            raise ValueError("membership: expected False; soft memberships are not part of this version")
        if isinstance(threads, bool) or not isinstance(threads, int) or threads < 0:
            raise ValueError(f"threads: expected 0 (all cores) or a number of threads, got {threads!r}")
        resolve_device(device)
        self.mode = "depth"
        self.threads = threads
        self.recover_lost = recover
        self._frame_camera = depth_camera(camera)
        self._core = _core.Tracker(
            [(s.values, s.voxel_size, s.origin.tolist()) for s in self.shapes],
            self._frame_camera._core,
            self.options._to_core(),
            threads,
        )
        self._index = -1
        self._last: TrackResult | None = None

    def __repr__(self) -> str:
        return f"Tracker({len(self.shapes)} shape{'s' * (len(self.shapes) != 1)}, {self._frame_camera!r})"

    def start(
        self,
        frame: Frame,
        poses: ArrayLike | Sequence[ArrayLike] | None = None,
        *,
        masks: Any = None,
        boxes: Any = None,
    ) -> TrackResult:
        """Begin, or begin again, from known poses, which are refined on this frame.

        Parameters
        ----------
        frame : Frame
        poses : sequence of (4, 4) float64, one per shape; for one shape the matrix itself will do
            ``T_cam_obj``, metres. Projected onto the rigid ones when within 1e-3 of one.
        masks, boxes
            A search without a pose is not part of this version.

        Returns
        -------
        TrackResult
            With ``index`` 0.

        Raises
        ------
        ValueError
            No poses, not one per shape, not finite or not rigid.
        """
        if poses is None:
            asked = "masks" if masks is not None else "boxes" if boxes is not None else "none"
            raise ValueError(f"poses: expected one T_cam_obj per shape, got {asked}; a start without poses is not "
                             "part of this version")  # fmt: skip
        T = self._pose_list(poses)
        self._index = 0
        self._last = None
        self._best = np.stack(T)
        for k, pose in enumerate(T):
            self._core.set_pose(k, pose)
        return self._run(frame, T)

    def track(self, depth: Frame | ArrayLike, color: ArrayLike | None = None) -> TrackResult:
        """Follow the objects into the next frame.

        Parameters
        ----------
        depth : Frame, or (H, W) float32 m (0 = none)
            The frame, or its depth image.
        color : (H, W, 3) uint8, optional
            Kept for later versions; only depth is used.

        Returns
        -------
        TrackResult
            A lost object keeps its last good pose, and is looked for there in the next frame. An unreadable or
            empty frame is ``"bad_frame"``, not an exception.

        Raises
        ------
        RuntimeError
            Before :meth:`start`.
        """
        if self._index < 0:
            raise RuntimeError("track: call start(frame, poses=[...]) first")
        self._index += 1
        return self._run(depth if isinstance(depth, Frame) else Frame(depth, color), None)

    def set_pose(self, k: int, T: ArrayLike) -> None:
        """Replace object k's last pose: ``T_cam_obj``, (4, 4), metres."""
        if not 0 <= k < len(self.shapes):
            raise ValueError(f"k: expected 0..{len(self.shapes) - 1}, got {k}")
        self._core.set_pose(k, _core.nearest_rigid(np.ascontiguousarray(T, dtype=np.float64), "T"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write shapes, camera, options and last poses to one file (pickle), whole or not at all."""
        from sdftrack.io.files import write_whole

        write_whole(path, lambda file: pickle.dump(self, file))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Tracker:
        """Read what :meth:`save` wrote. Only open files that you trust: this is a pickle."""
        with open(path, "rb") as file:
            tracker = pickle.load(file)
        if not isinstance(tracker, Tracker):
            raise ValueError(f"{os.fspath(path)}: expected a saved Tracker, got {type(tracker).__name__}")
        return tracker

    def __reduce__(self) -> tuple[Any, ...]:
        kwargs = {
            "names": self.names,
            "options": self.options,
            "threads": self.threads,
            "recover": self.recover_lost,
        }
        return _rebuild, (self.shapes, self.camera, kwargs, self._index, self._last)

    def _pose_list(self, poses: Any) -> list[NDArray[np.float64]]:
        if isinstance(poses, np.ndarray) and poses.ndim == 2:
            poses = [poses]
        T = [np.ascontiguousarray(p, dtype=np.float64) for p in poses]
        if len(T) != len(self.shapes):
            raise ValueError(f"poses: expected one per shape ({len(self.shapes)}), got {len(T)}")
        return [_core.nearest_rigid(p, f"poses[{k}]") for k, p in enumerate(T)]

    def _run(self, frame: Frame, poses: list[NDArray[np.float64]] | None) -> TrackResult:
        begin = time.perf_counter()
        if frame.depth is None:
            why = frame.error or "the frame has no depth image"
            return self._finish(frame, [self._bad(k, why) for k in range(len(self.shapes))], begin)
        camera = depth_camera(frame.camera) if frame.camera is not None else depth_camera(self.camera)
        if frame.depth.shape != (camera.height, camera.width):
            raise ValueError(
                f"depth: expected the camera's size {camera.width} x {camera.height}, got "
                f"{frame.depth.shape[1]} x {frame.depth.shape[0]}; scale the camera with Camera.scaled"
            )
        if camera != self._frame_camera:
            self._core.set_camera(camera._core)
            self._frame_camera = camera
        mask = None if frame.mask is None else np.ascontiguousarray(frame.mask).view(np.uint8)
        found = (
            self._core.track(frame.depth, mask)
            if poses is None
            else self._core.start(frame.depth, mask, poses)
        )
        return self._finish(frame, found, begin)

    def _bad(self, k: int, why: str) -> dict[str, Any]:
        nan = np.full((6, 6), np.nan)
        return {"pose": self._best[k], "covariance": nan, "status": "bad_frame", "reason": why, "inliers": 0.0,
                "confidence": 0.0, "energy": 0.0, "steps": []}  # fmt: skip

    def _finish(self, frame: Frame, found: list[dict[str, Any]], begin: float) -> TrackResult:
        poses = np.stack([f["pose"] for f in found])
        status = [Status(f["status"]) for f in found]
        steps = [[Step(*s) for s in f["steps"]] for f in found]
        result = TrackResult(
            poses=poses,
            status=status,
            reason=[f["reason"] for f in found],
            confidence=np.array([f["confidence"] for f in found]),
            covariances=np.stack([f["covariance"] for f in found]),
            twists=_twists(self._last, poses, status, frame.timestamp),
            inliers=np.array([f["inliers"] for f in found]),
            energy=float(np.mean([f["energy"] for f in found])),
            iterations=sum(len(s) for s in steps),
            steps=steps,
            seconds=time.perf_counter() - begin,
            timestamp=frame.timestamp,
            index=self._index,
        )
        self._best = poses
        self._last = result
        return result


def _rebuild(
    shapes: list[SDF],
    camera: Camera | RGBDCamera,
    kwargs: dict[str, Any],
    index: int,
    last: TrackResult | None,
) -> Tracker:
    tracker = Tracker(shapes, camera, **kwargs)
    tracker._index, tracker._last = index, last
    if last is not None:
        tracker._best = last.poses
        for k, T in enumerate(last.poses):
            tracker._core.set_pose(k, np.ascontiguousarray(T))
    return tracker


def _shape_list(shapes: SDF | Sequence[SDF]) -> list[SDF]:
    many = [shapes] if isinstance(shapes, SDF) else list(shapes)
    if not many:
        raise ValueError("shapes: expected at least one SDF, got none")
    for k, shape in enumerate(many):
        if not isinstance(shape, SDF):
            raise TypeError(
                f"shapes[{k}]: expected an SDF, got {type(shape).__name__}; make one with SDF.from_mesh"
            )
    return many


def _expect(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ValueError(f"{name}: expected one of {known} in this version, got {value!r}")


def _twists(
    last: TrackResult | None, poses: NDArray[np.float64], status: list[Status], timestamp: float | None
) -> NDArray[np.float64]:
    """(v, w) from the last result to this one, camera axes about the object's origin."""
    twists = np.full((len(poses), 6), np.nan)
    if last is None or last.timestamp is None or timestamp is None or not timestamp > last.timestamp:
        return twists
    for k, (now, before) in enumerate(zip(poses, last.poses, strict=True)):
        if {status[k], last.status[k]} <= {Status.OK, Status.WEAK}:
            turn = np.eye(4)
            turn[:3, :3] = now[:3, :3] @ before[:3, :3].T
            step = np.concatenate([now[:3, 3] - before[:3, 3], _core.rotation_log(turn)])
            twists[k] = step / (timestamp - last.timestamp)
    return twists
