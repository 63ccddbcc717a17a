# SPDX-License-Identifier: MIT
"""Reconstruction of a shape while it is tracked: the public class."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.thread_guard import ReentrantLock, one_thread
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack._internal.validation import whole as whole_number
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.device import device_number, resolve_device
from sdftrack.frame import Frame
from sdftrack.imaging.pose_hint import one_place
from sdftrack.mesh import Mesh
from sdftrack.options import TrackerOptions
from sdftrack.reconstruction import quality, refining, resuming, saved_state
from sdftrack.reconstruction.arguments import (
    check_beginning,
    check_settings,
    find_object,
    printed_tracker_options,
    shape_of,
    voxels_of,
)
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.reconstruction.refining import FAR_M, OVERFIT, Judge, Keyframe, Refined, learn_colors
from sdftrack.results import TrackResult
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker
from sdftrack.tracking.interface import TrackerInterface

Pose = NDArray[np.float64]
STAND_IN_VOXELS = 24
ROUNDS = 3

alone = one_thread("reconstructor")
briefly = one_thread("reconstructor", "brief")
reading = one_thread("reconstructor", "reads")

# What may have been meant where a keyword is neither an argument nor an option.
KEYWORDS = ("initial", "voxels", "extent", "device", "mode", "threads", "options", "tracker_options")


class Reconstructor:
    """Reconstruct an unknown rigid object from a depth or RGB-D camera while tracking it.

    Parameters
    ----------
    camera : Camera or RGBDCamera
        As in :class:`sdftrack.Tracker`.
    initial : SDF, optional
        A coarse shape of the object or its category, used as a prior for unobserved parts. None: a ball fitted to the
        mask.
    voxels : int or {"quick", "normal", "fine"}
        Number of voxels along each side of the volume, 16 to 512; 20 bytes each (200: 160 MB). The names stand for 96,
        200 and 300.
    extent : float, optional
        Side of the volume, m. None: 1.8 times the ball's diameter. The volume grows if the shape reaches its border.
    device : {"auto", "cpu", "cuda", "cuda:N"}
        On a GPU the volume stays there (21 bytes for each voxel), and the shape, the mesh and what is saved are copied
        back. The results are those of the CPU but for rounding, and for pixels that a shape fused again counts.
        ``"auto"``: a GPU that has passed its self-test, otherwise the CPU; see `sdftrack.device.resolve_device`.
    mode : {"auto", "depth", "rgbd"}
        Images used for tracking, as in :class:`sdftrack.Tracker`; colours also separate the object from a hand that
        holds it.
    threads : int
        0: all cores. The result has the same bits for any number.
    options : ReconstructorOptions, optional
        A whole set of options; single ones may be given as keywords.
    tracker_options : TrackerOptions, optional
        Options of the internal tracker. Default: ``outline=False, smooth_colors=False``, because the outline of a
        growing shape is not final, and measurements in front of guessed parts may belong to the object; with
        ``evolution="printed"``, those of ``TrackerOptions.printed()`` without limits for the status ``"weak"``.

    Raises
    ------
    TypeError, ValueError
        A wrong type, an unknown option (the nearest name is suggested), a number out of range.

    Notes
    -----
    The object frame has the axes of the first frame's camera and its origin at the centre of the ball, or is that of
    `initial`. Poses are relative to the first frame; that frame is placed again once (`settle_after`).
    docs/math/reconstruction.md derives the method (thesis, section 4.5).

    A viewer's thread may call `shape`, `mesh`, `quality` or `save` while another tracks: each waits for the other.
    Otherwise, two threads at once are an error.

    >>> star = Reconstructor(camera)                              # doctest: +SKIP
    >>> star.start(frames[0], mask=mask)                          # doctest: +SKIP
    >>> poses = [star.track(frame).pose for frame in frames[1:]]  # doctest: +SKIP
    >>> star.mesh().save("object.ply")                            # doctest: +SKIP
    """

    def __init__(
        self,
        camera: Camera | RGBDCamera,
        initial: SDF | None = None,
        voxels: int | str = 200,
        extent: float | None = None,
        device: str = "auto",
        *,
        mode: str = "auto",
        threads: int = 0,
        options: ReconstructorOptions | None = None,
        tracker_options: TrackerOptions | None = None,
        **single_options: Any,
    ) -> None:
        self.camera = camera
        self._frame_camera = depth_camera(camera)
        voxels = voxels_of(voxels)
        check_settings(initial, voxels, extent, device, mode)
        self.initial, self.voxels, self.extent = initial, int(voxels), extent
        self.mode, self.threads = mode, threads
        self.device, self._any_device = resolve_device(device), device == "auto"
        refuse_unknown(single_options, [*ReconstructorOptions.__dataclass_fields__, *KEYWORDS])
        self.options = (options or ReconstructorOptions()).replace(**single_options)
        self.tracker_options = tracker_options or (
            printed_tracker_options() if self._printed else TrackerOptions(outline=False, smooth_colors=False)
        )
        self._lock = ReentrantLock()
        self._session: _core.ReconstructionSession | None = None
        self._tracker: Tracker | None = None

    def __repr__(self) -> str:
        state = f"{self._volume.fused} frames fused" if self._session is not None else "not started"
        return f"Reconstructor({self.voxels} voxels, {state})"

    # -- tracking and fusing

    @alone
    def start(
        self, frame: Frame, mask: ArrayLike | None = None, *, box: Any = None, pose: ArrayLike | None = None
    ) -> TrackResult:
        """Start or restart with a frame in which the location of the object is given.

        Parameters
        ----------
        frame : Frame
        mask : (H, W) bool or uint8
            Nonzero on the object, aligned with the depth image.
        box : (x, y, w, h)
            Instead of the mask: the connected surface at its centre is the object.
        pose : (4, 4) float64
            Instead of both, with `initial`: its ``T_cam_obj``.

        Returns
        -------
        TrackResult
            The pose of the first frame is exact by definition, because it defines the object frame.

        Raises
        ------
        ValueError
            None or several of mask, box and pose; no depth on the object; a mask of the whole image; an object larger
            than `extent`.
        """
        check_beginning(frame, self._frame_camera, mask, box, pose, self.initial)
        begin = time.perf_counter()
        place = one_place(pose, mask, box, self._frame_camera)
        options = self.options
        if self._printed:  # the thesis removes no planes, and lets the shape extend beyond the mask
            options = options.replace(planes=False, keep_to_mask=False)
        found = find_object(frame, place, self._frame_camera, self.initial, options)
        return self._begin(frame, found, begin)

    def _begin(self, frame: Frame, found: _core.Beginning, begin: float) -> TrackResult:
        """Reset and start with a frame; `begin`: the time of the call."""
        session = self._new_session(found)
        tracker = self._new_tracker(session)
        inside = TrackerInterface(tracker)
        view = inside.core_frame(frame)
        result = inside.wrapped(frame, view, session.start(tracker._core, view, tracker.names), begin)
        self._session, self._tracker = session, tracker
        return self._finished(result, begin)

    @alone
    def resume(
        self, frame: Frame, mask: ArrayLike | None = None, *, box: Any = None, pose: ArrayLike | None = None
    ) -> TrackResult:
        """Continue with the same object in another recording, in which it may rest on another side.

        The known shape is searched for in the frame, and the following frames extend it, so that the side it rested on
        is observed as well. Only a reliable pose is accepted. Otherwise nothing changes: the status is ``"weak"`` or
        ``"lost"``, the reason explains why, and `track` continues as before; try another frame, or give the pose.

        If called before :meth:`start`, with `initial` (the ``shape.npz`` of another run), that shape is searched for
        and serves as the prior of the reconstruction; which of its parts were observed is unknown.

        Parameters
        ----------
        frame : Frame
            The first frame of the other recording, from the same camera.
        mask, box
            Location of the object in it, as in :meth:`start`.
        pose : (4, 4) float64
            Instead of both: its approximate ``T_cam_obj`` there.

        Returns
        -------
        TrackResult
            Its index continues that of the previous frames.

        Raises
        ------
        RuntimeError
            Called before :meth:`start` without `initial`.
        ValueError
            As in :meth:`start`; a mask or box of something much larger or smaller than the shape.

        Notes
        -----
        The table and the mask of this frame bound what its recording adds, as those of the first frame did in its
        recording (docs/math/reconstruction.md, section 6). Earlier observations are kept.
        """
        if self._printed:
            raise ValueError(
                "resume: expected evolution='ours', got 'printed', which supports only one recording"
            )
        if self.initial is None:
            self._started("resume")
        check_beginning(frame, self._frame_camera, mask, box, pose, known=True)
        begin = time.perf_counter()
        place = one_place(pose, mask, box, self._frame_camera)
        if self._tracker is None and self.initial is not None:
            search = Tracker(self.initial, self.camera, mode=self.mode, device="cpu", threads=self.threads)
            result, shown = resuming.begin_with(search, frame, place, self._frame_camera, self.options)
            return result if shown is None else self._begin(frame, shown, begin)
        session, tracker, shape = self._begun, self._new_tracker(self._begun), self.shape
        session.show_shape(tracker._core)
        learn_colors(tracker, self._kept, self._frame_camera, self._index)
        result, shown = resuming.begin_again(
            tracker, shape, self.mesh(), self._volume.core, frame, place, self._frame_camera, self.options
        )
        if shown is None:
            return self._finished(replace(result, shape_change=float("nan")), begin)
        view = TrackerInterface(tracker).core_frame(frame)
        found = session.resume(tracker._core, view, shown, pose is None, tracker.names)
        self._tracker = tracker
        poses = np.array(result.poses)
        poses[0] = shown.T_cam_obj
        return self._finished(replace(result, poses=poses, shape_change=found["shape_change"]), begin)

    @briefly
    def track(self, depth: Frame | ArrayLike, color: ArrayLike | None = None) -> TrackResult:
        """Track the object in the next frame, and fuse the frame if the pose is reliable.

        Returns
        -------
        TrackResult
            M = 1, with ``shape_change``. Frames with status ``"weak"`` or ``"lost"`` are not fused, except those
            that are weak because the shape exceeds its first mask; with
            ``evolution="printed"`` weak ones are.

        Raises
        ------
        RuntimeError
            Before :meth:`start`.
        """
        tracker = self._started("track")
        frame = depth if isinstance(depth, Frame) else Frame(depth, color)
        if frame.camera is not None and depth_camera(frame.camera) != self._frame_camera:
            raise ValueError("frame: expected the same camera in all frames, got another one with this frame")
        begin = time.perf_counter()
        inside = TrackerInterface(tracker)
        view = inside.core_frame(frame)
        result = inside.wrapped(frame, view, self._begun.track(view, tracker.names), begin)
        return self._finished(result, begin)

    process = track

    # -- results

    @property
    @reading
    def shape(self) -> SDF:
        """A copy of the current shape: distances in metres, negative inside, and observed colours."""
        self._started("shape")
        return shape_of(self._volume.core, self._begun.least_seen)

    @reading
    def cropped_shape(self, margin_voxels: int = 16) -> SDF:
        """:attr:`shape` as :meth:`SDF.cropped` gives it, without a copy of the whole: for each frame's picture.

        Parameters
        ----------
        margin_voxels : int
            Kept around what is inside, at most to the border of the volume; the whole volume where nothing is inside.

        Raises
        ------
        RuntimeError, TypeError, ValueError
            Before :meth:`start`; a margin that is no whole number of at least 0.
        """
        self._started("cropped_shape")
        margin = whole_number(margin_voxels, "margin_voxels", 0)
        return shape_of(self._volume.core, self._begun.least_seen, margin)

    @reading
    def mesh(self, *, seen_only: bool = False, faces: int | None = None) -> Mesh:
        """Watertight coloured mesh, m, object frame; ``seen``: number of observations of each vertex (0: guessed).

        Parameters
        ----------
        seen_only : bool
            Omit the guessed surface (seen less than ``options.min_seen``); the mesh is then open.
        faces : int, optional
            Maximum number of faces, by :meth:`Mesh.decimated`, which requires the extra ``sdftrack[export]``.
        """
        self._started("mesh")
        mesh = quality.surface_mesh(self._volume.core)
        if seen_only:
            mesh = quality.seen_part(mesh, self.options.min_seen)
        return mesh if faces is None else mesh.decimated(faces)

    @reading
    def quality(self, mesh: Mesh | None = None) -> quality.Quality:
        """Quality of the surface; `mesh`: the result of :meth:`mesh` for the current shape, if available."""
        volume, noise_m = self._volume, self._begun.beginning.noise_m
        shown = self.mesh() if mesh is None else mesh
        return quality.quality_of(shown, volume.fused, volume.core.voxel_m, noise_m, self.options.min_seen)

    @alone
    def tracker(self) -> Tracker:
        """A Tracker that continues with this shape, the last pose, and the learned colours."""
        tracker, core = self._started("tracker"), self._volume.core
        shape = self.shape
        tracker.shapes = [shape]
        values = (shape.values, core.voxel_m, list(core.origin))
        least = 0 if self._printed else self._begun.least_seen
        inside = TrackerInterface(tracker)
        inside.replace_shape(0, values, np.array(core.rgb_seen), least, core.surface_boxes)
        self._tracker = self._new_tracker(self._begun)
        self._begun.set_tracker(self._tracker._core)
        self._go_on(inside.last_poses[0])
        return tracker

    @alone
    def refine(self, progress: Callable[[float], None] | None = None, rounds: int = ROUNDS) -> Refined:
        """Re-estimate all kept poses and the shape in a few rounds, which removes drift from both.

        In each round every keyframe is tracked against the whole shape, then the shape is rebuilt from all of them,
        with the first frame fixed. The result is accepted if it explains the frames at least as well as before;
        otherwise nothing changes, and ``Refined.taken`` is False.

        Parameters
        ----------
        progress : callable, optional
            Called with the completed fraction, 0..1.
        rounds : int
        """
        tracker = self._started("refine")
        last, newest = TrackerInterface(tracker).last_poses[0], self._kept[-1]
        before = newest.T_cam_obj
        volume, poses = self._volume, [keyframe.T_cam_obj for keyframe in self._kept]
        margin = math.ceil(FAR_M / volume.core.voxel_m) + 1
        shape = self.cropped_shape(margin)
        judge = Judge(self._kept, shape, self._frame_camera)
        was_m = judge.misfit_m(shape)
        del shape

        def restore() -> None:
            self._begun.volume = volume
            for keyframe, pose in zip(self._kept, poses, strict=True):
                keyframe.T_cam_obj = pose
            tracker.set_pose(0, last)

        def fuse_all(tell: Callable[[float], None]) -> None:
            # Frees the volume of the last round: two at most are in memory.
            self._begun.volume = volume
            self._fuse_all(tell, (volume, poses))

        try:
            refined = refining.refine(
                self._kept, tracker, self._frame_camera.shape, fuse_all, rounds, progress
            )
            now_m = judge.misfit_m(self.cropped_shape(margin))
        except BaseException:
            restore()
            raise
        refined = replace(refined, misfit_m=(was_m, now_m), taken=now_m < OVERFIT * was_m)
        if not refined.taken:
            restore()
            refined = replace(refined, poses={k.index: k.T_cam_obj for k in self._kept})
        # The last frame need not be among the kept ones; the object frame has moved in it as in the newest of them.
        tracker.set_pose(0, last @ np.linalg.solve(before, newest.T_cam_obj))
        return refined

    # -- inside

    def _started(self, what: str) -> Tracker:
        if self._tracker is None:
            raise RuntimeError(f"{what}: call start(frame, mask=...) first")
        self._volume.core.show()  # the tracker reads what it borrows of the volume from here on
        return self._tracker

    @property
    def _printed(self) -> bool:
        return self.options.evolution == "printed"

    @property
    def _begun(self) -> _core.ReconstructionSession:
        assert self._session is not None
        return self._session

    @property
    def _volume(self) -> _core.GrowingVolume:
        return self._begun.volume

    @property
    def _beginning(self) -> _core.Beginning:
        return self._begun.beginning

    @property
    def _index(self) -> int:
        return self._begun.index

    @property
    def _kept(self) -> list[Keyframe]:
        return self._begun.keyframes.frames

    def _new_session(self, found: _core.Beginning) -> _core.ReconstructionSession:
        return _core.ReconstructionSession(
            self._frame_camera._core, self.options, self.voxels, self.extent, self.threads,
            device_number(self.device), None if self.initial is None else self.initial._core_args, found,
        )  # fmt: skip

    def _new_tracker(self, session: _core.ReconstructionSession) -> Tracker:
        noise_m, noise_per_m = session.tracker_noise
        options = self.tracker_options.replace(adapt_noise=False, noise_m=noise_m, noise_per_m=noise_per_m)
        as_printed: dict[str, Any] = {"recover": False, "motion": "static"} if self._printed else {}
        # The session gives it its shape; this one says where the object frame's middle is.
        shape = self.initial or SDF.sphere(session.beginning.radius_m, voxels=STAND_IN_VOXELS)
        return Tracker(
            shape,
            self.camera,
            mode=self.mode,
            device=self.device,
            threads=self.threads,
            options=options,
            **as_printed,
        )

    def _go_on(self, pose: Pose) -> None:
        """Transfer the state of the old tracker to a new one, which has the shape."""
        assert self._tracker is not None
        learn_colors(self._tracker, self._kept, self._frame_camera, self._index)
        self._tracker.set_pose(0, pose)

    def _add(self, frame: Frame, T: Pose) -> bool:
        """Fuse a frame at its pose; returns False if too little of the object is in the image."""
        view = TrackerInterface(self._started("add")).core_frame(frame)
        return self._begun.add(view, np.ascontiguousarray(T))

    def _fuse_all(
        self,
        progress: Callable[[float], None],
        known: tuple[_core.GrowingVolume, list[Pose]] | None = None,
    ) -> None:
        """Rebuild the shape from all keyframes at their poses; `known`: a shape of them, and their poses there."""
        volume, recording = self._volume.emptied(), 0
        kept, later = self._kept, self._begun.later
        for i, keyframe in enumerate(kept):
            if keyframe.recording != recording:
                recording = keyframe.recording
                volume.begin_recording(later[recording - 1], keyframe.T_cam_obj)
            if known is None:
                volume.fuse(keyframe)
            else:
                volume.fuse_again(keyframe, known[0], known[1][i])
            progress((i + 1) / len(kept))
        if known is not None:
            volume.measure()
        self._begun.volume = volume  # whole, or not at all

    def _finished(self, result: TrackResult, begin: float) -> TrackResult:
        return replace(result, seconds=time.perf_counter() - begin, index=self._index)

    # -- files

    @reading
    def save(self, path: str | os.PathLike[str]) -> None:
        """Write keyframes, their poses and the settings to one file, completely or not at all (docs/files.md)."""
        from sdftrack._internal.saved_file import write

        self._started("save")
        write(path, saved_state.KIND, saved_state.content_of(self.__getstate__()))

    @staticmethod
    def load(path: str | os.PathLike[str], *, device: str = "auto") -> Reconstructor:
        """Load a file written by :meth:`save`; the shape is fused again.

        Parameters
        ----------
        path : path
        device : {"auto", "cpu", "cuda", "cuda:N"}
            Where to go on, whichever device it was saved on.

        Raises
        ------
        FileNotFoundError, ValueError
            No such file; a file of another kind, of a later version, truncated or damaged.
        """
        from sdftrack._internal.saved_file import loaded

        device_number(device)  # before the file is read

        def state(content: Any) -> dict[str, Any]:
            return {**saved_state.state_from(content), "device": device}

        return loaded(path, saved_state.KIND, Reconstructor, state)

    def __getstate__(self) -> dict[str, Any]:
        return saved_state.state_of(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        saved_state.restore(self, state)
