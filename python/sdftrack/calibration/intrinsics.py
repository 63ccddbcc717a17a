# SPDX-License-Identifier: MIT
"""Intrinsics of a depth camera from a known object that is moved in front of it (thesis, section 3.6)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import THREADS, of_kind, whole
from sdftrack.calibration.intrinsics_result import (
    COLUMNS,
    ROWS,
    IntrinsicsResult,
    PerFrame,
    observe,
    per_frame_of,
    refuse_flat_shape,
    refuse_still_object,
    refuse_unobservable,
)
from sdftrack.calibration.lens import EXTRA, UNKNOWNS, camera_of, check_free, core_lens, extra_of, prior_sd
from sdftrack.calibration.statistics import covariance_of, excess_scatter, frame_test, half_width95
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame, as_given
from sdftrack.imaging.pose_hint import one_place
from sdftrack.results import Status, Step, TrackResult
from sdftrack.sdf import SDF
from sdftrack.tracking import Tracker

MIN_READINGS = 200  # of the object in a frame that is used
FIRST_LOOK, GROWTH = (
    4,
    1.5,
)  # frames when the lens is found first, and by how many times more it is found again
LENS_KNOWN = 20  # frames from which a tracker may judge by the shape
# A lens that is 10 % off bends a shape of some 10 cm by millimetres and ends it in the wrong place: as if by noise,
# and nothing to call the object lost for.
FORGIVING: dict[str, Any] = {"noise_m": 0.006, "lost_inliers": 0.05, "lost_evidence": 1e-6}
LOST_FOR_LONG = 3  # frames after which the object is looked for as if it had never been seen
FOLLOWED = (Status.OK, Status.WEAK)


class Follower:
    """Passes the measurements near the object in each frame to a `_core.Calibration`."""

    def __init__(
        self, core: Any, sdf: SDF, camera: Camera, improve: Callable[[int], None], threads: int
    ) -> None:
        self.core = core
        self.sdf = sdf
        self.first_camera = camera
        self.improve = improve
        self.threads = threads
        self.used: list[int] = []  # numbers of the frames that the core has
        self.left_out: dict[int, str] = {}
        self._tracker: Tracker | None = None
        self._forgives = True
        self._lost_frames = 0

    def follow(
        self, frames: Iterable[Frame], places: dict[str, Any], tell: Callable[[int], None] | None
    ) -> None:
        """Track through all frames; re-estimate the lens whenever their number has grown by half."""
        next_look = FIRST_LOOK
        for i, frame in enumerate(frames):
            of_kind(frame, Frame, f"frames[{i}]", "make one with st.Frame(depth)")
            reason = self._take(frame, places)
            if frame.depth is not None:
                places = {}  # what was said of the first frame does not hold for another
            if reason:
                self.left_out[i] = reason
            else:
                self.used.append(i)
                if len(self.used) == next_look:
                    self._look(next_look)
                    next_look = int(GROWTH * next_look)
            if tell is not None:
                tell(i + 1)

    def _take(self, frame: Frame, places: dict[str, Any]) -> str:
        """Pass one frame to the core; returns the reason if it cannot be used."""
        frame = as_given(frame)
        if frame.depth is None:
            return frame.error or "no depth image"
        seen = self._as_seen(frame.depth, frame.mask)
        result = self._tracked(seen, places)
        if result.status[0] not in FOLLOWED:
            return f"{result.status[0]}: {result.reason[0]}"
        mask = None if frame.mask is None else np.ascontiguousarray(frame.mask).view(np.uint8)
        count = self.core.add(as_given(seen).depth, mask, result.poses[0])
        if count < MIN_READINGS:
            self.core.drop([len(self.used)])
            return f"only {count} depth measurements of the object (expected at least {MIN_READINGS})"
        return ""

    def _tracked(self, seen: Frame, places: dict[str, Any]) -> TrackResult:
        if self._tracker is not None:
            lost_for_long = self._lost_frames >= LOST_FOR_LONG
            result = self._tracker.start(seen) if lost_for_long else self._tracker.track(seen)
            self._lost_frames = 0 if result.status[0] in FOLLOWED else self._lost_frames + 1
            return result
        # The camera is wrong at first, so nothing fits finely where it is expected.
        options = {"fine_first": False, **(FORGIVING if self._forgives else {})}
        self._tracker = Tracker(self.sdf, self.first_camera, mode="depth", threads=self.threads, **options)
        result = self._tracker.start(seen, **places)
        if result.status[0] not in FOLLOWED and not self.used:
            self._tracker = None  # the next frame is a start again
        return result

    def _look(self, frames: int) -> None:
        """Estimate the lens and the poses, and continue tracking from there."""
        self.improve(frames)
        if self._forgives and frames >= LENS_KNOWN:
            self._forgives, self._tracker = False, None
            blank = Frame(np.zeros(self.first_camera.shape, np.float32), check_units=False)
            self._tracked(blank, {"poses": self.core.poses[-1]})
        assert self._tracker is not None
        self._tracker.set_pose(0, self.core.poses[-1])

    def _as_seen(self, depth: NDArray[np.float32], mask: NDArray[np.bool_] | None) -> Frame:
        """The frame corrected by the current lens estimate."""
        values = self.core.lens.values
        extra = extra_of(values)
        if extra["depth_scale"] != 1 or extra["depth_offset"] != 0:
            scaled = extra["depth_scale"] * depth + np.float32(extra["depth_offset"])
            depth = np.where(depth > 0, scaled, 0).astype(np.float32)
        camera = camera_of(values, self.first_camera)
        if depth.shape != camera.shape:
            raise ValueError(
                f"frames: expected depth of the camera's size {camera.shape}, got {depth.shape} in one of them"
            )
        return Frame(depth, mask=mask, camera=camera, check_units=False)


MIN_FRAMES = 5
FIRST_SCALE_M, SCALE_M = 0.01, 0.004  # s of the first stage: before anything is known of the lens, and later
TEST_ROUNDS = 3  # of leaving frames out
RESIDUALS = {"ray_hit": _core.Residual.ray_hit, "point": _core.Residual.point}
MAX_LEFT_OUT = 0.3  # of the frames, by the tests
MAX_SCATTER = 1.2  # of the frames' own estimates, over what they state


def calibrate_intrinsics(
    frames: Iterable[Frame],
    sdf: SDF,
    initial_camera: Camera | RGBDCamera,
    initial_pose: ArrayLike | None = None,
    joint: bool = True,
    *,
    mask: ArrayLike | None = None,
    box: Sequence[float] | None = None,
    free: Sequence[str] = ("fx", "fy", "cx", "cy"),
    progress: Callable[[int], None] | None = None,
    residual: str = "ray_hit",
    max_pixels: int = 5000,
    threads: int = 0,
) -> IntrinsicsResult:
    """Estimate the intrinsics of a depth camera from frames of a known object, without pattern or correspondences.

    The object is tracked with the current camera estimate; the camera is re-estimated each time the number of frames
    has grown by half, and finally from all frames.

    Parameters
    ----------
    frames : iterable of Frame
        The object moving through the whole image, closer and farther, and rotating; a few tens of frames suffice.
    sdf : SDF
        Its shape, in metres.
    initial_camera : Camera or RGBDCamera
        Initial estimate: errors of 10 % in fx and fy and 20 px in cx and cy are acceptable. Fixed parameters are
        unchanged.
    initial_pose : (4, 4) float64, optional
        ``T_cam_obj`` in the first frame; or else `mask` ((H, W), not 0 on the object) or `box` ((x, y, w, h), depth
        pixels) to search in; none of them: the whole image is searched.
    joint : bool
        True: joint solution over all frames, which share the camera. False: information-weighted mean of the estimates
        of single frames (thesis Eq. 3.23). The result contains both.
    free : sequence of str
        Parameters to estimate, out of "fx", "fy", "cx", "cy", "skew", "k1", "k2" (of the lens distortion),
        "depth_scale" and "depth_offset" (``depth = scale * reading + offset``); the last two require a curved shape.
    progress : callable, optional
        Called with the number of frames processed so far.
    residual : "ray_hit" or "point"
        Residual of the last stage: depth at which the ray intersects the model minus measured depth; or that of the
        thesis, phi at the measured point (Eq. 3.11), for which fx and fy decrease with increasing noise.
    max_pixels : int
        Maximum number of pixels per frame, evenly distributed.
    threads : int
        0: all cores. The result has the same bits for any number.

    Returns
    -------
    IntrinsicsResult
        ``.camera``, ``.covariance``, ``.interval95``, ``.per_frame``, ``.poses``, ``.status``, ``.observability``, ...

    Raises
    ------
    TypeError
        An argument of the wrong type.
    ValueError
        An unknown name, depth of a size other than the camera's, fewer than five frames in which the object was found,
        an object that never moves, or a parameter that is not observable (the error names it and the reason).

    >>> found = calibrate_intrinsics(seq, sdf, st.Camera(600, 600, 300, 200, 640, 480))  # doctest: +SKIP
    >>> found.camera, found.interval95                                                    # doctest: +SKIP
    """
    begin = time.perf_counter()
    of_kind(sdf, SDF, "sdf", "make one with SDF.from_mesh")
    if isinstance(frames, Frame) or not hasattr(frames, "__iter__"):
        raise TypeError(f"frames: expected an iterable of st.Frame, got {type(frames).__name__}")
    if not isinstance(joint, bool):
        raise TypeError(f"joint: expected True or False, got {joint!r}")
    if residual not in RESIDUALS:
        raise ValueError(f"residual: expected one of {', '.join(RESIDUALS)}, got {residual!r}")
    max_pixels = whole(max_pixels, "max_pixels", MIN_READINGS)
    threads = whole(threads, "threads", 0, what=THREADS)
    first = depth_camera(initial_camera)
    names = check_free(free)
    refuse_flat_shape(sdf, names)
    options = _core.IntrinsicsOptions()
    options.residual = RESIDUALS[residual]
    options.max_pixels, options.threads = max_pixels, threads
    problem = _Problem(sdf, first, names, joint, options)
    place = one_place(initial_pose, mask, box, first)  # validated before a frame is read
    given = {"poses": initial_pose, "masks": mask, "boxes": box}
    places = {kind: place for kind, value in given.items() if value is not None}
    follower = Follower(problem.core, sdf, first, problem.improve, threads)
    follower.follow(frames, places, progress)
    _expect_enough(follower)
    refuse_still_object(np.array(problem.core.poses))
    problem.refuse_what_slides(len(follower.used))
    problem.finish(follower)
    return problem.result(follower, begin)


def _expect_enough(follower: Follower) -> None:
    if len(follower.used) >= MIN_FRAMES:
        return
    total = len(follower.used) + len(follower.left_out)
    reasons = [f"frame {i}: {reason}" for i, reason in list(follower.left_out.items())[:3]]
    detail = f" ({'; '.join(reasons)})" if reasons else ""
    raise ValueError(
        f"frames: expected the object in at least {MIN_FRAMES}, found it in {len(follower.used)} of {total}{detail}; "
        "record more, or give its location with initial_pose=, mask= or box="
    )


def _doubts(each: PerFrame) -> list[str]:
    scatter = excess_scatter(each.values, each.fused, each.covariances)
    if scatter < MAX_SCATTER:
        return []
    return [
        f"the estimates of single frames scatter {scatter:.1f} times as much as they state: the depth has errors in "
        "common over the object, and the intervals are too narrow; switch the camera's temporal and spatial filters off"
    ]


class _Problem:
    """The core's estimation problem and its interface."""

    def __init__(
        self, sdf: SDF, camera: Camera, free: tuple[str, ...], joint: bool, options: _core.IntrinsicsOptions
    ) -> None:
        self.first, self.free, self.joint = camera, free, joint
        self.sorted = tuple(name for name in UNKNOWNS if name in free)  # the core's order
        self.order = [self.sorted.index(name) for name in free]
        unknowns = [UNKNOWNS.index(name) for name in self.sorted]
        self.core = _core.Calibration(sdf._core_args, core_lens(camera), unknowns, options)
        self.steps: list[Any] = []
        self.per_frame: PerFrame | None = None

    def improve(self, frames: int) -> None:
        """Estimate the lens from the frames so far; a generic prior stabilises it while they are few."""
        start = core_lens(self.first).values
        now = [start[UNKNOWNS.index(name)] for name in self.sorted]
        sd = prior_sd(self.sorted, self.first)
        self.core.solve(FIRST_SCALE_M if frames < 20 else SCALE_M, now, sd, quick=True)

    def refuse_what_slides(self, frames: int) -> None:
        """ValueError if the pose is ambiguous in most frames, so that parameters are unobservable without a prior."""
        self.improve(frames)
        estimates = self.core.examine()
        if np.median(estimates["open_shifts"]) > 0:
            sd = np.sqrt(np.diag(covariance_of(estimates)[np.ix_(self.order, self.order)]))
            refuse_unobservable(self.free, sd, self.first, frames, estimates["open_shifts"])

    def finish(self, follower: Follower) -> None:
        """Solve over all frames, then again without outlier frames."""
        most = int(MAX_LEFT_OUT * len(follower.used))
        for k in range(TEST_ROUNDS):
            steps, _, _, count = self.core.polish() if k else self.core.solve(SCALE_M)
            self.steps += [
                Step(cost, damping, accepted, float("nan"), count) for cost, damping, accepted in steps
            ]
            self.estimates = self.core.examine()
            unfit = frame_test(self.estimates, MIN_READINGS)
            unfit = dict(list(unfit.items())[:most])
            if not unfit or len(follower.used) - len(unfit) < MIN_FRAMES:
                break
            most -= len(unfit)
            self.core.drop(list(unfit))
            for m, reason in unfit.items():
                follower.left_out[follower.used[m]] = reason
            follower.used = [i for m, i in enumerate(follower.used) if m not in unfit]
        self.per_frame = per_frame_of(self.core.solve_each(), self.order, follower.used)

    def result(self, follower: Follower, begin: float) -> IntrinsicsResult:
        assert self.per_frame is not None
        lens = np.array(self.core.lens.values)
        covariance = covariance_of(self.estimates)[np.ix_(self.order, self.order)]
        at = [UNKNOWNS.index(name) for name in self.free]
        if not self.joint:
            lens[at] = self.per_frame.fused
            covariance = self.per_frame.fused_covariance
        sd = np.sqrt(np.diag(covariance))
        refuse_unobservable(self.free, sd, self.first, len(follower.used), self.estimates["open_shifts"])
        half = half_width95(sd, len(follower.used))
        poses = np.array(self.core.poses)
        observed = observe(self.core.coverage(COLUMNS, ROWS), poses, self.free, covariance)
        bias = self.core.bias(0, 1)[self.order]
        advice = [*observed.advice, *_doubts(self.per_frame)]
        return IntrinsicsResult(
            camera=camera_of(lens.tolist(), self.first),
            free=self.free,
            values=lens[at],
            covariance=covariance,
            interval95=np.column_stack([lens[at] - half, lens[at] + half]),
            extra={name: float(lens[UNKNOWNS.index(name)]) for name in self.free if name in EXTRA},
            bias=bias,
            per_frame=self.per_frame,
            poses=poses,
            frames=list(follower.used),
            left_out=dict(sorted(follower.left_out.items())),
            noise_m=self.estimates["noise_m"],
            observability=observed,
            status="weak" if advice else "ok",
            reason="; ".join(advice),
            joint=self.joint,
            steps=self.steps,
            seconds=time.perf_counter() - begin,
        )
