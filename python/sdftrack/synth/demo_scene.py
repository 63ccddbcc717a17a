# SPDX-License-Identifier: MIT
"""The demo's world: a duck carried by a hand over a cluttered table, seen by a Kinect-like camera.

World frame: z up, the table at z = 0, metres. Everything is made here from a seed; no file is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.geometry import look_at, pose
from sdftrack.mesh import Mesh
from sdftrack.sdf import SDF
from sdftrack.synth.objects import duck_mesh

Array = NDArray[np.float64]
EYE, TARGET = (0.02, -0.69, 0.54), (0.0, 0.0, 0.12)
LIGHT = np.array([-0.45, -0.6, 0.75]) / np.linalg.norm([-0.45, -0.6, 0.75])  # towards the lamp, world
SKIN, SLEEVE = (222, 170, 138), (70, 92, 140)
NOISE_M, NOISE_PER_M = 0.0010, 0.0016  # sd of depth: NOISE_M + NOISE_PER_M Z^2
SWEEP = (0.52, 0.70)  # part of the time in which a second hand passes in front


@dataclass(frozen=True)
class DemoScene:
    """Frames on demand, with the duck's true poses T_cam_obj (N, 4, 4)."""

    camera: Any
    duck: Any
    poses: Array
    seed: int
    _hand: Any  # None: nobody is there
    _T_cam_world: Array
    _backdrop: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8]]
    threads: int = 0

    def __len__(self) -> int:
        return len(self.poses)

    def frames(self) -> Iterator[Any]:
        """Every frame in turn, rendered and made noisy when it is asked for."""
        return (self.frame(i) for i in range(len(self)))

    def frame(self, i: int) -> Any:
        """Frame i; the same bits whenever it is asked for."""
        depth, normals, colors = self._backdrop
        depth, normals, colors = depth.copy(), normals.copy(), colors.copy()
        t = i / max(1, len(self) - 1)
        bodies = [(self.duck, self.poses[i])]
        if self._hand is not None:
            bodies.append((self._hand, self.poses[i] @ _grip(t)))
        passing = _passing_hand(t) if self._hand is not None else None
        if passing is not None:
            bodies.append((self._hand, self._T_cam_world @ passing))
        for mesh, T in bodies:
            d, n, c = mesh.raycast(self.camera, np.ascontiguousarray(T), threads=self.threads)
            nearer = (d > 0) & ((depth <= 0) | (d < depth))
            depth[nearer], normals[nearer], colors[nearer] = d[nearer], n[nearer], c[nearer]
        rng = np.random.default_rng([self.seed, i])
        lamp = (self._T_cam_world[:3, :3] @ LIGHT).astype(np.float32)
        measured = _sensor_depth(depth, rng)
        shade = 0.45 + 0.62 * np.clip(normals @ lamp, 0, 1)
        grain = 3.0 * rng.standard_normal(shade.shape, dtype=np.float32)
        lit = np.clip(colors * shade[..., None] + grain[..., None], 0, 255).astype(np.uint8)
        return Frame(measured, lit, timestamp=i / 30.0, index=i)


def make_scene(frames: int, seed: int = 0, threads: int = 0) -> DemoScene:
    """Build meshes, motion and the still background."""
    camera = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
    T_cam_world = look_at(EYE, TARGET)
    depth, normals, colors = _clutter(seed).raycast(camera, T_cam_world, threads=threads)
    return DemoScene(
        camera,
        duck_mesh(seed),
        np.array([T_cam_world @ _carried_at(t) for t in np.linspace(0.0, 1.0, frames)]),
        seed,
        _hand_mesh(),
        T_cam_world,
        (depth, normals, colors),
        threads,
    )


def alone(scene: DemoScene, place_m: Sequence[float], turns_rad: ArrayLike) -> DemoScene:
    """The same scene without any hand: the duck floats at a place over the table (world)."""
    # There is a frame for each of (N, 3) turns, about the duck's own z, then about the world's y and x.
    T_cam = scene._T_cam_world @ _shift(*place_m)
    poses = np.array([T_cam @ _turn(x) @ _turn(y=y) @ _turn(z=z) for x, y, z in np.asarray(turns_rad)])
    return replace(scene, poses=poses, _hand=None)


def _turn(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    return pose([0.0, 0.0, z]) @ pose([0.0, y, 0.0]) @ pose([x, 0.0, 0.0])


def _shift(x: float, y: float, z: float) -> Array:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def _carried_at(t: float) -> Array:
    """T_world_duck: a figure of eight over the table with wide turns and some tilt, as a hand would do."""
    a = 2 * np.pi * t
    place = _shift(0.17 * np.sin(a), 0.07 * np.sin(2 * a), 0.17 + 0.05 * np.sin(1.5 * a))
    return place @ _turn(0.35 * np.sin(2 * a), 0.45 * np.sin(1.3 * a), 0.3 + 1.4 * np.sin(a))


def _grip(t: float) -> Array:
    """T_duck_hand: the palm under the belly, fingers up the side, never quite still."""
    wobble = 0.06 * np.sin(9.0 * t)
    return _shift(-0.012, 0.010, -0.058) @ _turn(-0.12 + wobble, 0.1, 0.95) @ _shift(0.0, -0.035, 0.0)


def _passing_hand(t: float) -> Array | None:
    """T_world_hand of the second hand while it passes between camera and duck."""
    begin, end = SWEEP
    if not begin < t < end:
        return None
    s = (t - begin) / (end - begin)
    eye, duck = np.array(EYE), _carried_at(t)[:3, 3]
    between = eye + 0.68 * (duck - eye)
    return _shift(between[0] + 0.34 * (1 - 2 * s), between[1], between[2] - 0.03) @ _turn(1.2, 0.25, 0.35)


def _capsule(p: Array, a: Any, b: Any, radius: float) -> Array:
    a, b = np.asarray(a, float), np.asarray(b, float)
    along = b - a
    h = np.clip((p - a) @ along / (along @ along), 0, 1)
    return np.linalg.norm(p - a - h[..., None] * along, axis=-1) - radius


def _hand_mesh() -> Any:
    """An open right hand with a forearm: palm in the xy plane, fingers along +y, bent towards +z."""
    grid = 0.004
    low, high = np.array([-0.09, -0.60, -0.06]), np.array([0.10, 0.16, 0.09])
    axes = [np.arange(a, b, grid) for a, b in zip(low, high, strict=True)]
    p = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    palm = p / np.array([0.043, 0.048, 0.017])
    parts = [(np.linalg.norm(palm, axis=-1) - 1) * 0.017]
    for x, length in ((-0.032, 0.055), (-0.011, 0.066), (0.010, 0.062), (0.030, 0.046)):
        knuckle, joint = (x, 0.036, 0.002), (1.15 * x, 0.036 + 0.6 * length, 0.016)
        tip = (1.2 * x, 0.036 + 0.85 * length, 0.016 + 0.45 * length)
        parts += [_capsule(p, knuckle, joint, 0.0095), _capsule(p, joint, tip, 0.0085)]
    parts += [_capsule(p, (-0.030, -0.015, 0.0), (-0.062, 0.018, 0.022), 0.011)]
    parts += [_capsule(p, (-0.062, 0.018, 0.022), (-0.060, 0.040, 0.042), 0.0095)]
    parts += [_capsule(p, (0.0, -0.03, 0.0), (0.0, -0.56, -0.02), 0.027)]
    blend = 0.006
    field = -blend * np.log(np.sum([np.exp(-d / blend) for d in parts], axis=0))
    hand = SDF(np.ascontiguousarray(field.T, np.float32), grid, low).to_mesh()
    rgb = np.where(hand.vertices[:, 1:2] < -0.12, SLEEVE, SKIN).astype(np.uint8)
    return Mesh(hand.vertices, hand.faces, rgb)


def _clutter(seed: int) -> Any:
    """A table of planks, a wall, and things that stand about."""
    import trimesh

    rng = np.random.default_rng(seed)
    pieces: list[tuple[Any, Any]] = []

    def put(body: Any, at: Any, rgb: Any, turn: float = 0.0) -> None:
        body.apply_transform(_shift(*at) @ _turn(z=turn))
        pieces.append((body, rgb))

    def box(size: Any, *place: Any) -> None:
        put(trimesh.creation.box(size), *place)

    for j, y in enumerate(np.arange(-0.50, 0.46, 0.12)):
        tone = rng.uniform(0.80, 1.15)
        box((1.9, 0.116, 0.03), (0, y, -0.015 - 0.0008 * (j % 2)), tone * np.array([176, 134, 96]))
    box((3.4, 0.02, 2.2), (0, 0.72, 0.5), (214, 212, 200))
    box((0.13, 0.08, 0.19), (-0.36, 0.22, 0.095), (164, 62, 58), 0.5)
    box((0.22, 0.15, 0.05), (0.36, 0.26, 0.025), (66, 110, 96), -0.3)
    box((0.18, 0.12, 0.04), (0.37, 0.27, 0.07), (206, 190, 150), 0.15)
    box((0.09, 0.09, 0.09), (0.10, 0.34, 0.045), (88, 96, 150), 0.8)
    put(trimesh.creation.cylinder(0.042, 0.13, sections=48), (-0.17, 0.30, 0.065), (196, 198, 204))
    put(trimesh.creation.icosphere(4, 0.06), (-0.42, -0.04, 0.06), (214, 120, 66))
    put(trimesh.creation.cone(0.05, 0.15, sections=48), (0.44, 0.02, 0.0), (120, 150, 70))
    corners = [
        np.asarray(body.triangles).reshape(-1, 3) for body, _ in pieces
    ]  # unshared: colours stay crisp
    colours = [
        np.tile(np.clip(rgb, 0, 255), (len(c), 1)) for c, (_, rgb) in zip(corners, pieces, strict=True)
    ]
    vertices = np.vstack(corners)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return Mesh(vertices, faces, np.vstack(colours).astype(np.uint8))


def _sensor_depth(depth: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """Ragged edges, noise that grows with Z^2, and missing measurements at depth edges and at random."""
    h, w = depth.shape
    v, u = np.mgrid[0:h, 0:w]
    jitter = np.rint(0.45 * rng.standard_normal((2, h, w), dtype=np.float32)).astype(np.int32)
    out = depth[np.clip(v + jitter[0], 0, h - 1), np.clip(u + jitter[1], 0, w - 1)]
    noise = rng.standard_normal((h, w), dtype=np.float32)
    step = np.zeros((h, w), bool)
    step[:, 1:] |= np.abs(np.diff(depth, axis=1)) > 0.03
    step[1:] |= np.abs(np.diff(depth, axis=0)) > 0.03
    missing = (step & (noise > -0.3)) | (rng.random((h, w), dtype=np.float32) < 0.002)
    out = out + (NOISE_M + NOISE_PER_M * out * out) * noise
    out[(depth <= 0) | missing] = 0
    return np.ascontiguousarray(out, np.float32)
