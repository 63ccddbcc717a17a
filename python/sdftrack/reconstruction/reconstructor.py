# SPDX-License-Identifier: MIT
"""Reconstruction of a shape while it is tracked: the public class."""

from __future__ import annotations

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
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.device import device_number, resolve_device
from sdftrack.frame import Frame
from sdftrack.imaging.pose_hint import one_place
from sdftrack.mesh import Mesh
from sdftrack.options import TrackerOptions
from sdftrack.reconstruction import quality, refining, resuming, saved_state
from sdftrack.reconstruction.arguments import (
    check_beginning,
    check_extent,
    check_settings,
    voxels_of,
)
from sdftrack.reconstruction.initialization import (
    PRINTED_SCALE_VOXELS,
    Lattice,
    find_object,
    printed_tracker_options,
)
from sdftrack.reconstruction.keyframe import Keyframe, Keyframes, Refined, cut, masked_keyframe
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.reconstruction.quality import MaskExtent
from sdftrack.reconstruction.refining import OVERFIT, Judge, learn_colors
from sdftrack.reconstruction.volume import BLOCK, Volume, lattice_for
from sdftrack.results import Status, TrackResult, doubted
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker
from sdftrack.tracking.interface import TrackerInterface

Pose = NDArray[np.float64]
STAND_IN_VOXELS = 24
ROUNDS = 3
YOUNG_FRAMES = 30  # in which the tracker takes the shape as each frame leaves it

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
        back. The results are those of the CPU but for rounding. ``"auto"``: a GPU that has passed its self-test,
        otherwise the CPU; see `sdftrack.device.resolve_device`.
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
    `initial`. Poses are relative to the first frame and do not depend on the evolving shape.
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
        self._volume: Any = None
        self._tracker: Tracker | None = None
        self._keyframes = Keyframes(self.options.kept_frames)
        self._mask_extent: MaskExtent | None = None  # None: the shape keeps to the mask, or there is none
        self._later: list[_core.Beginning] = []  # of further recordings, what their first frames show
        self._index = -1

    def __repr__(self) -> str:
        state = f"{self._volume.fused} frames fused" if self._volume is not None else "not started"
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
        depth = check_beginning(frame, self._frame_camera, mask, box, pose, self.initial)
        begin = time.perf_counter()
        place = one_place(pose, mask, box, self._frame_camera)
        options = self.options
        if self._printed:  # the thesis removes no planes, and lets the shape extend beyond the mask
            options = options.replace(planes=False, keep_to_mask=False)
        found = find_object(depth, place, self._frame_camera, self.initial, options)
        return self._begin(frame, found, begin)

    def _begin(self, frame: Frame, found: _core.Beginning, begin: float) -> TrackResult:
        """Reset and start with a frame; `begin`: the time of the call."""
        assert frame.depth is not None
        check_extent(self.extent, found.radius_m)
        lattice = lattice_for(found, self.initial, self.voxels, self.extent)
        volume = self._empty_volume(lattice, found)
        keyframe = self._first_keyframe(frame, found)
        volume.fuse(keyframe, frame.depth)
        if not len(volume.core.surface_boxes):
            raise ValueError(
                "start: no surface was found on the object; is it too small for the volume's voxels?"
            )
        self._beginning, self._volume, self._index, self._later = found, volume, 0, []
        self._keyframes = Keyframes(self.options.kept_frames)
        self._keyframes.add(keyframe)
        self._mask_extent = self._extent_of_mask(found)
        self._tracker = self._new_tracker()
        self._reshape()
        result = self._tracker.start(frame, poses=found.T_cam_obj)
        self._tracker.set_pose(0, found.T_cam_obj)
        return self._finished(result, found.T_cam_obj, begin, fused=True)

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
        tracker, shape = self._tracker_of_shape(), self.shape
        learn_colors(tracker, self._kept, self._frame_camera, self._index)
        result, shown = resuming.begin_again(
            tracker, shape, self.mesh(), self._volume.core, frame, place, self._frame_camera, self.options
        )
        if shown is None:
            return self._finished(result, result.poses[0], begin, fused=False)
        T = shown.T_cam_obj
        self._volume.begin_recording(shown, T)
        self._tracker, self._index = tracker, self._index + 1
        self._later.append(shown)
        self._reshape()
        if pose is None:
            first = self._first_keyframe(frame, shown)
            self._keep(replace(first, index=self._index, recording=len(self._later)), frame)
        fused = pose is None or self._add(frame, T)
        return self._finished(result, T, begin, fused=fused, judged=False)  # ok says that it was added

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
        result = tracker.track(frame)
        self._index += 1
        # The thesis does not judge its poses: every frame that could be tracked adds to the shape.
        # Along what cannot be observed, any pose adds the same.
        sure = TrackerInterface(tracker).is_sure(0) or (self._printed and result.status[0] is Status.WEAK)
        fused = sure and frame.depth is not None and self._add(frame, result.poses[0])
        return self._finished(result, result.poses[0], begin, fused=fused)

    process = track

    # -- results

    @property
    @reading
    def shape(self) -> SDF:
        """A copy of the current shape: distances in metres, negative inside, and observed colours."""
        self._started("shape")
        return self._volume.shape(self._least)

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
        mesh = quality.surface_mesh(self._volume.core, device_number(self.device))
        if seen_only:
            mesh = quality.seen_part(mesh, self.options.min_seen)
        return mesh if faces is None else mesh.decimated(faces)

    @reading
    def quality(self, mesh: Mesh | None = None) -> quality.Quality:
        """Quality of the surface; `mesh`: the result of :meth:`mesh` for the current shape, if available."""
        return quality.quality_of(
            self.mesh() if mesh is None else mesh,
            self._volume.fused,
            self._volume.core.voxel_m,
            self._beginning.noise_m,
            self.options.min_seen,
        )

    @alone
    def tracker(self) -> Tracker:
        """A Tracker that continues with this shape, the last pose, and the learned colours."""
        tracker = self._started("tracker")
        shape = self.shape
        tracker.shapes = [shape]
        self._reshape(shape.values, np.array(self._volume.core.rgb_seen))
        self._tracker = self._tracker_of_shape()
        self._go_on(TrackerInterface(tracker).last_poses[0])
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
        shape, volume, poses = self.shape, self._volume, [keyframe.T_cam_obj for keyframe in self._kept]
        judge = Judge(self._kept, shape, self._frame_camera)
        was_m = judge.misfit_m(shape)
        refined = refining.refine(
            self._kept, tracker, self._frame_camera.shape, self._fuse_all, rounds, progress
        )
        now_m = judge.misfit_m(self.shape)
        refined = replace(refined, misfit_m=(was_m, now_m), taken=now_m < OVERFIT * was_m)
        if not refined.taken:
            self._volume = volume
            self._look_at_extent_again()
            for keyframe, pose in zip(self._kept, poses, strict=True):
                keyframe.T_cam_obj = pose
            self._reshape()
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

    def _extent_of_mask(self, found: _core.Beginning) -> MaskExtent | None:
        """What compares the shape with the first mask, unless it keeps to it, or there is none."""
        if found.outline is None or self.options.keep_to_mask or self._printed:
            return None
        return MaskExtent(self._frame_camera, found.outline, found.T_cam_obj)

    def _new_tracker(self) -> Tracker:
        # The young shape fits the frames that it was made of too well to measure the sensor by.
        options = self.tracker_options.replace(
            adapt_noise=False, noise_m=self._beginning.noise_m, noise_per_m=self.options.noise_per_m
        )
        as_printed: dict[str, Any] = {}
        if self._printed:  # the width of the likelihood is in voxels, whatever the sensor
            options = options.replace(
                noise_m=PRINTED_SCALE_VOXELS * self._volume.core.voxel_m, noise_per_m=0.0
            )
            as_printed = {"recover": False, "motion": "static"}
        # Its own shape follows at once (reshape); this one says where the object frame's middle is.
        shape = self.initial or SDF.sphere(self._beginning.radius_m, voxels=STAND_IN_VOXELS)
        return Tracker(
            shape,
            self.camera,
            mode=self.mode,
            device=self.device,
            threads=self.threads,
            options=options,
            **as_printed,
        )

    def _empty_volume(self, lattice: Lattice, beginning: _core.Beginning) -> Volume:
        number = device_number(self.device)
        return Volume(
            self._frame_camera, lattice, beginning, self.initial, self.options, self.threads, number
        )

    def _tracker_of_shape(self) -> Tracker:
        tracker = self._new_tracker()
        self._reshape(tracker=tracker)
        return tracker

    def _go_on(self, pose: Pose) -> None:
        """Transfer the state of the old tracker to a new one, which has the shape."""
        assert self._tracker is not None
        learn_colors(self._tracker, self._kept, self._frame_camera, self._index)
        self._tracker.set_pose(0, pose)

    @property
    def _least(self) -> int:
        """Minimum observation weight of a surface patch, in the core's unit."""
        return max(1, round(quality.SEEN_SCALE * self.options.min_seen))

    def _reshape(self, phi: Any = None, rgb_seen: Any = None, tracker: Tracker | None = None) -> None:
        """Give the tracker (or another one) the current shape, or given copies of it."""
        inside = TrackerInterface(self._started("shape") if tracker is None else tracker)
        core = self._volume.core
        values = (core.phi if phi is None else phi, core.voxel_m, list(core.origin))
        colors = core.rgb_seen if rgb_seen is None else rgb_seen
        # The thesis tracks by all of the shape, seen or guessed.
        least = 0 if self._printed else self._least
        inside.replace_shape(0, values, colors, least, core.surface_boxes)

    def _add(self, frame: Frame, T: Pose) -> bool:
        """Fuse a frame at its pose; returns False if too little of the object is in the image."""
        assert self._tracker is not None
        assert frame.depth is not None
        inside = TrackerInterface(self._tracker)
        region = x0, y0, x1, y1 = inside.region(0, T, self.options.padding_m)
        if x1 - x0 < BLOCK or y1 - y0 < BLOCK:
            return False
        foreground, rgb = inside.pixel_evidence(0, frame, region)
        depth, recording = cut(frame.depth, region), len(self._later)
        self._keep(Keyframe(self._index, region, depth, rgb, foreground, np.array(T), None, recording), frame)
        return True

    def _first_keyframe(self, frame: Frame, found: _core.Beginning) -> Keyframe:
        """The first keyframe of a recording, in which a mask marks the object."""
        camera = None if self.mode == "depth" else self.camera if frame.camera is None else frame.camera
        return masked_keyframe(frame, found.on_object, found.T_cam_obj, self._frame_camera, camera)

    def _keep(self, keyframe: Keyframe, frame: Frame) -> None:
        assert frame.depth is not None
        self._volume.fuse(keyframe, frame.depth)
        self._keyframes.add(keyframe)
        # What many frames have shown moves little with one more: sample points, normals and the coarse grid of the
        # tracker's shape may be one frame older than the distances and colours, which it borrows.
        if self._volume.grow_if_needed() or self._volume.fused <= YOUNG_FRAMES or self._volume.fused % 2 == 0:
            self._reshape()
        else:
            self._volume.core.begin_to_show()  # while this thread goes on; see _started

    @property
    def _kept(self) -> list[Keyframe]:
        return self._keyframes.frames

    def _fuse_all(self, progress: Callable[[float], None]) -> None:
        """Rebuild the shape from all keyframes at their current poses."""
        volume, recording = self._volume.emptied(), 0
        for i, keyframe in enumerate(self._kept):
            if keyframe.recording != recording:
                recording = keyframe.recording
                volume.begin_recording(self._later[recording - 1], keyframe.T_cam_obj)
            volume.fuse(keyframe, keyframe.whole(keyframe.depth, self._frame_camera.shape))
            progress((i + 1) / len(self._kept))
        self._volume = volume  # whole, or not at all
        self._look_at_extent_again()
        self._reshape()

    def _look_at_extent_again(self) -> None:
        if self._mask_extent is not None:
            self._mask_extent.forget()

    def _finished(
        self, result: TrackResult, T: Pose, begin: float, *, fused: bool, judged: bool = True
    ) -> TrackResult:
        poses = np.array(result.poses)
        poses[0] = T
        if judged and fused and self._mask_extent is not None and result.status[0] is Status.OK:
            reason = self._mask_extent.reason(self._volume.core, self._volume.fused, self._least)
            result = doubted(result, reason) if reason else result
        change = float(self._volume.core.change_m) if fused else float("nan")
        seconds = time.perf_counter() - begin
        return replace(result, poses=poses, seconds=seconds, index=self._index, shape_change=change)

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
