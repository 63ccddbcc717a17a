# SPDX-License-Identifier: MIT
"""Track known shapes in depth and colour images, from a pose, a mask, a box or nothing but the shape."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.rotations import rigid_pose
from sdftrack._internal.thread_guard import ReentrantLock, one_thread
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack._internal.validation import of_kind, one_of
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.camera.rgbd import color_map
from sdftrack.device import CPU, device_number
from sdftrack.frame import Frame
from sdftrack.imaging.pose_hint import Place, click_list, one_place, place_list
from sdftrack.options import TrackerOptions
from sdftrack.primitives.result import PrimitiveFit
from sdftrack.primitives.tracked import FreeSizes, Primitive
from sdftrack.results import ColorDelay, ScaleEstimate, Status, TrackResult
from sdftrack.sdf import SDF
from sdftrack.sdf.volume import shape_list
from sdftrack.sensor import SensorModel
from sdftrack.symmetry import Symmetry
from sdftrack.tracking.arguments import (
    COLLISIONS,
    check_switches,
    name_list,
    object_number,
    one_hint,
    options_of,
    pose_covariance,
)
from sdftrack.tracking.core_conversion import assembled, core_frame, rgb_seen
from sdftrack.tracking.free_scale import enlarge, estimate, free_scales
from sdftrack.tracking.interface import TrackerInterface
from sdftrack.tracking.symmetries import declare, symmetry_list

LOG = logging.getLogger("sdftrack")
COLOR_DELAY_KNOWN_S = 0.05  # sd above which it is not told
# What may have been meant where a keyword is neither an argument nor an option.
KEYWORDS = (
    "mode", "device", "threads", "recover", "motion", "membership", "names", "collision", "symmetry", "options",
    "sensor",
)  # fmt: skip


class Tracker:
    """Track one or more known shapes by depth and colour, each starting from its last pose.

    Objects that may touch or occlude each other are fitted jointly: every pixel is compared with the union of their
    shapes, and interpenetration is penalised (docs/several_objects.md). The others are fitted individually.

    Parameters
    ----------
    shapes : SDF or Primitive, or a sequence of them
        The objects; the same SDF twice is stored once. A `Primitive` is a simple solid whose size is estimated at the
        start and refined during tracking; see :attr:`sizes`.
    camera : Camera or RGBDCamera
        Camera of the depth images; a Camera means that colour is aligned to depth. A frame's own ``camera`` takes
        precedence.
    mode : {"auto", "depth", "rgbd", "rgb"}
        ``"auto"`` uses colour if a frame has it and if it distinguishes the object from its surroundings. ``"rgbd"``
        requires colour in every frame and always uses it; ``"depth"`` never uses it. The colours are learned in the
        first frame, which is fitted by depth alone. ``"rgb"`` tracks the outline in the colour image without depth: it
        starts from poses, does not search, and the status is at best ``"weak"``, because an outline hardly constrains
        the distance (docs/math/outline.md). ``mode_used`` states the mode used in the last frame.
    device : {"auto", "cpu", "cuda", "cuda:N"}
        Device for the fits to many pixels; with ``"cuda"`` those to 1,500 pixels and more, and searches, run on the
        GPU, everything else on the CPU. ``"auto"``: a GPU that has passed its self-test, otherwise the CPU; see
        `sdftrack.device.resolve_device`.
    threads : int
        0: all cores. The result has the same bits for any number.
    recover : bool
        Search for a lost object in every later frame: first around its last pose, then everywhere. False: it is only
        tracked from its last pose, until :meth:`recover` or :meth:`set_pose`.
    motion : {"adaptive", "static", "constant_velocity"}
        Motion model that predicts the pose in the next frame: the last pose, or constant velocity from the last two
        reliable poses; "adaptive": whichever predicted better recently. While an object is ``"weak"``, constant
        velocity is always used, with a confidence that decreases from frame to frame.
    names : sequence of str, optional
        One per shape, used in reports.
    membership : bool
        Fill ``result.membership`` and ``result.foreground`` in every frame: (H, W, M) soft assignment of each
        measurement within 10 mm of a surface to the objects (thesis Eq. 5.21; the weights sum to 1, and to 0
        elsewhere), and (H, W) posterior probability, by colour, that a pixel belongs to an object (NaN: unknown; None
        without colours). Costs a few milliseconds.
    collision : {"contact", "printed", None}
        Constraint against interpenetration of touching objects: a penalty on the penetration depth, the form of the
        thesis (Eq. 5.25), which hardly separates objects that overlap against their measurements, or none.
    symmetry : Symmetry, or a sequence with one or None per shape, optional
        Symmetries of the shapes. Equivalent poses are not reported as ambiguous, and results contain the equivalent
        pose nearest to the object's last pose (at a start: to the given pose, else to the camera's axes). They are
        ignored for a shape with colours in a mode that uses colour, because its colours resolve the symmetry.
    scale : "free" or None, or a sequence with one per shape
        ``"free"``: the shape has the object's form but not its size; its scale is estimated, from a mask whatever it
        is, from other starts if it is within a fifth of 1, and refined in later frames; see :attr:`scales`. Poses are
        those of the enlarged shape, which ``shapes`` holds.
    options : TrackerOptions, optional
        A whole set of options; single ones may be given as keywords.
    sensor : SensorModel, str or path, optional
        Error model of the depth camera: a model, a preset ("kinect_v1", "realsense_d400", "azure_kinect") or a file
        written by ``sdftrack calibrate depth``. It sets the options for noise and systematic error, overriding
        `options` but not single options given as keywords, and its bias is subtracted from every depth image. None: the
        noise is estimated in every frame, and the systematic error in frames with a given pose (docs/sensors.md).

    Raises
    ------
    TypeError
        A shape that is not an SDF; an unknown option (the nearest name is suggested).
    ValueError
        No shape, or an option out of range.
    RuntimeError
        ``device="cuda"`` without CUDA; concurrent use of one tracker by two threads.

    Attributes
    ----------
    mode_used : list of "depth", "rgbd" or "rgb"
        Mode of each object in the last frame.

    Notes
    -----
    The method is derived in docs/math/depth_tracker.md and docs/math/color.md (thesis, sections 3.4 and 4.3; ray-hit
    residual, outlier floor, free-space term and the odds of a colour are additions). ``TrackerOptions.printed()``
    selects the form of the thesis (docs/math/depth_tracker.md, section 9).

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
        scale: str | Sequence[str | None] | None = None,
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
        one_of(mode, ("auto", "depth", "rgbd", "rgb"), "mode")
        one_of(motion, _core.MotionModel.__members__, "motion")
        check_switches(collision, membership, threads)
        number = device_number(device)
        self.mode = mode
        self.mode_used = ["depth"] * len(self.shapes)
        self._color_map: tuple[Any, Any] = (None, None)  # of what camera and size, and the map
        # An overlap is at most 1.
        always: dict[str, Any] = {"color_max_overlap": 2.0} if mode in ("rgbd", "rgb") else {}
        if mode == "rgb":
            always["outline"] = True
        self.threads = threads
        self.device = "cpu" if number == CPU else f"cuda:{number}"
        self._any_device = device == "auto"  # a copy elsewhere takes what is there
        self.recover_lost = bool(recover)
        self.membership = membership
        self.motion = motion
        self._device_number, self.collision, self._always = number, collision, always
        self._reads_outline = mode == "rgb" or self.options.outline
        self._last: TrackResult | None = None
        self._lock = ReentrantLock()
        self._core = _core.Tracker(
            [s._core_args for s in self.shapes],
            self._frame_camera._core,
            self.options.replace(**self._always),
            self.threads,
            self.recover_lost,
            _core.MotionModel.__members__[self.motion],
            self._device_number,
            _core.Collision.__members__[COLLISIONS[self.collision]],
        )
        self._paint_all()
        self._free_sizes.mark_unfound(TrackerInterface(self))
        self._symmetries = symmetry_list(symmetry, len(self.shapes))
        declare(self._core, self._symmetries, self.shapes, mode)
        self._free_scales = free_scales(scale, self.shapes, self._free_sizes.shapes_unknown)
        if mode == "rgb" and any(self._free_scales):
            raise ValueError(
                "scale: expected None with mode='rgb', got 'free': a scale is estimated from depth"
            )
        for k in self._scaled():
            self._core.free_scale(k)

    def _scaled(self) -> list[int]:
        """The shapes whose scale is estimated."""
        return [k for k, free in enumerate(self._free_scales) if free]

    def _paint_all(self) -> None:
        self._painted: list[tuple[NDArray[np.uint8], NDArray[np.uint16]]] = []
        for k, shape in enumerate(self.shapes):
            self._paint(k, shape)

    def _replace_shapes(self, shapes: list[SDF], poses: NDArray[np.float64]) -> None:
        """Replace the volumes of the objects; tracking continues from `poses`."""
        self._core.replace_shapes([s._core_args for s in shapes], np.ascontiguousarray(poses))
        self.shapes = shapes
        self._paint_all()

    def __repr__(self) -> str:
        return f"Tracker({len(self.shapes)} shape{'s' * (len(self.shapes) != 1)}, {self._frame_camera!r})"

    @property
    def sizes(self) -> list[PrimitiveFit | None]:
        """Current size estimate of each `Primitive` among the shapes; None: another shape, or not found yet."""
        return self._free_sizes.fits(len(self.shapes))

    @property
    @one_thread("tracker")
    def scales(self) -> list[ScaleEstimate | None]:
        """Current scale of each shape with ``scale="free"`` over the one that was given; None: another shape."""
        return [estimate(self, k) if free else None for k, free in enumerate(self._free_scales)]

    def start(
        self,
        frame: Frame,
        poses: ArrayLike | Sequence[ArrayLike] | None = None,
        *,
        masks: Any = None,
        boxes: Any = None,
        clicks: Any = None,
        pose: Any = None,
        mask: Any = None,
        box: Any = None,
        click: Any = None,
    ) -> TrackResult:
        """Start or restart from poses, masks, boxes or clicks, or by searching the whole image.

        Parameters
        ----------
        frame : Frame
        poses : sequence of (4, 4) float64, one per shape, or the matrix itself for a single shape
            ``T_cam_obj``, metres; refined on this frame. Projected to the nearest rigid transform if within 1e-3.
        masks : sequence of (H, W) bool or uint8, one per shape, or the mask itself for a single shape
            Nonzero on the object, aligned with the depth image; the pose is searched within the mask.
        boxes : sequence of (x, y, w, h), one per shape, or the four numbers for a single shape
            In depth pixels; contains the object, and possibly other things.
        clicks : sequence of (x, y), one per shape, or the two numbers for a single shape
            A depth pixel on each object. The connected region there, without tables and walls, and its segmentation by
            colour are searched; the pose that best explains the image there is used.
        pose, mask, box, click : optional
            The same of the only shape, as in :meth:`recover`.

        Returns
        -------
        TrackResult
            With ``index`` 0. An object that is not found is ``"lost"`` and its pose is NaN. An object with two nearly
            equally good poses is ``"weak"``, with the reason "ambiguous"; ``runner_up`` is the relative score of the
            second one.

        Raises
        ------
        TypeError
            `frame` is not a Frame, or `poses`, `masks` or `boxes` are not arrays of numbers.
        ValueError
            Not one per shape; poses that are not finite or not rigid; an empty mask or one of the wrong size; a box
            without area or outside the image; more than one of the four given; a depth or colour image whose size
            differs from the camera's; no colour image with ``mode="rgbd"``; a click that is not on a surface, or on a
            table; a mask or click on something of a different size than the shape (the message names the unit, of the
            mesh or the depth, that may be wrong).
        """
        of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
        if self.mode == "rgb" and poses is None and pose is None:
            raise ValueError(
                "poses: expected one per shape with mode='rgb', got none; without depth there is no search: "
                "start(frame, poses=[...])"
            )
        count = len(self.shapes)
        several = {"poses": poses, "masks": masks, "boxes": boxes, "clicks": clicks}
        given = one_hint(several, {"pose": pose, "mask": mask, "box": box, "click": click}, count)
        camera = self._camera_of(frame)
        colors = self._colors_of(frame)
        places: list[Place] = [None] * count
        if given is not None and given[0] == "clicks":
            places = click_list(given[1], count)
        elif given is not None:
            places = place_list(*given, count, camera)
        return self._start_at(frame, camera, colors, places)

    def _start_at(
        self, frame: Frame, camera: Camera, colors: tuple[Any, Any], places: list[Place]
    ) -> TrackResult:
        with self._lock.held("changes", "tracker"):
            begin = time.perf_counter()
            view = self._core_frame(frame, camera, colors)
            if self._free_sizes:
                places = self._core.located(view, places)
                self._free_sizes.start(TrackerInterface(self), frame, camera, places)
            return self._finish(frame, view, self._core.start(view, places, self.names), begin)

    @one_thread("tracker")
    def track(self, depth: Frame | ArrayLike, color: ArrayLike | None = None) -> TrackResult:
        """Track the objects in the next frame.

        Parameters
        ----------
        depth : Frame, or (H, W) float32 m (0 = none)
            The frame, or its depth image.
        color : (H, W, 3) uint8, optional
            Aligned to depth, or as given by the RGBDCamera.

        Returns
        -------
        TrackResult
            A lost object keeps its last good pose, and is searched for there in the next frame. An unreadable or empty
            frame results in ``"bad_frame"``, not an exception.

        Raises
        ------
        RuntimeError
            Before :meth:`start`.
        ValueError
            A depth or colour image whose size differs from the camera's; no colour image with ``mode="rgbd"``. The
            state of the tracker is unchanged.
        """
        frame = depth if isinstance(depth, Frame) else Frame(depth, color)
        if self._core.index < 0:
            raise RuntimeError("track: call start(frame, poses=[...]) first")
        camera, colors = self._camera_of(frame), self._colors_of(frame)
        begin = time.perf_counter()
        if self._free_sizes:
            self._free_sizes.find(TrackerInterface(self), frame, camera, self.recover_lost)
        view = self._core_frame(frame, camera, colors)
        result = self._finish(frame, view, self._core.track(view, self.names), begin)
        if self._free_sizes:
            self._free_sizes.look(TrackerInterface(self), frame, camera, result)
        return result

    @one_thread("tracker")
    def recover(
        self, frame: Frame, k: int | None = None, mask: ArrayLike | None = None, box: Any = None
    ) -> TrackResult:
        """Search for lost objects in this frame exhaustively.

        Parameters
        ----------
        frame : Frame
            Usually the last tracked frame; the frame index does not advance.
        k : int, optional
            Only this object, whether lost or not. None: all lost objects.
        mask : (H, W) bool or uint8, optional
        box : (x, y, w, h), optional
            Search region, as in :meth:`start`. With several lost objects `k` is required.

        Returns
        -------
        TrackResult
            The last result, with the entries of the searched objects replaced.

        Raises
        ------
        RuntimeError
            Called before :meth:`start`, or between :meth:`add` or :meth:`remove` and the next frame.
        ValueError
            An empty mask, a box outside the image, both given, or either given for several objects.
        """
        of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
        if self._last is None:
            first = (
                "track(frame), because the set of objects has changed since the last frame"
                if self._core.index >= 0
                else "start(frame)"
            )
            raise RuntimeError(f"recover: call {first} first")
        camera, colors = self._camera_of(frame), self._colors_of(frame)
        place = one_place(None, mask, box, camera)
        last = self._last
        if k is None:
            wanted = [j for j, s in enumerate(last.status) if s is Status.LOST]
        else:
            wanted = [object_number(k, len(self.shapes))]
        if place is not None and len(wanted) > 1:
            raise ValueError(
                f"k: expected the index of the object to search for, got None with {len(wanted)} objects lost"
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
        """Replace the last pose of object k; it is no longer considered lost.

        Parameters
        ----------
        k : int
        T : (4, 4) float64
            ``T_cam_obj``, metres.
        covariance : (6, 6) float64, optional
            Covariance of T, as in :class:`TrackResult`: makes T a Gaussian prior in the next frame, replacing the weak
            prior around the predicted pose.
        """
        index = object_number(k, len(self.shapes))
        pose = rigid_pose(T, "T")
        prior = None if covariance is None else pose_covariance(covariance)
        with self._lock.held("changes", "tracker"):
            self._core.set_pose(index, pose, prior)
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
            Its location in the next frame, as in :meth:`start`: one of them, or none to search the whole image.
        name : str, optional
        """
        if not isinstance(shape, Primitive):
            of_kind(shape, SDF, "shape", "make one with SDF.from_mesh, or give a st.Primitive")
        place = one_place(pose, mask, box, self._frame_camera)
        with self._lock.held("changes", "tracker"):
            volume = self._free_sizes.add(len(self.shapes), shape, place)
            k: int = self._core.add(volume._core_args, place)
            self._paint(k, volume)
            self.shapes = [*self.shapes, volume]
            self.names = [*self.names, f"object {k}" if name is None else str(name)]
            self.mode_used = [*self.mode_used, "depth"]
            self._symmetries.append(None)
            self._free_scales.append(False)
            self._free_sizes.mark_unfound(TrackerInterface(self))
            self._last = None
            return k

    @one_thread("tracker")
    def remove(self, k: int) -> None:
        """Stop tracking object k; the indices of later objects decrease by one."""
        index = object_number(k, len(self.shapes))
        if len(self.shapes) == 1:
            raise ValueError("k: expected at least one remaining object, got the only one")
        self._core.remove(index)
        self._free_sizes.remove(index)
        for values in (self.shapes, self.names, self.mode_used, self._symmetries, self._free_scales):
            del values[index]
        self._drop_unused_paint()
        self._last = None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write shapes, settings and the state of tracking to one file, completely or not at all (docs/files.md)."""
        from sdftrack._internal.saved_file import write
        from sdftrack.tracking.saved_state import KIND, content_of

        write(path, KIND, content_of(self.__getstate__()))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Tracker:
        """Load a file written by :meth:`save`; tracking continues after its last frame, with the same bits.

        Raises
        ------
        FileNotFoundError, ValueError
            No such file; a file of another kind, of a later version, truncated or damaged.
        """
        from sdftrack._internal.saved_file import loaded
        from sdftrack.tracking.saved_state import KIND, state_from

        return loaded(path, KIND, Tracker, state_from)

    @property
    @one_thread("tracker")
    def color_delay(self) -> ColorDelay | None:
        """Delay of the colour images relative to the depth images, estimated from all objects since :meth:`start`.

        If the outline in the colour image is used (``mode="rgbd"`` with ``outline``), its displacement from the pose
        estimated by depth is compared with the motion (docs/math/outline.md, section 6). The estimate does not affect
        tracking.

        Returns
        -------
        ColorDelay or None
            None: unknown, for lack of timestamps, colour, a distinct outline, or motion.
        """
        delay_s, sd_s, frames = self._core.color_delay()
        return ColorDelay(delay_s, sd_s, frames) if frames and sd_s < COLOR_DELAY_KNOWN_S else None

    @one_thread("tracker")
    def __getstate__(self) -> dict[str, Any]:
        return {
            "shapes": list(self.shapes),
            "camera": self.camera,
            "arguments": {
                "mode": self.mode,
                "names": list(self.names),
                "options": self.options,
                "sensor": self.sensor,
                "threads": self.threads,
                "device": "auto" if self._any_device else self.device,
                "recover": self.recover_lost,
                "motion": self.motion,
                "membership": self.membership,
                "collision": self.collision,
                "symmetry": list(self._symmetries),
                "scale": ["free" if free else None for free in self._free_scales],
            },
            # Nothing of it changes with this tracker. Other versions cannot read `core`: they go on from the rest.
            "progress": {
                "core": self._core.state(),
                "index": self._core.index,
                "last": self._last,
                "best": self._core.best,
                "sizes": self._free_sizes.copy(),
                "frame_camera": self._frame_camera,
                "modes": list(self.mode_used),
            },
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        arguments = dict(state["arguments"])
        single = arguments.pop("options").to_dict()  # which the sensor has been asked for already
        Tracker.__init__(self, state["shapes"], state["camera"], **arguments, **single)
        progress = state["progress"]
        self._free_sizes, last = progress["sizes"].copy(), progress["last"]
        self._last = last
        self.mode_used = list(progress["modes"])
        self._use_camera(progress["frame_camera"])
        if progress["core"] and self._core.set_state(progress["core"]):
            if self._core.index != progress["index"]:
                raise ValueError(f"index: expected {self._core.index}, got {progress['index']}")
            return
        LOG.warning(
            "the saved tracker is of another version: it continues from its last poses, without what it learned"
        )
        self._free_sizes.mark_unfound(TrackerInterface(self))
        time_s = float("nan") if last is None or last.timestamp is None else float(last.timestamp)
        followed = [] if last is None else [s in (Status.OK, Status.WEAK) for s in last.status]
        self._core.resume(progress["index"], time_s, followed, np.ascontiguousarray(progress["best"]))

    @one_thread("tracker")
    def _interrupt(self, index: int) -> None:
        """Mark a discontinuity: the last frame gets this index, and no motion is predicted from it to the next one."""
        self._core.interrupt(index)
        self._last = None

    def _camera_of(self, frame: Frame) -> Camera:
        camera = depth_camera(self.camera if frame.camera is None else frame.camera)
        if frame.depth is not None and frame.depth.shape != (camera.height, camera.width):
            raise ValueError(
                f"depth: expected the camera's size {camera.width} x {camera.height}, got "
                f"{frame.depth.shape[1]} x {frame.depth.shape[0]}; scale the camera with Camera.scaled"
            )
        return camera

    def _colors_of(self, frame: Frame) -> tuple[Any, Any]:
        """The frame's colour image, if it is used, and the mapping of its pixels."""
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
        """Pass a shape's colours to the core; copies of one shape share them."""
        if shape.colors is None:
            return
        for rgba, seen in self._painted:
            if rgba is shape.colors:
                self._core.paint(k, seen)
                return
        self._drop_unused_paint()
        self._painted.append((shape.colors, rgb_seen(shape.colors)))
        self._core.paint(k, self._painted[-1][1])

    def _drop_unused_paint(self) -> None:
        self._painted = [p for p in self._painted if any(p[0] is s.colors for s in self.shapes)]

    def _use_camera(self, camera: Camera) -> None:
        if camera is not self._frame_camera and camera != self._frame_camera:
            self._core.set_camera(camera._core)
            self._frame_camera = camera

    def _core_frame(self, frame: Frame, camera: Camera, colors: tuple[Any, Any]) -> _core.TrackerFrame:
        self._use_camera(camera)
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
        colored = "rgb" if self.mode == "rgb" or frame.depth is None else "rgbd"
        for k in self._scaled():
            enlarge(self, k)
        self._note_modes(found["index"], [colored if used else "depth" for used in found.pop("color_used")])
        weights, foreground = self._membership(frame, view)
        self._last = assembled(
            found,
            seconds=time.perf_counter() - begin,
            timestamp=frame.timestamp,
            membership=weights,
            foreground=foreground,
            sensor="" if self.sensor is None else self.sensor.name,
        )
        return self._last
