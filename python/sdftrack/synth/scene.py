# SPDX-License-Identifier: MIT
"""Frames rendered on access: objects on trajectories, surroundings, occluders, and sensor noise."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.files import write_whole
from sdftrack._internal.validation import shown
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.synth.bodies import Body, Models, Occluder, Stage
from sdftrack.synth.noise import Noise, noise_of
from sdftrack.synth.occluders import occluder_of
from sdftrack.synth.surroundings import Layer, Table, Tabletop, background
from sdftrack.synth.trajectories import poses_of

Array = NDArray[np.float64]
MAX_FRAMES = 1_000_000  # nine hours; their poses are made at once
DEFAULT_CAMERA = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)


def sequence(
    shape_or_mesh: Any,
    n: int,
    trajectory: Any = None,
    noise: Any = None,
    occluder: Any = None,
    seed: int = 0,
    *,
    camera: Camera | RGBDCamera | None = None,
    clutter: str | bool | Table | None = None,
    color: bool = True,
    fps: float = 30.0,
    threads: int = 0,
    cache: str | os.PathLike[str] | None = None,
) -> Sequence:
    """Create a synthetic sequence with exact ground truth, rendered on access.

    The same arguments give the same images, bit by bit, in any order of access.

    Parameters
    ----------
    shape_or_mesh : SDF, Mesh, path of a mesh in metres, or a list of these
        Meshes are rendered by exact ray casting. One object given twice is one model with two instances.
    n : int
        Frames.
    trajectory : "random" (default), "orbit", "static", "sweep", a function, or (n, 4, 4) poses T_cam_obj
        `random_walk(step_m=, step_rad=)`, `orbit(...)`, `static(...)`, `sweep(...)` and `leave_and_return(...)`
        make functions;
        (n, M, 4, 4) or a list gives each of M objects its own. By default, several objects stay side by side.
    noise : None, sigma in metres, "kinect", "stereo", `Gaussian(...)`, `Kinect(...)`, `Stereo(...)`, or a function
    occluder : None, True or "hand" (0.3), the fraction (0..0.8) of the first object that a hand hides, or
        `Hand(share)`, an open hand in front of it; "grip" or `Grip(share, color=...)`, fingers wrapped around it, in
        contact; `Cover(first, frames)`, a board that hides all of it for some frames; an object with `ready`
        as these have it (see `sdftrack.synth.bodies.Occluder`)
    seed : int
        Seed of everything random: path, noise, clutter, colours.
    camera : Camera, optional
        Default: 640 x 480 with 525 px.
    clutter : None, "wall", "table" (and wall), "objects" (table, and ten things behind) or True for these, or
        "touching": a table under the first object, and boxes and cans on it that touch the object; they move with it;
        or a `Table` at a place of its own, and a wall
    color : bool
        Render colour images: the mesh's own colours, or a random solid texture from `seed`.
    fps : float
        Frames per second of the timestamps.
    threads : int
        0: all cores.
    cache : folder, optional
        Cache of noise-free images, reused by later runs with the same scene.

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
    if isinstance(n, (bool, str)) or not 1 <= n <= MAX_FRAMES or int(n) != n:
        raise ValueError(f"n: expected a number of frames from 1 to {MAX_FRAMES}, got {shown(n)}")
    if not fps > 0:
        raise ValueError(f"fps: expected frames per second above 0, got {fps}")
    given = list(shape_or_mesh) if isinstance(shape_or_mesh, list) else [shape_or_mesh]
    if not given:
        raise ValueError("shape_or_mesh: expected at least one shape, got an empty list")
    loaded: dict[int, Any] = {}
    bodies = [loaded.setdefault(id(s), Body(s, k, seed)) for k, s in enumerate(given)]
    eye = DEFAULT_CAMERA if camera is None else depth_camera(camera)
    poses = _all_poses(trajectory, int(n), bodies, seed)
    kind = ("objects" if clutter else None) if isinstance(clutter, bool) else clutter
    world = World(bodies, poses, eye, occluder_of(occluder), kind, color, seed, float(fps))
    frames = Rendered(world, noise_of(noise), threads, None if cache is None else Path(cache))
    distinct = list(dict.fromkeys(bodies))
    return Sequence(
        frames, RGBDCamera(eye), {i: {k: poses[k, i] for k in range(len(bodies))} for i in range(int(n))},
        Models(distinct), objects=[1 + distinct.index(b) for b in bodies], masks=frames.masks, layout="memory",
        name="synthetic",
    )  # fmt: skip


def _all_poses(trajectory: Any, n: int, bodies: list[Body], seed: int) -> Array:
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


# -- The frames of a synthetic sequence by number, composed when they are asked for


COLOR_NOISE = 2.0  # of 255, as a quiet camera has
RECIPE = 1  # of the pictures: another number makes the cached ones of an earlier recipe unused


@dataclass(frozen=True)
class World:
    """All that a noise-free picture depends on. `poses`: (M, n, 4, 4) T_cam_obj."""

    bodies: list[Body]
    poses: Array
    camera: Camera
    occluder: Occluder | None
    clutter: str | Table | None
    color: bool
    seed: int
    fps: float

    def key(self) -> str:
        """A name for these pictures."""
        digest = hashlib.sha256()
        for body in self.bodies:
            shape = body.shape
            parts = (
                (shape.vertices, shape.faces, shape.colors)
                if hasattr(shape, "raycast")
                else (shape.values, np.asarray(shape.origin), np.float64(shape.voxel_size))
            )
            for part in parts:
                digest.update(b"none" if part is None else np.ascontiguousarray(part).tobytes())
        camera = self.camera
        digest.update(np.ascontiguousarray(self.poses).tobytes() + camera.K.tobytes())
        rest = (camera.width, camera.height, camera.distortion, self.occluder, self.clutter, self.color)
        digest.update(repr((RECIPE, rest, self.seed, self.fps)).encode())
        return digest.hexdigest()[:16]


class Rendered:
    """Frames by number; nothing but the still background is kept in memory."""

    def __init__(self, world: World, noise: Noise | None, threads: int, cache: Path | None) -> None:
        self._world, self._noise, self._threads = world, noise, threads
        poses, bodies = world.poses, world.bodies
        middle = np.einsum("kij,kj->ki", poses[:, :, :3, :3].mean(1), np.stack([b.centre for b in bodies]))
        distance = float((middle + poses[:, :, :3, 3].mean(1))[:, 2].max())
        rng = np.random.default_rng([world.seed, 3])
        touching = world.clutter == "touching"
        # The wall stands where the path cannot reach; the table that touches hides most of it.
        self._still = background(world.camera, "wall" if touching else world.clutter, distance, rng)
        self._table = Tabletop(bodies[0], poses[0], rng) if touching else None
        stage = Stage(bodies[0], poses[0], world.camera, world.seed, world.fps)
        self._occlude = None if world.occluder is None else world.occluder.ready(stage)
        self._cache = None if cache is None else Path(cache) / f"scene_{world.key()}"

    def __len__(self) -> int:
        return self._world.poses.shape[1]

    def __getitem__(self, i: int) -> Frame:
        scene, _ = self._composed(i)
        rng = np.random.default_rng([self._world.seed, 1, i])
        depth = scene.depth if self._noise is None else self._noise(scene.depth, scene.cosine, rng)
        color = None
        if self._world.color:
            grain = COLOR_NOISE * rng.standard_normal(scene.color.shape, dtype=np.float32)
            color = np.clip(scene.color + grain + 0.5, 0, 255).astype(np.uint8)
        return Frame(depth, color, i / self._world.fps, index=i, check_units=False)

    def masks(self, i: int) -> dict[int, NDArray[np.bool_]]:
        """Visible pixels of each object in frame i."""
        owner = self._composed(i)[1]
        return {k: owner == k for k in range(len(self._world.bodies))}

    def _composed(self, i: int) -> tuple[Layer, NDArray[np.int8]]:
        """The noise-free picture and whose each pixel is (-1: no object's)."""
        if self._cache is None:
            return self._compose(i)
        kept = self._cache / f"{i:06d}.npz"
        if kept.is_file():
            return self._read(kept)
        scene, owner = self._compose(i)
        self._keep(kept, scene, owner)
        return scene, owner

    def _compose(self, i: int) -> tuple[Layer, NDArray[np.int8]]:
        world = self._world
        scene = self._still.copy()
        owner = np.full(world.camera.shape, -1, np.int8)
        for k, body in enumerate(world.bodies):
            layer = body.layer(world.camera, world.poses[k, i], world.color, self._threads)
            window, nearer = scene.put(layer)
            owner[window][nearer] = k
        if self._table is not None:
            for layer in self._table.layers(world.camera, world.poses[0, i]):
                window, nearer = scene.put(layer)
                owner[window][nearer] = -1
        if self._occlude is not None:
            window, nearer = scene.put(self._occlude(i, owner == 0, scene.depth))
            owner[window][nearer] = -1
        return scene, owner

    def _keep(self, path: Path, scene: Layer, owner: NDArray[np.int8]) -> None:
        """Write the box in which the picture differs from the still background."""
        other = (scene.depth != self._still.depth) | (owner >= 0)
        rows, columns = np.flatnonzero(other.any(axis=1)), np.flatnonzero(other.any(axis=0))
        top, bottom = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 0)
        left, right = (int(columns[0]), int(columns[-1]) + 1) if len(columns) else (0, 0)
        box = np.s_[top:bottom, left:right]
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(
            path,
            lambda file: np.savez_compressed(
                file, depth=scene.depth[box], cosine=scene.cosine[box], color=scene.color[box],
                owner=owner[box], at=np.array([top, left]),
            ),
        )  # fmt: skip

    def _read(self, path: Path) -> tuple[Layer, NDArray[np.int8]]:
        scene = self._still.copy()
        owner = np.full(self._world.camera.shape, -1, np.int8)
        with np.load(path) as kept:
            top, left = kept["at"]
            h, w = kept["depth"].shape
            box = np.s_[top : top + h, left : left + w]
            scene.depth[box], scene.cosine[box] = kept["depth"], kept["cosine"]
            scene.color[box], owner[box] = kept["color"], kept["owner"]
        return scene, owner
