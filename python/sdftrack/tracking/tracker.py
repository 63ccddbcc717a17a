# SPDX-License-Identifier: MIT
"""Track known shapes in depth and colour images, from a pose, a mask, a box or nothing but the shape."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.rigid_poses import rigid_pose
from sdftrack._internal.thread_guard import SingleThreadGuard
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack._internal.validation import of_kind
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.device import resolve_device
from sdftrack.frame import Frame
from sdftrack.imaging.appearance import color_map
from sdftrack.imaging.pose_hint import Place, one_place, place_list
from sdftrack.options import TrackerOptions
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.shape import Primitive
from sdftrack.primitives.tracked import FreeSizes
from sdftrack.results import ColorDelay, Status, TrackResult
from sdftrack.sdf import SDF
from sdftrack.sensor import SensorModel
from sdftrack.symmetry import Symmetry
from sdftrack.tracking.arguments import (
    COLLISIONS,
    check_switches,
    expect,
    name_list,
    object_number,
    options_of,
    pose_covariance,
    shape_list,
)
from sdftrack.tracking.canonical_poses import CanonicalPoses
from sdftrack.tracking.core_conversion import core_frame, rgb_seen, volume_of
from sdftrack.tracking.interface import TrackerInterface
from sdftrack.tracking.result_assembly import assembled, followed, modes_of
from sdftrack.tracking.scale import check_scale
from sdftrack.tracking.start_places import clicked_places, found_anywhere

__all__ = ["Tracker"]

LOG = logging.getLogger("sdftrack")
COLOR_DELAY_KNOWN_S = 0.05  # sd above which it is not told
# What may have been meant where a keyword is neither an argument nor an option.
KEYWORDS = (
    "mode", "device", "threads", "recover", "motion", "membership", "names", "collision", "symmetry", "options",
    "sensor",
)  # fmt: skip


class Tracker:
    """Track one or more known shapes, each from its last pose, by depth and colour.

    Objects that may touch or hide each other are fitted together: every pixel speaks to the union of their shapes, and
    none may stand in another (docs/several_objects.md). The others are fitted one by one.

    Parameters
    ----------
    shapes : SDF or Primitive, or a sequence of them
        The objects; the same SDF twice is stored once. A `Primitive` is a simple solid whose size is found at the start
        and made better while it is followed; :attr:`sizes` tells it.
    camera : Camera or RGBDCamera
        Of the depth images; a Camera means that colour is aligned to depth. A frame's own ``camera`` goes before it.
    mode : {"auto", "depth", "rgbd", "rgb"}
        ``"auto"`` uses colour where a frame has it and where it tells the object from what is around it;
        ``"rgbd"`` asks for it in every frame and always uses it; ``"depth"`` never. The first frame shows the
        colours and is fitted by depth alone. ``"rgb"`` follows the outline in the colour image and reads no depth:
        it starts from poses, does not search, and every frame is at best ``"weak"``, for an outline hardly shows the
        distance (docs/math/outline.md). ``mode_used`` says what the last frame was tracked by.
    device : {"auto", "cpu", "cuda"}
        Where the sums over many pixels run; with ``"cuda"`` those of 1,500 and more run on the GPU, all else on the
        CPU. ``"auto"`` is the CPU: only frames with far more readings than usual gain by a GPU.
    threads : int
        0: all cores. The result has the same bits for any number.
    recover : bool
        Search for a lost object in every later frame: around its last pose first, then everywhere. False: it is only
        followed from its last pose, until :meth:`recover` or :meth:`set_pose`.
    motion : {"adaptive", "static", "constant_velocity"}
        Where an object is expected in the next frame: at its last pose, or moved on as between the last two sure
        ones; "adaptive": whichever has been nearer lately. While an object is ``"weak"`` its motion is always used,
        and believed less from frame to frame.
    names : sequence of str, optional
        One per shape, for reports.
    membership : bool
        Fill ``result.membership`` and ``result.foreground`` in every frame: (H, W, M) soft weights of the objects in
        each reading within 10 mm of a surface (thesis Eq. 5.21; they add up to 1, and to 0 elsewhere), and (H, W) the
        chance by colour that a pixel is an object's (NaN: not known; None without colours). Costs some milliseconds.
    collision : {"contact", "printed", None}
        What keeps objects that touch out of one another: a penalty on how deep, the source's form (thesis Eq. 5.25),
        which does not pull apart what has got into one another, or nothing.
    symmetry : Symmetry, or a sequence with one or None per shape, optional
        Turns that look alike and are one answer: a start in any of them is not ambiguous, and of the poses that look
        alike the results hold the one nearest to the object's last (at a start: to the given pose, else to the
        camera's axes). A shape with colours, in a mode that reads them, has none: its colours tell the turns apart.
    options : TrackerOptions, optional
        A whole set of options; single ones may be given as keywords.
    sensor : SensorModel, str or path, optional
        What the depth camera errs by: a model, a preset ("kinect_v1", "realsense_d400", "azure_kinect") or a file of
        ``sdftrack calibrate depth``. It sets the options of noise and systematic error, also in `options`, but not
        single ones that are given; and its bias is taken out of every depth image. None: the noise is measured from
        frame to frame, and the systematic error learnt where a pose is given (docs/sensors.md).

    Raises
    ------
    TypeError
        A shape that is not an SDF; an unknown option (the nearest name is suggested).
    ValueError
        No shape, or an option out of range.
    RuntimeError
        ``device="cuda"`` without it; one tracker used by two threads at once.

    Attributes
    ----------
    mode_used : list of "depth", "rgbd" or "rgb"
        Per object, of the last frame.

    Notes
    -----
    The method is derived in docs/math/depth_tracker.md and docs/math/color.md (thesis, sections 3.4 and 4.3; ray-hit
    residual, outlier floor, free-space term and the odds of a colour are additions). ``TrackerOptions.printed()``
    selects the source's form (docs/math/depth_tracker.md, section 9).

    >>> tracker = Tracker(sdf, camera)                              # doctest: +SKIP
    >>> result = tracker.start(frame, poses=[T_cam_obj])            # doctest: +SKIP
    >>> result = tracker.track(next_frame); result.pose, result.status  # doctest: +SKIP
    """

    def __init__(
        self,
        shapes: SDF | Primitive | Sequence[SDF | Primitive],
        camera: Camera | RGBDCamera,
        mode: str = "auto",
        device: str = "auto",
        *,
        threads: int = 0,
        recover: bool = True,
        motion: str = "adaptive",
        membership: bool = False,
        names: Sequence[str] | None = None,
        collision: str | None = "contact",
        symmetry: Symmetry | Sequence[Symmetry | None] | None = None,
        options: TrackerOptions | None = None,
        sensor: SensorModel | str | os.PathLike[str] | None = None,
        **single_options: Any,
    ) -> None:
        refuse_unknown(single_options, [*TrackerOptions.__dataclass_fields__, *KEYWORDS])
        self._free_sizes = FreeSizes(shapes)
        self.shapes = shape_list(self._free_sizes.shapes)
        self.camera = camera
        self._frame_camera = depth_camera(camera)
        self.sensor = SensorModel.of(sensor)
        self.options = options_of(options, self.sensor, single_options)
        self.names = name_list(names, len(self.shapes))
        expect("mode", mode, ("auto", "depth", "rgbd", "rgb"))
        expect("motion", motion, tuple(_core.MotionModel.__members__))
        check_switches(collision, membership, threads)
        # A frame of some thousand readings is done here before a GPU has been told of it.
        cuda = device != "auto" and resolve_device(device) == "cuda"
        self.mode = mode
        self.mode_used = ["depth"] * len(self.shapes)
        self._color_map: tuple[Any, Any] = (None, None)  # of what camera and size, and the map
        # An overlap is at most 1.
        always: dict[str, Any] = {"color_max_overlap": 2.0} if mode in ("rgbd", "rgb") else {}
        if mode == "rgb":
            always["outline"] = True
        self.threads = threads
        self.device = "cuda" if cuda else "cpu"
        self.recover_lost = bool(recover)
        self.membership = membership
        self.motion = motion
        self._cuda, self.collision, self._always = cuda, collision, always
        self._reads_outline = mode == "rgb" or self.options.outline
        self._last: TrackResult | None = None
        self._lock = threading.Lock()
        self._core = _core.Tracker(
            [volume_of(s) for s in self.shapes],
            self._frame_camera._core,
            self.options.replace(**self._always)._to_core(),
            self.threads,
            self.recover_lost,
            _core.MotionModel.__members__[self.motion],
            self._cuda,
            _core.Collision.__members__[COLLISIONS[self.collision]],
        )
        self._paint_all()
        self._free_sizes.mark_unfound(TrackerInterface(self))
        self._canonical = CanonicalPoses(symmetry, self.shapes, mode)
        self._canonical.declare(self._core)

    def _paint_all(self) -> None:
        self._painted: list[tuple[NDArray[np.uint8], NDArray[np.uint16]]] = []
        for k, shape in enumerate(self.shapes):
            self._paint(k, shape)

    def _replace_shapes(self, shapes: list[SDF], poses: NDArray[np.float64]) -> None:
        """Other volumes for the same objects; `poses`: where to go on from."""
        self._core.replace_shapes([volume_of(s) for s in shapes], np.ascontiguousarray(poses))
        self.shapes = shapes
        self._paint_all()

    def __repr__(self) -> str:
        return f"Tracker({len(self.shapes)} shape{'s' * (len(self.shapes) != 1)}, {self._frame_camera!r})"

    @property
    def sizes(self) -> list[PrimitiveFit | None]:
        """What is known of the size of each `Primitive` among the shapes; None: another shape, or not found yet."""
        return self._free_sizes.fits(len(self.shapes))

    def start(
        self,
        frame: Frame,
        poses: ArrayLike | Sequence[ArrayLike] | None = None,
        *,
        masks: Any = None,
        boxes: Any = None,
        clicks: Any = None,
    ) -> TrackResult:
        """Begin, or begin again, from poses, masks, boxes, clicks, or by a search of the whole image.

        Parameters
        ----------
        frame : Frame
        poses : sequence of (4, 4) float64, one per shape; for one shape the matrix itself will do
            ``T_cam_obj``, metres; refined on this frame. Projected onto the rigid ones when within 1e-3 of one.
        masks : sequence of (H, W) bool or uint8, one per shape; for one shape the mask itself will do
            Not 0 where the object is seen, in the geometry of the depth image: its pose is searched there.
        boxes : sequence of (x, y, w, h), one per shape; for one shape the four numbers will do
            In depth pixels; the object lies within, other things may too.
        clicks : sequence of (x, y), one per shape; for one shape the two numbers will do
            A depth pixel of each object. What hangs together there, without tables and walls, and what colours part
            from its surroundings, are searched; the pose that explains best what is seen there is begun with.

        Returns
        -------
        TrackResult
            With ``index`` 0. An object that is not found is ``"lost"``; its pose is NaN. One whose view fits two poses
            nearly as well is ``"weak"`` and says so; ``runner_up`` tells how near the second one came.

        Raises
        ------
        TypeError
            `frame` is not a Frame, or `poses`, `masks` or `boxes` are not arrays of numbers.
        ValueError
            Not one per shape; poses not finite or not rigid; an empty mask or one of another size; a box without
            area or outside the image; two of the four given; a depth or colour image of another size than the
            camera says; no colour image with ``mode="rgbd"``; a click on nothing or on a table; a mask or click where
            what is seen is of another size than the shape (its unit, or that of the depth, is then named).
        """
        of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
        if self.mode == "rgb" and poses is None:
            raise ValueError(
                "poses: expected one per shape with mode='rgb', got none; without depth nothing is searched for: "
                "start(frame, poses=[...])"
            )
        given = [
            (name, value)
            for name, value in (
                ("poses", poses),
                ("masks", masks),
                ("boxes", boxes),
                ("clicks", clicks),
            )
            if value is not None
        ]
        if len(given) > 1:
            raise ValueError(
                f"expected one of poses, masks, boxes and clicks, got {' and '.join(name for name, _ in given)}"
            )
        camera = self._camera_of(frame)
        colors = self._colors_of(frame)
        count = len(self.shapes)
        places: list[Place] = [None] * count
        if clicks is not None:
            places = clicked_places(self, clicks, frame, camera)
        elif given:
            places = place_list(*given[0], count, camera)
        self._canonical.begin(places)
        result = self._start_at(frame, camera, colors, places)
        return result if given else found_anywhere(self, frame, camera, colors, result)

    def _alone_with(self, k: int, frame: Frame) -> Tracker:
        """A tracker of shape k, to try places with."""
        mode = "auto" if self.mode == "rgbd" and frame.color is None else self.mode
        single = self.options.to_dict()
        return Tracker(self.shapes[k], self.camera, mode, threads=self.threads, sensor=self.sensor, **single)

    def _start_at(
        self, frame: Frame, camera: Camera, colors: tuple[Any, Any], places: list[Place]
    ) -> TrackResult:
        for k, place in enumerate(places):
            if (
                isinstance(place, np.ndarray)
                and place.dtype == np.uint8
                and not self._free_sizes.shapes_unknown(k)
            ):
                check_scale(frame, camera, place != 0, self.shapes[k], f"masks[{k}]")
        with self._alone():
            self._free_sizes.start(TrackerInterface(self), frame, camera, places)
            begin = time.perf_counter()
            view = self._core_frame(frame, camera, colors)
            return self._finish(frame, view, self._core.start(view, places, self.names), begin)

    def track(self, depth: Frame | ArrayLike, color: ArrayLike | None = None) -> TrackResult:
        """Follow the objects into the next frame.

        Parameters
        ----------
        depth : Frame, or (H, W) float32 m (0 = none)
            The frame, or its depth image.
        color : (H, W, 3) uint8, optional
            Aligned to depth, or as the RGBDCamera says.

        Returns
        -------
        TrackResult
            A lost object keeps its last good pose, and is looked for there in the next frame. An unreadable or
            empty frame is ``"bad_frame"``, not an exception.

        Raises
        ------
        RuntimeError
            Before :meth:`start`.
        ValueError
            A depth or colour image of another size than the camera says; no colour image with ``mode="rgbd"``. The
            tracker is as it was before.
        """
        if self._core.index < 0:
            raise RuntimeError("track: call start(frame, poses=[...]) first")
        frame = depth if isinstance(depth, Frame) else Frame(depth, color)
        with self._alone():
            camera, colors = self._camera_of(frame), self._colors_of(frame)
            begin = time.perf_counter()
            if self._free_sizes:
                self._free_sizes.find(TrackerInterface(self), frame, camera, self.recover_lost)
            view = self._core_frame(frame, camera, colors)
            result = self._finish(frame, view, self._core.track(view, self.names), begin)
            if self._free_sizes:
                self._free_sizes.look(TrackerInterface(self), frame, camera, result)
            return result

    def recover(
        self, frame: Frame, k: int | None = None, mask: ArrayLike | None = None, box: Any = None
    ) -> TrackResult:
        """Search for lost objects in this frame, now and with all effort.

        Parameters
        ----------
        frame : Frame
            Often the one that was just tracked; frames are not counted.
        k : int, optional
            Only this object, lost or not. None: every object that is lost.
        mask : (H, W) bool or uint8, optional
        box : (x, y, w, h), optional
            Where to look, as in :meth:`start`. With several lost objects `k` is needed.

        Returns
        -------
        TrackResult
            The last result, with the objects that were searched for replaced.

        Raises
        ------
        RuntimeError
            Before :meth:`start`, or between :meth:`add` or :meth:`remove` and the next frame.
        ValueError
            An empty mask, a box outside the image, both of them, or one of them for several objects.
        """
        of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
        if self._last is None:
            first = (
                "track(frame), for the objects are not the last frame's"
                if self._core.index >= 0
                else "start(frame)"
            )
            raise RuntimeError(f"recover: call {first} first")
        camera, colors = self._camera_of(frame), self._colors_of(frame)
        place = one_place(None, mask, box, camera)
        with self._alone():
            last = self._last
            if k is None:
                wanted = [j for j, s in enumerate(last.status) if s is Status.LOST]
            else:
                wanted = [object_number(k, len(self.shapes))]
            if place is not None and len(wanted) > 1:
                raise ValueError(
                    f"k: expected the number of the object to look for, got None and {len(wanted)} lost"
                )
            if not wanted:
                return last
            begin = time.perf_counter()
            for j in wanted:
                self._free_sizes.look_at(j, place)
            placed = self._free_sizes.find(TrackerInterface(self), frame, camera, anywhere=True)
            places = [placed.get(j, place) for j in wanted]
            view = self._core_frame(frame, camera, colors)
            return self._finish(frame, view, self._core.recover(view, wanted, places, self.names), begin)

    def set_pose(self, k: int, T: ArrayLike, covariance: ArrayLike | None = None) -> None:
        """Replace object k's last pose; it counts as followed again.

        Parameters
        ----------
        k : int
        T : (4, 4) float64
            ``T_cam_obj``, metres.
        covariance : (6, 6) float64, optional
            Of T, as in :class:`TrackResult`: makes T a prior that the next frame is weighed against, in place of the
            weak one about the expected pose.
        """
        index = object_number(k, len(self.shapes))
        pose = rigid_pose(T, "T")
        prior = None if covariance is None else pose_covariance(covariance)
        with self._alone():
            self._core.set_pose(index, pose, prior)
            self._canonical.set_pose(index, pose)
            self._free_sizes.look_at(index, pose)

    def add(
        self,
        shape: SDF | Primitive,
        pose: ArrayLike | None = None,
        mask: ArrayLike | None = None,
        box: Any = None,
        name: str | None = None,
    ) -> int:
        """Track one more shape from the next frame on; returns its number.

        Parameters
        ----------
        shape : SDF or Primitive
        pose, mask, box
            Where it is in the next frame, as in :meth:`start`: one of them, or none to search the whole image.
        name : str, optional
        """
        if not isinstance(shape, Primitive):
            of_kind(shape, SDF, "shape", "make one with SDF.from_mesh, or give a st.Primitive")
        place = one_place(pose, mask, box, self._frame_camera)
        with self._alone():
            volume = self._free_sizes.add(len(self.shapes), shape, place)
            k: int = self._core.add(volume_of(volume), place)
            self._paint(k, volume)
            self.shapes = [*self.shapes, volume]
            self.names = [*self.names, f"object {k}" if name is None else str(name)]
            self.mode_used = [*self.mode_used, "depth"]
            self._canonical.add()
            self._free_sizes.mark_unfound(TrackerInterface(self))
            self._last = None
            return k

    def remove(self, k: int) -> None:
        """Track object k no longer; those behind it move up by one."""
        index = object_number(k, len(self.shapes))
        if len(self.shapes) == 1:
            raise ValueError("k: expected at least one object to be left, got the only one")
        with self._alone():
            self._core.remove(index)
            self._free_sizes.remove(index)
            self._canonical.remove(index)
            for values in (self.shapes, self.names, self.mode_used):
                del values[index]
            self._last = None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write shapes, camera, options and last poses to one file (pickle), whole or not at all."""
        from sdftrack._internal.pickled import save_pickled

        save_pickled(self, path)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Tracker:
        """Read what :meth:`save` wrote. Only open files that you trust: this is a pickle."""
        from sdftrack._internal.pickled import load_pickled

        return load_pickled(path, Tracker)

    @property
    def color_delay(self) -> ColorDelay | None:
        """By how much colour images are of a later moment than depth images, by all objects since :meth:`start`.

        Where the objects' outline is looked at in the colour image (``mode="rgbd"`` with ``outline``), its way from the
        pose by depth is compared with the motion (docs/math/outline.md, section 6). Nothing is changed by it.

        Returns
        -------
        ColorDelay or None
            None: not known, for want of timestamps, colour, an outline that stands out, or a motion.
        """
        with self._alone():
            delay_s, sd_s, frames = self._core.color_delay()
        return ColorDelay(delay_s, sd_s, frames) if frames and sd_s < COLOR_DELAY_KNOWN_S else None

    def __getstate__(self) -> dict[str, Any]:
        with self._alone():
            return {
                "shapes": self.shapes,
                "camera": self.camera,
                "arguments": {
                    "mode": self.mode,
                    "names": self.names,
                    "options": self.options,
                    "sensor": self.sensor,
                    "threads": self.threads,
                    "device": self.device,
                    "recover": self.recover_lost,
                    "motion": self.motion,
                    "membership": self.membership,
                    "collision": self.collision,
                    "symmetry": self._canonical.symmetries,
                },
                "progress": (self._core.index, self._last, self._core.best, self._free_sizes),
            }

    def __setstate__(self, state: dict[str, Any]) -> None:
        arguments = dict(state["arguments"])
        single = arguments.pop("options").to_dict()  # which the sensor has been asked for already
        Tracker.__init__(self, state["shapes"], state["camera"], **arguments, **single)
        index, last, best, free_sizes = state["progress"]
        self._resume(index, last, np.ascontiguousarray(best), free_sizes)

    def _resume(
        self, index: int, last: TrackResult | None, best: NDArray[np.float64], free_sizes: FreeSizes | None
    ) -> None:
        """Go on with a sequence whose record was kept in a file."""
        if free_sizes is not None:
            self._free_sizes = free_sizes
            free_sizes.mark_unfound(TrackerInterface(self))
        time_s = float("nan") if last is None or last.timestamp is None else float(last.timestamp)
        self._core.resume(index, time_s, followed(last), best)
        self._canonical.resume(last)
        self._last = last

    def _interrupt(self, index: int) -> None:
        """No motion leads from the last frame, which has this number from now on, to the next one."""
        with self._alone():
            self._core.interrupt(index)
            self._last = None

    def _alone(self) -> SingleThreadGuard:
        return SingleThreadGuard(self._lock, "tracker")

    def _camera_of(self, frame: Frame) -> Camera:
        camera = depth_camera(self.camera if frame.camera is None else frame.camera)
        if frame.depth is not None and frame.depth.shape != (camera.height, camera.width):
            raise ValueError(
                f"depth: expected the camera's size {camera.width} x {camera.height}, got "
                f"{frame.depth.shape[1]} x {frame.depth.shape[0]}; scale the camera with Camera.scaled"
            )
        return camera

    def _colors_of(self, frame: Frame) -> tuple[Any, Any]:
        """The frame's colour image, if it is to be used, and where its pixels lie."""
        alone = frame.depth is None or self.mode == "rgb"
        if self.mode == "depth" or (alone and not self._reads_outline):
            return None, None
        if frame.color is None:
            if self.mode == "rgb" and not frame.error:
                raise ValueError(
                    "frame: expected a colour image with mode='rgb', got none; give st.Frame(None, color)"
                )
            if self.mode == "rgbd" and not alone:
                raise ValueError(
                    "frame: expected a colour image with mode='rgbd', got none; give st.Frame(depth, color), or use "
                    "mode='auto'"
                )
            return None, None
        camera = self.camera if frame.camera is None else frame.camera
        if self._color_map[0] != (camera, frame.color.shape):
            self._color_map = (camera, frame.color.shape), color_map(camera, frame.color)
        return frame.color, self._color_map[1]

    def _paint(self, k: int, shape: SDF) -> None:
        """Hand a shape's colours over; copies of one shape share them."""
        if shape.colors is None:
            return
        for rgba, seen in self._painted:
            if rgba is shape.colors:
                self._core.paint(k, seen)
                return
        self._painted = [p for p in self._painted if any(p[0] is s.colors for s in self.shapes)]
        self._painted.append((shape.colors, rgb_seen(shape.colors)))
        self._core.paint(k, self._painted[-1][1])

    def _core_frame(self, frame: Frame, camera: Camera, colors: tuple[Any, Any]) -> _core.TrackerFrame:
        if camera is not self._frame_camera and camera != self._frame_camera:
            self._core.set_camera(camera._core)
            self._frame_camera = camera
        return core_frame(frame, *colors, with_depth=self.mode != "rgb", sensor=self.sensor)

    def _membership(
        self, frame: Frame, view: _core.TrackerFrame
    ) -> tuple[NDArray[np.float32] | None, NDArray[np.float32] | None]:
        if not self.membership or frame.depth is None or self.mode == "rgb":
            return None, None
        weights, foreground = self._core.membership(view)
        return weights, None if np.isnan(foreground).all() else foreground

    def _note_modes(self, index: int, now: list[str]) -> None:
        for name, before, used in zip(self.names, self.mode_used, now, strict=True):
            if used != before:
                LOG.info("frame %d: %s is tracked by %s", index, name, used)
        self.mode_used = now

    def _finish(
        self, frame: Frame, view: _core.TrackerFrame, found: dict[str, Any], begin: float
    ) -> TrackResult:
        alone = self.mode == "rgb" or frame.depth is None
        self._note_modes(found["index"], modes_of(found, "rgb" if alone else "rgbd"))
        weights, foreground = self._membership(frame, view)
        self._last = assembled(
            self._canonical.applied(found),
            seconds=time.perf_counter() - begin,
            timestamp=frame.timestamp,
            membership=weights,
            foreground=foreground,
            sensor="" if self.sensor is None else self.sensor.name,
        )
        return self._last
