# SPDX-License-Identifier: MIT
"""A coloured ball on a wand moved in front of a depth and a colour camera, with exact ground truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.synth.ball_view import BallView, Props
from sdftrack import geometry
from sdftrack._internal.validation import number, of_kind
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.frame import Frame
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.synth.noise import noise_of

Array = NDArray[np.float64]
DEPTH_CAMERA = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
COLOR_CAMERA = Camera(610.0, 612.0, 322.0, 246.0, 640, 480)
T_COLOR_DEPTH = geometry.pose((0.008, -0.014, 0.005), (-0.025, 0.001, -0.003))
VIEW = (0.44, 0.29)  # largest |x / z| and |y / z| of the path: the whole ball stays in both images
RATES_HZ = (0.31, 0.43, 0.17)  # of x / z, y / z and z: no two in a simple ratio, up to about 1 m/s


@dataclass(frozen=True, eq=False)
class BallScene:
    """The sequence and its ground truth.

    Attributes
    ----------
    sequence : Sequence
        ``camera`` is the true RGBDCamera, ``ground_truth[i][0]`` the ball (no rotation) at the time of the depth image.
    radius_m : float
    color : (r, g, b) of the ball in white light, 0..255
    centers_cam : (n, 3) float64
        The ball at the time of the depth image, depth camera, m.
    color_px : (n, 2) float64
        Projection of the ball's centre at the time of the colour image.
    time_offset_s : float
        Delay of colour relative to depth.
    volume_m : ((x, y, z), (x, y, z))
        Box in view tangents (x / z, y / z) and depth z (m) covered by the path.
    """

    sequence: Sequence
    radius_m: float
    color: tuple[int, int, int]
    centers_cam: Array
    color_px: Array
    time_offset_s: float
    volume_m: tuple[tuple[float, float, float], tuple[float, float, float]]

    @property
    def camera(self) -> RGBDCamera:
        """The true cameras."""
        return self.sequence.camera

    def random_points(self, n: int, seed: int = 0) -> Array:
        """(n, 3) points distributed over the volume (depth camera, m), for comparing mappings."""
        low, high = np.array(self.volume_m)
        p = np.random.default_rng(seed).uniform(low, high, (n, 3))
        return np.column_stack([p[:, :2] * p[:, 2:], p[:, 2]])


def ball_path(seed: int = 0, near_m: float = 0.55, far_m: float = 1.45) -> Any:
    """The centre (..., 3) of the ball at times (...), s: slow oscillations across and along the view, from `seed`."""
    phase = np.random.default_rng([seed, 11]).uniform(0, 2 * np.pi, 3)

    def at(t: ArrayLike) -> Array:
        s = np.sin(2 * np.pi * np.multiply.outer(np.asarray(t, float), RATES_HZ) + phase)
        z = 0.5 * (near_m + far_m) + 0.5 * (far_m - near_m) * s[..., 2]
        return np.stack([VIEW[0] * s[..., 0] * z, VIEW[1] * s[..., 1] * z, z], axis=-1)

    return at


def ball_scene(
    n: int = 60,
    radius_m: float = 0.04,
    noise: Any = 0.001,
    seed: int = 0,
    *,
    ball_color: tuple[int, int, int] = (225, 60, 30),
    depth_camera: Camera = DEPTH_CAMERA,
    color_camera: Camera = COLOR_CAMERA,
    T_color_depth: ArrayLike | None = None,
    path: Any = None,
    fps: float = 15.0,
    time_offset_s: float = 0.0,
    exposure_s: float = 0.0,
    wand: bool = True,
    hand: bool = True,
    clutter: bool = True,
    color_noise: float = 2.0,
    gloss: float = 0.25,
) -> BallScene:
    """A ball moved through the working volume; the same arguments give the same images.

    Parameters
    ----------
    n : int
        Frames.
    radius_m : float
    noise : None, sigma in metres, "kinect", or a function
        Of the depth image, as for :func:`sdftrack.synth.sequence`.
    seed : int
        Seed of the path, the noise and the surroundings.
    ball_color : (r, g, b), 0..255
    depth_camera, color_camera : Camera
        The colour camera may have another size and lens distortion.
    T_color_depth : (4, 4), optional
        Maps depth camera to colour camera, m; None: 25 mm apart and rotated by one degree.
    path : function t (s) -> (..., 3) centres in the depth camera's frame, m; or (n, 3) centres, one a frame
    fps : float
        Frames per second.
    time_offset_s : float
        Delay of colour relative to depth.
    exposure_s : float
        Exposure of the colour image: the ball is blurred along its path.
    wand, hand, clutter : bool
        A stick below the ball, a hand with forearm at its end, coloured objects in front of the wall.
    color_noise : float
        Standard deviation in grey values.
    gloss : float
        Strength of the highlight, 0 to 1.

    Returns
    -------
    BallScene

    Examples
    --------
    >>> scene = ball_scene(2, hand=False)
    >>> scene.sequence[0].color.shape
    (480, 640, 3)
    """
    if isinstance(n, (bool, str)) or int(n) != n or n < 1:
        raise ValueError(f"n: expected a number of frames above 0, got {n!r}")
    for name, value, low in (("radius_m", radius_m, 0), ("fps", fps, 0)):
        if not number(value, name) > low:
            raise ValueError(f"{name}: expected a number above {low}, got {value!r}")
    of_kind(depth_camera, Camera, "depth_camera")
    of_kind(color_camera, Camera, "color_camera")
    T = T_COLOR_DEPTH if T_color_depth is None else geometry.rigid(T_color_depth, "T_color_depth")
    rig = RGBDCamera(depth_camera, color_camera, T_color_depth=T)
    times = np.arange(int(n)) / fps
    at = _path_of(path, seed, times)
    props = Props(radius_m, ball_color, wand, hand, clutter, seed, gloss)
    centers = at(times)
    frames = _Frames(rig, props, at, times, noise_of(noise), seed, time_offset_s, exposure_s, color_noise)
    truth = np.tile(np.eye(4), (int(n), 1, 1))
    truth[:, :3, 3] = centers
    sequence = Sequence(frames, rig, truth, layout="memory", name="ball on a wand")
    z = centers[:, 2]
    volume = ((-VIEW[0], -VIEW[1], float(z.min())), (VIEW[0], VIEW[1], float(z.max())))
    px = rig.project_to_color(at(times + time_offset_s))
    return BallScene(sequence, radius_m, ball_color, centers, px, time_offset_s, volume)


def _path_of(path: Any, seed: int, times: Array) -> Any:
    if path is None:
        return ball_path(seed)
    if callable(path):
        return path
    points = np.asarray(path, dtype=np.float64)
    if points.shape != (len(times), 3):
        raise ValueError(f"path: expected a function of time or shape ({len(times)}, 3), got {points.shape}")
    return lambda t: np.stack([np.interp(t, times, points[:, k]) for k in range(3)], axis=-1)


class _Frames:
    """Renders frames on access."""

    def __init__(
        self,
        rig: RGBDCamera,
        props: Props,
        at: Any,
        times: Array,
        noise: Any,
        seed: int,
        offset_s: float,
        exposure_s: float,
        color_noise: float,
    ) -> None:
        assert rig.color is not None
        assert rig.T_color_depth is not None
        self._depth = BallView(rig.depth, np.eye(4), props)
        self._color = BallView(rig.color, rig.T_color_depth, props)
        self._at, self._times, self._noise, self._seed = at, times, noise, seed
        self._offset_s, self._exposure_s, self._color_noise = offset_s, exposure_s, color_noise

    def __len__(self) -> int:
        return len(self._times)

    def __getitem__(self, i: int) -> Frame:
        rng = np.random.default_rng([self._seed, 12, i])
        t = float(self._times[i])
        depth, cosine = self._depth.depth(self._at(t))
        if self._noise is not None:
            depth = self._noise(depth, cosine, rng)
        taken = t + self._offset_s
        color = self._color.color(self._at, taken, self._exposure_s)
        noisy = color + self._color_noise * rng.standard_normal(color.shape, dtype=np.float32)
        return Frame(depth, np.clip(np.rint(noisy), 0, 255).astype(np.uint8), t, index=i)
