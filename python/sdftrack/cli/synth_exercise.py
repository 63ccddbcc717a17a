# SPDX-License-Identifier: MIT
"""``sdftrack synth exercise``: what its options make."""

from __future__ import annotations

from enum import Enum
from typing import Any

from sdftrack.cli.common import Usage

__all__ = ["TRUTH", "ExerciseKind", "ExerciseObject", "exercise_scene", "refuse_given"]

TRUTH = "exercise.json"
TOUCHING_M = 0.0005  # between objects that touch: none enters the other


class ExerciseKind(str, Enum):
    reach = "reach"
    pouring = "pouring"
    circle = "circle"
    tremor = "tremor"
    two_handed = "two-handed"


class ExerciseObject(str, Enum):
    cup = "cup"
    ball = "ball"
    box = "box"
    stick = "stick"
    duck = "duck"
    can = "can"


def refuse_given(scene: str, options: dict[str, Any]) -> None:
    """Usage error for options that a scene would ignore."""
    for name, value in options.items():
        if value is not None:
            raise Usage(f"the scene {scene!r} does not use this option; leave it out", name)


def exercise_scene(
    kind: ExerciseKind | None,
    name: ExerciseObject | None,
    models: list[Any],
    repetitions: int | None,
    fps: float,
    seed: int,
    **more: Any,
) -> tuple[Any, Any]:
    """The exercise and its sequence."""
    from sdftrack import synth

    if models and name is not None:
        raise Usage("expected one of --object and --model, got both", "--object")
    meshes = models or [synth.exercise_object((name or ExerciseObject.cup).value)]
    low = {round(float(mesh.bounds[0][2]), 3) for mesh in meshes}
    if len(low) > 1:
        raise Usage("expected models whose lowest points have the same z, which is their height", "--model")
    across = float(meshes[0].bounds[1][0] - meshes[-1].bounds[0][0]) + TOUCHING_M
    chosen = (kind or ExerciseKind.reach).value.replace("-", "_")
    own: dict[str, Any] = {"meeting_m": across} if chosen == "two_handed" else {}
    made = synth.exercise(
        chosen,
        seed=seed,
        repetitions=5 if repetitions is None else repetitions,
        fps=fps,
        origin_m=-float(meshes[0].bounds[0][2]),
        **own,
    )
    return made, synth.exercise_sequence(made, meshes, seed=seed, **more)
