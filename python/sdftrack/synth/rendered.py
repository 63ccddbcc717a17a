# SPDX-License-Identifier: MIT
"""The frames of a synthetic sequence by number, composed when they are asked for."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.files import write_whole
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.synth.bodies import Body
from sdftrack.synth.noise import Noise
from sdftrack.synth.stage import Occluder, Stage
from sdftrack.synth.surroundings import Layer, Table, background
from sdftrack.synth.tabletop import Tabletop

__all__ = ["Rendered", "World"]

Array = NDArray[np.float64]
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
