# SPDX-License-Identifier: MIT
"""Frames rendered when asked for: objects on their paths, surroundings, a hand, and the sensor's noise."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.synth.noise import Noise, noise_of
from sdftrack.synth.surroundings import Layer, background, hand_mesh, mesh_layer
from sdftrack.synth.trajectories import poses_of

__all__ = ["sequence"]

Array = NDArray[np.float64]
DEFAULT_CAMERA = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
SKIN = (205, 155, 130)
COLOR_NOISE = 2.0  # of 255, as a quiet camera has
HAND_GAP_M = 0.02
HAND_FRACTION = 0.3


def sequence(
    shape_or_mesh: Any,
    n: int,
    trajectory: Any = None,
    noise: Any = None,
    occluder: Any = None,
    seed: int = 0,
    *,
    camera: Camera | RGBDCamera | None = None,
    clutter: str | bool | None = None,
    color: bool = True,
    fps: float = 30.0,
    threads: int = 0,
) -> Sequence:
    """A sequence with exact ground truth, rendered frame by frame when it is asked for.

    The same arguments give the same images, bit by bit, in any order of access.

    Parameters
    ----------
    shape_or_mesh : SDF, Mesh, path of a mesh in metres, or a list of these
        Meshes are cast exactly, triangle by triangle. One object given twice is one model with two instances.
    n : int
        Frames.
    trajectory : "random" (default), "orbit", "static", a function, or (n, 4, 4) poses T_cam_obj
        `random_walk(step_m=, step_rad=)`, `orbit(...)` and `static(...)` make functions; (n, M, 4, 4) or a list
        gives each of M objects its own. Without, several objects keep side by side.
    noise : None, sigma in metres, "kinect", `Gaussian(...)`, `Kinect(...)`, or a function
    occluder : None, True or "hand" (0.3), or the fraction (0..0.8) of the first object that a hand hides
    seed : int
        Of everything random: path, noise, clutter, colours.
    camera : Camera, optional
        By default 640 x 480 with 525 px.
    clutter : None, "wall", "table" (and wall), "objects" (table, and ten things behind) or True for the last
    color : bool
        With colour images: the mesh's own colours, or a solid texture drawn from `seed`.
    fps : float
        Frames per second of the timestamps.
    threads : int
        0: all cores.

    Returns
    -------
    Sequence
        `ground_truth` in every frame, `models`, and `masks(i)`: the visible pixels of each object.

    Examples
    --------
    >>> from sdftrack import SDF
    >>> seq = sequence(SDF.box((0.1, 0.14, 0.18)), 2, noise=0.001, seed=3)
    >>> seq[0].depth.shape, sorted(seq.ground_truth)
    ((480, 640), [0, 1])
    """
    if isinstance(n, (bool, str)) or int(n) != n or n < 1:
        raise ValueError(f"n: expected a number of frames above 0, got {n!r}")
    if not fps > 0:
        raise ValueError(f"fps: expected frames per second above 0, got {fps}")
    given = list(shape_or_mesh) if isinstance(shape_or_mesh, list) else [shape_or_mesh]
    if not given:
        raise ValueError("shape_or_mesh: expected at least one shape, got an empty list")
    loaded: dict[int, Any] = {}
    bodies = [loaded.setdefault(id(s), _Body(s, k, seed)) for k, s in enumerate(given)]
    eye = DEFAULT_CAMERA if camera is None else depth_camera(camera)
    poses = _all_poses(trajectory, int(n), bodies, seed)
    frames = _Rendered(
        bodies,
        poses,
        eye,
        noise_of(noise),
        _fraction(occluder),
        _kind(clutter),
        color,
        seed,
        float(fps),
        threads,
    )
    distinct = list(dict.fromkeys(bodies))
    return Sequence(
        frames,
        RGBDCamera(eye),
        {i: {k: poses[k, i] for k in range(len(bodies))} for i in range(int(n))},
        _Models(distinct),
        objects=[1 + distinct.index(b) for b in bodies],
        masks=frames.masks,
        layout="memory",
        name="synthetic",
    )


class _Body:
    """A shape with what the renderer asks of it."""

    def __init__(self, shape: Any, k: int, seed: int) -> None:
        from sdftrack.mesh import Mesh

        if isinstance(shape, str | os.PathLike):
            shape = Mesh.load(shape)
        if not (hasattr(shape, "raycast") or hasattr(shape, "render")):
            raise TypeError(f"shape_or_mesh: expected SDF, Mesh or a path, got {type(shape).__name__}")
        self.shape = shape
        low, high = shape.bounds if hasattr(shape, "raycast") else _inside_bounds(shape)
        self.centre: Array = 0.5 * (np.asarray(low) + np.asarray(high))
        self.diameter = float(np.linalg.norm(np.asarray(high) - low))
        rng = np.random.default_rng([seed, 7, k])
        self._waves = rng.normal(size=(3, 3)) * 14 / self.diameter
        self._phase = rng.uniform(0, 2 * np.pi, 3)
        self._palette = rng.integers(30, 240, (3, 3)).astype(float)

    def layer(self, camera: Camera, T: Array, color: bool, threads: int) -> Layer:
        colors = None
        if hasattr(self.shape, "raycast"):
            depth, normals, colors = self.shape.raycast(camera, T, threads=threads)
        else:
            depth, normals = self.shape.render(camera, T)
        if not color:
            return Layer.of(camera, depth, normals, None)
        if colors is not None:
            known = colors
            return Layer.of(camera, depth, normals, lambda window: known[window])
        return Layer.of(camera, depth, normals, lambda window: self._texture(camera, depth, window, T))

    def _texture(
        self, camera: Camera, depth: NDArray[np.float32], window: tuple[slice, slice], T: Array
    ) -> NDArray[np.uint8]:
        """A solid texture: a smooth function of the point in the object's frame, the same from all sides."""
        near = depth[window]
        colors = np.zeros((*near.shape, 3), np.uint8)
        seen = near > 0
        z = near[seen].astype(float)[:, None]
        points = np.concatenate([camera.rays[window][seen] * z, z], axis=1)
        p_obj = (points - T[:3, 3]) @ T[:3, :3] - self.centre
        weight = np.exp(2 * np.sin(p_obj @ self._waves.T + self._phase))
        colors[seen] = weight @ self._palette / weight.sum(axis=1, keepdims=True)
        return colors


class _Models(Mapping[int, Any]):
    """{obj_id: Mesh}; the mesh of a signed distance function is made at first use."""

    def __init__(self, bodies: list[_Body]) -> None:
        self._shapes = {1 + i: body.shape for i, body in enumerate(bodies)}

    def __getitem__(self, obj_id: int) -> Any:
        shape = self._shapes[obj_id]
        if not hasattr(shape, "raycast"):
            shape = self._shapes[obj_id] = shape.to_mesh()
        return shape

    def __iter__(self) -> Iterator[int]:
        return iter(self._shapes)

    def __len__(self) -> int:
        return len(self._shapes)


class _Rendered:
    """Frames by number; nothing but the still background is kept."""

    def __init__(
        self,
        bodies: list[_Body],
        poses: Array,
        camera: Camera,
        noise: Noise | None,
        fraction: float,
        clutter: str | None,
        color: bool,
        seed: int,
        fps: float,
        threads: int,
    ) -> None:
        self._bodies, self._poses, self._camera, self._noise = bodies, poses, camera, noise
        self._fraction, self._color, self._seed, self._fps, self._threads = (
            fraction,
            color,
            seed,
            fps,
            threads,
        )
        middle = np.einsum("kij,kj->ki", poses[:, :, :3, :3].mean(1), np.stack([b.centre for b in bodies]))
        distance = float((middle + poses[:, :, :3, 3].mean(1))[:, 2].max())
        self._still = background(camera, clutter, distance, np.random.default_rng([seed, 3]))
        # As large as a hand, or larger where it has much to hide.
        size = max(0.12, 1.1 * bodies[0].diameter * fraction**0.5)
        self._hand = hand_mesh(size) if fraction > 0 else None

    def __len__(self) -> int:
        return self._poses.shape[1]

    def __getitem__(self, i: int) -> Frame:
        scene, _ = self._compose(i)
        rng = np.random.default_rng([self._seed, 1, i])
        depth = scene.depth if self._noise is None else self._noise(scene.depth, scene.cosine, rng)
        color = None
        if self._color:
            grain = COLOR_NOISE * rng.standard_normal(scene.color.shape, dtype=np.float32)
            color = np.clip(scene.color + grain + 0.5, 0, 255).astype(np.uint8)
        return Frame(depth, color, i / self._fps, index=i, check_units=False)

    def masks(self, i: int) -> dict[int, NDArray[np.bool_]]:
        return self._compose(i)[1]

    def _compose(self, i: int) -> tuple[Layer, dict[int, NDArray[np.bool_]]]:
        scene = self._still.copy()
        owner = np.full(self._camera.shape, -1, np.int16)
        for k, body in enumerate(self._bodies):
            layer = body.layer(self._camera, self._poses[k, i], self._color, self._threads)
            window, nearer = scene.put(layer)
            owner[window][nearer] = k
        if self._hand is not None:
            window, nearer = scene.put(self._hand_layer(i, owner == 0, scene.depth))
            owner[window][nearer] = -1
        return scene, {k: owner == k for k in range(len(self._bodies))}

    def _hand_layer(self, i: int, visible: NDArray[np.bool_], depth: NDArray[np.float32]) -> Layer:
        """A hand pushed in from the side until it hides the wanted fraction of what is visible."""
        assert self._hand is not None
        count = np.count_nonzero(visible)
        if not count:
            return Layer.empty(self._camera)
        v, u = np.nonzero(visible)
        thickness = 0.2 * float(np.ptp(self._hand.vertices[:, 0]))
        z = max(float(depth[visible].min()) - HAND_GAP_M - thickness, 0.15)
        K = self._camera
        side = float(np.random.default_rng([self._seed, 5]).uniform(0, 2 * np.pi)) + 0.5 * i / self._fps
        inward = np.array([np.cos(side), np.sin(side), 0.0])
        T = np.eye(4)
        # The fingers (-y of the hand) point inward, the palm looks at the object.
        T[:3, :3] = np.column_stack([np.cross(-inward, [0, 0, 1]), -inward, [0, 0, 1]])
        centre = z * np.array([(u.mean() - K.cx) / K.fx, (v.mean() - K.cy) / K.fy, 1.0])
        reach = 2.0 * self._bodies[0].diameter + 0.05
        low, high = -reach, reach  # how far the finger tips are past the middle of the object
        v0, u0 = v - v.min(), u - u.min()
        outline = self._camera.cropped(int(u.min()), int(v.min()), int(u0.max()) + 1, int(v0.max()) + 1)
        for _ in range(12):
            push = 0.5 * (low + high)
            T[:3, 3] = centre + push * inward
            hidden = np.count_nonzero(self._hand.raycast(outline, T)[0][v0, u0]) / count
            if abs(hidden - self._fraction) < 0.005:
                break
            if hidden < self._fraction:
                low = push
            else:
                high = push
        return mesh_layer(self._hand, self._camera, T, SKIN)


def _all_poses(trajectory: Any, n: int, bodies: list[_Body], seed: int) -> Array:
    """(M, n, 4, 4)."""
    count = len(bodies)
    own: list[Any]
    if isinstance(trajectory, np.ndarray) and trajectory.ndim == 4:
        if trajectory.shape[:2] != (n, count):
            raise ValueError(f"trajectory: expected shape ({n}, {count}, 4, 4), got {trajectory.shape}")
        own = list(np.moveaxis(trajectory, 1, 0))
    elif isinstance(trajectory, list) and (count > 1 or (len(trajectory) == 1 and callable(trajectory[0]))):
        if len(trajectory) != count:
            raise ValueError(f"trajectory: expected one for each of {count} objects, got {len(trajectory)}")
        own = trajectory
    else:
        own = [trajectory] * count
    poses = np.array(
        [
            poses_of(t, n, np.random.default_rng([seed, 2, k]), body.centre)
            for k, (t, body) in enumerate(zip(own, bodies, strict=True))
        ]
    )
    if count > 1 and own[0] is own[-1] and not isinstance(trajectory, np.ndarray):
        gap = 1.2 * max(b.diameter for b in bodies)
        poses[:, :, 0, 3] += gap * (np.arange(count) - 0.5 * (count - 1))[:, None]
    return poses


def _inside_bounds(sdf: Any) -> tuple[Array, Array]:
    """Box around the voxels inside the surface, object frame, m."""
    inside = np.argwhere(np.asarray(sdf.values) <= 0)[:, ::-1]
    if not len(inside):
        raise ValueError("shape_or_mesh: the signed distance function has no inside")
    origin = np.asarray(sdf.origin)
    return origin + sdf.voxel_size * inside.min(0), origin + sdf.voxel_size * inside.max(0)


def _fraction(occluder: Any) -> float:
    if occluder is None or occluder is False:
        return 0.0
    if occluder is True or occluder == "hand":
        return HAND_FRACTION
    if isinstance(occluder, str) or not 0 <= float(occluder) <= 0.8:
        raise ValueError(f'occluder: expected None, True, "hand" or a fraction of 0 to 0.8, got {occluder!r}')
    return float(occluder)


def _kind(clutter: str | bool | None) -> str | None:
    if isinstance(clutter, bool):
        return "objects" if clutter else None
    return clutter
