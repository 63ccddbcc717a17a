# SPDX-License-Identifier: MIT
"""Access to the kernels, for experiments and teaching: points, the energy of a frame, and the optimiser."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.rotations import RotationErrors, rigid_pose
from sdftrack._internal.unknown_option import refuse_unknown
from sdftrack._internal.validation import numbers, of_kind, one_of, positive
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.camera.rgbd import color_map
from sdftrack.device import device_number
from sdftrack.frame import Frame, as_given
from sdftrack.options import TrackerOptions
from sdftrack.results import Step
from sdftrack.sdf import SDF
from sdftrack.sdf.volume import shape_list

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class State:
    """A point in the space of unknowns.

    Attributes
    ----------
    poses : (M, 4, 4) float64
        ``T_cam_obj``, m.
    camera : Camera, optional
        Camera whose fx, fy, cx, cy are unknowns with ``"intrinsics"``; None: the energy's own.
    scales : (M,) float64, optional
        Scale relative to the shape, with ``"scale"``; None: 1.
    """

    poses: Array
    camera: Camera | None = None
    scales: Array | None = None


@dataclass(frozen=True, eq=False)
class Linearization:
    """The quadratic model of an energy: order of unknowns (vx, vy, vz, wx, wy, wz [, log scale | fx, fy, cx, cy]).

    Unknowns are increments of ``T_obj_cam`` about the centre of the object's box, v in m and w in rad.
    """

    cost: float
    gradient: Array
    hessian: Array
    count: int


@dataclass(frozen=True, eq=False)
class Minimum:
    """Result of :func:`minimize`: final state, all steps, and stopping reason."""

    x: State
    steps: list[Step]
    stop: str
    cost: float
    count: int


def depth_and_mask(frame: Frame) -> tuple[NDArray[np.float32], NDArray[np.uint8] | None]:
    """The measured depth and the mask of a frame, for the core."""
    of_kind(frame, Frame, "frame", "make one with st.Frame(depth)")
    if frame.depth is None:
        raise ValueError("frame: expected a depth image, got none")
    depth = as_given(frame).depth
    assert depth is not None
    return depth, None if frame.mask is None else np.ascontiguousarray(frame.mask).view(np.uint8)


def state_poses(poses: ArrayLike, count: int) -> Array:
    """Validate (count, 4, 4) rigid poses."""
    T = numbers(poses, "poses")
    T = T[None] if T.ndim == 2 else T
    if T.ndim != 3 or len(T) != count:
        raise ValueError(
            f"poses: expected one 4x4 matrix per shape ({count}), got an array of shape {T.shape}"
        )
    errors = RotationErrors()
    rigid = np.stack([rigid_pose(np.ascontiguousarray(each), "poses", errors) for each in T])
    errors.tell()
    return rigid


MAX_JOINED = 4  # objects in a union


class Energy:
    """The data energy of one object in one frame, as a function of its pose, or of the union of up to four objects.

    The field of a union is the soft minimum of its objects' (thesis Eq. 5.14); unknowns are ordered by object.

    The pixels (those near the object at `poses`) and their class (the ray meets the model, or not) are fixed at
    construction, so the cost is a function of the state alone and can be differentiated numerically.

    Parameters
    ----------
    shapes : SDF or sequence of 1 to 4 SDF
    camera : Camera or RGBDCamera
    frame : Frame
    poses : (4, 4) or (M, 4, 4) float64
        ``T_cam_obj`` that selects the pixels; also ``energy.start``.
    penalty : {"depth", "rgbd"}
        ``"rgbd"`` weights each pixel by its colour posterior; the histograms are built from this frame, inside and
        around its ``mask``, or without one from the measurements on and off the surface at `poses`.
    unknowns : ("pose",), ("pose", "intrinsics") or ("pose", "scale")
    scale_m : float
        s of the logistic density (thesis Eq. 3.11), m.
    threads : int
        0: all cores. The sums have the same bits for any number.
    device : {"cpu", "cuda", "cuda:N", "auto"}
        Device for the sums; results on a GPU agree with the CPU to 1e-4.
    options : fields of TrackerOptions
        ``residual``, ``curvature``, ``outlier_floor``, ``padding_m``, ``noise_m``, ``max_pixels``,
        ``color_likelihood``, ...

    Raises
    ------
    ValueError
        An unknown penalty or set of unknowns; a frame without depth, or for ``"rgbd"`` without colour, with a colour
        image whose size differs from the camera's, with an empty mask, or with too few pixels of the object.

    >>> energy = Energy(sdf, camera, frame, T_cam_obj)                    # doctest: +SKIP
    >>> energy.linearize(energy.start).gradient.shape                     # doctest: +SKIP
    (6,)
    """

    def __init__(
        self,
        shapes: SDF | Sequence[SDF],
        camera: Camera | RGBDCamera,
        frame: Frame,
        poses: ArrayLike,
        *,
        penalty: str = "depth",
        unknowns: tuple[str, ...] = ("pose",),
        scale_m: float = 0.002,
        threads: int = 1,
        device: str = "cpu",
        **options: Any,
    ) -> None:
        many = shape_list(shapes)
        if len(many) > MAX_JOINED:
            raise ValueError(f"shapes: expected 1 to {MAX_JOINED} SDFs, got {len(many)}")
        one_of(penalty, ("depth", "rgbd"), "penalty")
        known = (("pose",), ("pose", "intrinsics"), ("pose", "scale"))
        if tuple(unknowns) not in known:
            raise ValueError(f"unknowns: expected one of {known}, got {unknowns!r}")
        if len(many) > 1 and tuple(unknowns) != ("pose",):
            raise ValueError(f"unknowns: expected ('pose',) of several shapes, got {unknowns!r}")
        depth, mask = depth_and_mask(frame)
        color = None
        if penalty == "rgbd":
            if frame.color is None:
                raise ValueError("frame: expected a colour image for penalty='rgbd', got none")
            if tuple(unknowns) != ("pose",):
                raise ValueError(f"unknowns: expected ('pose',) with penalty='rgbd', got {unknowns!r}")
            if len(many) > 1:
                raise ValueError(f"shapes: expected one SDF with penalty='rgbd', got {len(many)}")
            color = frame.color
        scale = positive(scale_m, "scale_m")
        self.shapes = many
        self.camera = depth_camera(camera)
        self.unknowns = tuple(unknowns)
        self.options = TrackerOptions().replace(**options)
        T = state_poses(poses, len(many))
        self._core = _core.FrameEnergy(
            [shape._core_args for shape in many], self.camera._core,
            depth, mask, list(T), self.options, scale,
            "scale" in unknowns, "intrinsics" in unknowns, threads,
            color, None if color is None else color_map(camera, color), device_number(device),
        )  # fmt: skip
        self.start = State(
            T, self.camera if "intrinsics" in unknowns else None, np.ones(1) if "scale" in unknowns else None
        )

    def _state(self, x: State) -> Any:
        if not isinstance(x, State):
            raise TypeError(f"x: expected a State, got {type(x).__name__}; energy.start is one")
        camera = x.camera or self.camera
        scales = [1.0] if x.scales is None else [float(s) for s in x.scales]
        if len(scales) != 1 or not 0 < scales[0] < np.inf:
            raise ValueError(f"x: expected scales of one number > 0, got {scales}")
        if "scale" not in self.unknowns:
            scales = []
        T = state_poses(x.poses, len(self.shapes))
        return self._core.state(list(T), [camera.fx, camera.fy, camera.cx, camera.cy], scales)

    def cost(self, x: State) -> float:
        """Sum of the penalty over the pixels, dimensionless."""
        return float(self._core.cost(self._state(x)))

    def linearize(self, x: State) -> Linearization:
        """Cost, gradient and (positive semi-definite) Hessian at `x`."""
        return Linearization(**self._core.linearize(self._state(x)))

    def residuals(self, x: State) -> dict[str, NDArray[Any]]:
        """Arrays of one value per pixel.

        ``residual_m``; ``weight`` (the penalty's curvature there); ``hit`` (the ray meets the model); ``u_px``,
        ``v_px``, ``depth_m`` (the measurement); ``foreground`` (the colour posterior, with ``penalty="rgbd"``).
        """
        return dict(self._core.residuals(self._state(x)))

    def moved(self, x: State, delta: ArrayLike) -> State:
        """Apply an increment, in the order of :class:`Linearization`, to `x`, as the optimiser does."""
        step = numbers(delta, "delta")
        if step.ndim != 1:
            raise ValueError(f"delta: expected one number per unknown, got shape {step.shape}")
        return self._to_state(*self._core.retract(self._state(x), step))

    def _to_state(self, T: Sequence[Array], K: Sequence[float], scale: float) -> State:
        camera = None
        if "intrinsics" in self.unknowns:
            camera = dataclasses.replace(self.camera, fx=K[0], fy=K[1], cx=K[2], cy=K[3])
        return State(np.stack(T), camera, np.array([scale]) if "scale" in self.unknowns else None)


def minimize(energy: Energy, start: State | None = None, **lm_options: Any) -> Minimum:
    """Minimise an energy by Levenberg-Marquardt, the optimiser of all trackers in this library.

    Parameters
    ----------
    energy : Energy
    start : State, optional
        None: ``energy.start``.
    lm_options
        ``max_steps``, ``damping``, ``damping_up``, ``damping_down``, ``damping_max``, ``step_m``, ``step_rad``,
        ``cost_relative``, ``cost_gain`` (steps with a smaller predicted decrease are not tried), ``sure_gain`` (a step
        with a smaller predicted decrease is accepted without evaluation, and is the last), ``fixed`` (one bool per
        unknown: excluded from the system).

    Returns
    -------
    Minimum
        ``stop`` is "small_step", "small_gain", "max_steps", "damping_max", "not_finite" or "no_data"; the last three
        indicate an unreliable result.
    """
    of_kind(energy, Energy, "energy")
    options = _core.LmOptions()
    refuse_unknown(lm_options, [name for name in dir(options) if not name.startswith("_")])
    for name, value in lm_options.items():
        try:
            setattr(options, name, value)
        except TypeError:
            kind = "one bool per unknown" if name == "fixed" else "a number"
            raise TypeError(f"{name}: expected {kind}, got {value!r}") from None
    begin = energy._state(energy.start if start is None else start)
    x, steps, stop, cost, count = energy._core.minimize(begin, options)
    record = [Step(value, damping, accepted, float("nan"), count) for value, damping, accepted in steps]
    return Minimum(energy._to_state(*x), record, stop, cost, count)


# -- Back-projection of depth images to points


def back_project(
    depth: ArrayLike, camera: Camera | RGBDCamera, mask: ArrayLike | None = None
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Back-project the valid pixels of a depth image to points.

    Parameters
    ----------
    depth : (H, W) float, m, 0 or NaN = no measurement
    camera : Camera or RGBDCamera
    mask : (H, W) bool, optional
        False: omit the pixel.

    Returns
    -------
    points : (N, 3) float64
        Camera frame, m: ``depth * K^-1 (x, y, 1)``, distortion removed.
    pixels : (N, 2) int64
        (x, y) of each point.

    Raises
    ------
    ValueError
        The size of `depth` or `mask` differs from the camera's.
    """
    pinhole = depth_camera(camera)
    z = np.asarray(depth)
    points = pinhole.back_project(z)
    valid = np.isfinite(z) & (z > 0)
    if mask is not None:
        chosen = np.asarray(mask)
        if chosen.shape != z.shape:
            raise ValueError(f"mask: expected shape {z.shape} as depth, got {chosen.shape}")
        valid &= chosen != 0
    y, x = np.nonzero(valid)
    return np.ascontiguousarray(points[y, x], dtype=np.float64), np.stack([x, y], axis=1)
