# SPDX-License-Identifier: MIT
"""Rendered exercises, and their objects: printed all over, feet on z = 0, z up, 5-15 cm, metres."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence as Several
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import of_kind, whole
from sdftrack.camera import Camera
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.mesh import Mesh
from sdftrack.sdf import SDF
from sdftrack.synth.duck import duck_mesh
from sdftrack.synth.exercise import Exercise
from sdftrack.synth.printed_can import CAN_HEIGHT_M, can_mesh
from sdftrack.synth.scene import sequence
from sdftrack.synth.surroundings import Table

Array = NDArray[np.float64]
GRID_M = 0.0015
DUCK_SCALE = 0.6
WAVES, WAVE_PER_M = 12, 150.0  # of the print: about 4 cm long


def exercise_object(name: str) -> Mesh:
    """A closed, coloured mesh that stands on the plane z = 0 with its origin in the middle of its foot.

    Parameters
    ----------
    name : "cup" (with a handle), "ball", "box", "stick" (with a knob at one end, lying), "duck" or "can"
        Ball and can are symmetric: only their print shows how they are rotated.

    Examples
    --------
    >>> low, high = exercise_object("box").bounds
    >>> (high - low).round(2).tolist(), float(low[2].round(3))
    ([0.07, 0.05, 0.11], 0.0)
    """
    if name not in OBJECTS:
        raise ValueError(f"name: expected one of {', '.join(OBJECTS)}, got {name!r}")
    return OBJECTS[name]()


def _cup() -> Mesh:
    def distance(p: Array) -> Array:
        x, y, z = p
        r = np.hypot(x, y)
        outer, inner = _slab(r - 0.038, z, 0.0, 0.095), _slab(r - 0.032, z, 0.007, 0.2)
        # An ellipse of a round bar, whose ends are inside the wall.
        around = np.hypot((x - 0.036) / 0.8, z - 0.048) - 0.028
        handle = np.where(x > 0.033, np.hypot(around, y) - 0.006, 1.0)
        return np.maximum(np.minimum(outer, handle), -inner)

    return _meshed(distance, (-0.04, -0.04, 0.0), (0.068, 0.04, 0.097), (170, 175, 190), 1)


def _ball() -> Mesh:
    return _meshed(
        lambda p: np.sqrt(p[0] ** 2 + p[1] ** 2 + (p[2] - 0.035) ** 2) - 0.035,
        (-0.036, -0.036, 0.0), (0.036, 0.036, 0.071), (200, 70, 60), 2,
    )  # fmt: skip


def _box() -> Mesh:
    half, edge_m = np.array([0.035, 0.025, 0.055]), 0.003

    def distance(p: Array) -> Array:
        q = np.abs(p - np.array([0, 0, 0.055])[:, None, None, None]) - (half - edge_m)[:, None, None, None]
        outside = np.sqrt((np.maximum(q, 0) ** 2).sum(axis=0))
        return outside + np.minimum(q.max(axis=0), 0) - edge_m

    return _meshed(distance, (-0.036, -0.026, 0.0), (0.036, 0.026, 0.111), (90, 150, 90), 3)


def _stick() -> Mesh:
    def distance(p: Array) -> Array:
        x, y, z = p
        bar = np.sqrt(np.maximum(np.abs(x) - 0.06, 0) ** 2 + y**2 + (z - 0.018) ** 2) - 0.012
        knob = np.sqrt((x - 0.054) ** 2 + y**2 + (z - 0.018) ** 2) - 0.018
        return np.minimum(bar, knob)

    return _meshed(distance, (-0.074, -0.02, 0.0), (0.074, 0.02, 0.037), (200, 160, 70), 4)


def _duck() -> Mesh:
    mesh = duck_mesh()
    low, high = DUCK_SCALE * np.asarray(mesh.bounds)
    foot = np.array([*(0.5 * (low + high))[:2], low[2]])
    return Mesh(DUCK_SCALE * mesh.vertices - foot, mesh.faces, mesh.colors)


def _can() -> Mesh:
    mesh = can_mesh()
    return Mesh(mesh.vertices + np.array([0, 0, CAN_HEIGHT_M / 2]), mesh.faces, mesh.colors)


def _slab(radial: Array, z: Array, low: float, high: float) -> Array:
    return np.maximum(radial, np.maximum(low - z, z - high))


def _meshed(
    distance: Callable[[Array], Array],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    color: tuple[int, int, int],
    seed: int,
) -> Mesh:
    """The zero set of a field, which is negative inside, by marching cubes."""
    axes = [np.arange(a - 3 * GRID_M, b + 3 * GRID_M, GRID_M) for a, b in zip(low, high, strict=True)]
    values = distance(np.stack(np.meshgrid(*axes, indexing="ij")))
    solid = SDF(np.ascontiguousarray(values.T, np.float32), GRID_M, [axis[0] for axis in axes]).to_mesh()
    vertices = solid.vertices - [0.0, 0.0, solid.vertices[:, 2].min()]
    return Mesh(vertices, solid.faces, _print(vertices, color, seed))


def _print(points: Array, color: tuple[int, int, int], seed: int) -> NDArray[np.uint8]:
    """Waves of colour through space."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(WAVES, 3))
    directions *= WAVE_PER_M * rng.uniform(0.5, 1.5, (WAVES, 1)) / np.linalg.norm(directions, axis=1)[:, None]
    waves = np.sin(points @ directions.T + rng.uniform(0, 2 * np.pi, WAVES))
    shown = waves @ rng.normal(size=(WAVES, 3))
    return np.clip(np.array(color) + 40 * shown / shown.std(), 0, 255).astype(np.uint8)


OBJECTS: dict[str, Callable[[], Mesh]] = {
    "cup": _cup,
    "ball": _ball,
    "box": _box,
    "stick": _stick,
    "duck": _duck,
    "can": _can,
}


# -- Rendered sequences of exercises


STANDS_M = 0.002  # how far the foot of an object may be from the table


def exercise_sequence(
    exercise: Exercise,
    meshes: Any,
    *,
    noise: Any = "kinect",
    camera: Camera | None = None,
    around: str | None = "table",
    occluder: Any = None,
    frames: int | None = None,
    seed: int = 0,
    color: bool = True,
    threads: int = 0,
) -> Sequence:
    """Render an exercise at the times i / fps, with exact poses and masks.

    Parameters
    ----------
    exercise : Exercise
    meshes : Mesh, SDF, path, or a list of them, one for each object
        With z up and the lowest point `origin_m` below the origin, as `exercise_object` has it (0). One shape for two
        objects is one model with two instances.
    noise, occluder, camera, color, threads
        As in :func:`sequence`. The view is that of a camera of 640 x 480 with 525 px; another one sees as much only
        if its field of view is as wide.
    around : "table", "wall" or None
        The table of the exercise and a wall, a wall, or nothing.
    frames : int, optional
        The first ones alone.
    seed : int
        Of noise, colours and surroundings.

    Returns
    -------
    Sequence

    Examples
    --------
    >>> from sdftrack.synth import exercise as make, exercise_object
    >>> seq = exercise_sequence(make("reach", repetitions=1), exercise_object("box"), frames=2)
    >>> seq[1].depth.shape, round(seq[1].timestamp, 4)
    ((480, 640), 0.0333)
    """
    of_kind(exercise, Exercise, "exercise", "create it with st.synth.exercise")
    if around not in ("table", "wall", None):
        raise ValueError(f'around: expected "table", "wall" or None, got {around!r}')
    given = list(meshes) if isinstance(meshes, Several) and not isinstance(meshes, str) else [meshes]
    if len(given) == 1:
        given *= exercise.objects
    if len(given) != exercise.objects:
        raise ValueError(f"meshes: expected 1 or {exercise.objects} for {exercise.kind!r}, got {len(given)}")
    for mesh in given:
        _check_stands(mesh, exercise.arguments["origin_m"])
    times = exercise.times_s if frames is None else exercise.times_s[: whole(frames, "frames", 1)]
    poses = np.stack([exercise.poses(times, k) for k in range(exercise.objects)], axis=1)
    n, d = exercise.table
    table = Table((float(n[0]), float(n[1]), float(n[2])), d)
    return sequence(
        given, len(times), poses, noise, occluder, seed, camera=camera,
        clutter=table if around == "table" else around, color=color, fps=exercise.fps, threads=threads,
    )  # fmt: skip


def _check_stands(mesh: Any, origin_m: float) -> None:
    if not hasattr(mesh, "raycast"):  # a volume's box is larger than what it holds
        return
    low = float(mesh.bounds[0][2])
    if abs(low + origin_m) > STANDS_M:
        raise ValueError(
            f"meshes: expected the lowest point at z = {-origin_m:g} m, as the exercise's origin_m says, "
            f"got {low:.4f}; create it with exercise(..., origin_m={-low:.4f})"
        )
