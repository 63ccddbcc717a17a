# SPDX-License-Identifier: MIT
"""Rendered sequences of exercises."""

from __future__ import annotations

from collections.abc import Sequence as Several
from typing import Any

import numpy as np

from sdftrack._internal.validation import of_kind, whole
from sdftrack.camera import Camera
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.synth.exercise import Exercise
from sdftrack.synth.scene import sequence
from sdftrack.synth.surroundings import Table

__all__ = ["exercise_sequence"]

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
