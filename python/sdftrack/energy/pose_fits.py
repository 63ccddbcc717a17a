# SPDX-License-Identifier: MIT
"""Many objects of one frame, each fitted on its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.validation import THREADS, numbers, positive, whole
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.device import device_number
from sdftrack.energy.energy import depth_and_mask, state_poses
from sdftrack.frame import Frame
from sdftrack.options import TrackerOptions
from sdftrack.results import Step
from sdftrack.sdf import SDF
from sdftrack.sdf.volume import shape_list

Array = NDArray[np.float64]
MOST_STEPS, MOST_ROUNDS = 1000, 100


@dataclass(frozen=True, eq=False)
class PoseFit:
    """The fit of one object, by `PoseFitter` or `fit_poses`.

    Attributes
    ----------
    pose : (4, 4) float64
        ``T_cam_obj``, m.
    covariance : (6, 6) float64
        (x, y, z, rx, ry, rz), m and rad, camera axes, about the object's origin; from the normal equations at the
        minimum, with independent errors of the readings unless ``correlation_area_px`` is given. Directions without
        data have the variance of the diameter and of pi.
    cost : float
        Sum of the penalty over the pixels, dimensionless.
    pixels, hits : int
        Readings near the object at the start, and how many of their rays met the model there.
    steps : list of Step
        Of the last round.
    stop : str
        As `Minimum.stop`; "no_data": no reading near the object, and the pose is the start.
    """

    pose: Array
    covariance: Array
    cost: float
    pixels: int
    hits: int
    steps: list[Step]
    stop: str


class PoseFitter:
    """Fits many objects of one depth image, each on its own from its own start, by their depths.

    One scale, without the tracker's free space, search and judgement: for poses
    that are nearly known, such as those of the frame before. On a GPU the depth image is sent once, the pixels are
    chosen there, and all objects are fitted at once; the host waits for the results alone.

    Parameters
    ----------
    shapes : SDF or sequence of SDF
        One for each pose of `fit`; one alone stands for all of them. The same SDF twice is stored once.
    camera : Camera or RGBDCamera
    device : {"cpu", "cuda", "cuda:N", "auto"}
    threads : int
        Of the CPU; 0: all cores. The results have the same bits for any number.

    >>> fitter = PoseFitter(sdf, camera)                                  # doctest: +SKIP
    >>> fits = fitter.fit(frame, [T_1, T_2, T_3])                         # doctest: +SKIP
    >>> [fit.pose for fit in fits]                                        # doctest: +SKIP
    """

    def __init__(
        self,
        shapes: SDF | Sequence[SDF],
        camera: Camera | RGBDCamera,
        *,
        device: str = "auto",
        threads: int = 0,
    ) -> None:
        many = shape_list(shapes)
        self.camera = depth_camera(camera)
        distinct = list({id(shape): shape for shape in many}.values())
        place = {id(shape): k for k, shape in enumerate(distinct)}
        self._of = [place[id(shape)] for shape in many]
        self._threads = whole(threads, "threads", 0, what=THREADS)
        self._options: tuple[dict[str, Any], Any] | None = None
        self._core = _core.SingleFitter(
            [shape._core_args for shape in distinct], self.camera._core, device_number(device)
        )

    def fit(
        self,
        frame: Frame,
        poses: ArrayLike,
        *,
        scale_m: float = 0.002,
        rounds: int = 2,
        max_steps: int = 10,
        **options: Any,
    ) -> list[PoseFit]:
        """Fit each object to `frame`.

        Parameters
        ----------
        frame : Frame
            Its ``mask``, if it has one, is that of all objects together.
        poses : (N, 4, 4) float64
            ``T_cam_obj`` of each object: selects its pixels and is where its fit starts.
        scale_m : float
            s of the logistic density (thesis Eq. 3.11), m: about the sensor's noise; larger from a start farther off.
        rounds : int
            Each decides anew which rays meet the model, where the one before has ended.
        max_steps : int
            Trials of each object in a round. A step that promises less than 12 in log-likelihood is the last.
        options : fields of TrackerOptions
            ``residual``, ``curvature``, ``outlier_floor``, ``padding_m``, ``noise_m``, ``noise_per_m``,
            ``max_pixels``, ``correlation_area_px``.

        Returns
        -------
        list of PoseFit
            In the order of `poses`. On a GPU the same pixels as on the CPU, and poses that agree to 1e-5 m and rad.

        Raises
        ------
        ValueError
            A frame without depth or of another size than the camera's; another number of poses than of shapes; a
            scale or a number of steps that is not positive.
        """
        (depth, mask), scale = depth_and_mask(frame), positive(scale_m, "scale_m")
        trials = whole(max_steps, "max_steps", 1, MOST_STEPS)
        looks = whole(rounds, "rounds", 1, MOST_ROUNDS)
        T = numbers(poses, "poses")
        count = len(self._of) if len(self._of) > 1 else (len(T) if T.ndim == 3 else 1)
        # The core looks whether they are rigid: here, with numpy, that would take half as long as a fit.
        starts = T if T.shape == (count, 4, 4) else state_poses(T, count)
        found = self._core.fit(
            depth, mask, self._of if len(self._of) > 1 else self._of * count, list(starts), scale,
            self._core_options(options), trials, looks, self._threads,
        )  # fmt: skip
        return [_pose_fit(one, scale) for one in found]

    def _core_options(self, options: dict[str, Any]) -> Any:
        """Checked once: that takes longer than a fit, and most frames have the same ones."""
        if self._options is None or self._options[0] != options:
            self._options = dict(options), TrackerOptions(**options)
        return self._options[1]


def _pose_fit(found: dict[str, Any], scale_m: float) -> PoseFit:
    """In place of its constructor, which sets one attribute of a frozen object after the other."""
    count = found["pixels"]
    found["steps"] = [
        Step(cost, damping, accepted, scale_m, count) for cost, damping, accepted in found["steps"]
    ]
    fit = object.__new__(PoseFit)
    fit.__dict__.update(found)
    return fit


def fit_poses(
    shapes: SDF | Sequence[SDF],
    camera: Camera | RGBDCamera,
    frame: Frame,
    poses: ArrayLike,
    *,
    device: str = "auto",
    threads: int = 0,
    **options: Any,
) -> list[PoseFit]:
    """Fit many objects of one frame, each on its own: `PoseFitter` for a single frame.

    Parameters
    ----------
    shapes, camera, device, threads
        See `PoseFitter`, which keeps the shapes from frame to frame (and on the GPU).
    frame, poses, options
        See `PoseFitter.fit`.

    Returns
    -------
    list of PoseFit

    >>> import sdftrack as st
    >>> ball = st.SDF.sphere(0.05, voxels=50)
    >>> camera = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)
    >>> poses = [st.geometry.pose([0, 0, 0], [x, 0, 0.5]) for x in (-0.1, 0.1)]
    >>> depth = sum(ball.render(camera, pose)[0] for pose in poses)
    >>> start = [st.geometry.pose([0, 0, 0], [x, 0.004, 0.503]) for x in (-0.103, 0.104)]
    >>> fits = st.fit_poses(ball, camera, st.Frame(depth), start, device="cpu")
    >>> [bool(abs(fit.pose[:3, 3] - pose[:3, 3]).max() < 2e-4) for fit, pose in zip(fits, poses)]
    [True, True]
    """
    return PoseFitter(shapes, camera, device=device, threads=threads).fit(frame, poses, **options)
