# SPDX-License-Identifier: MIT
"""``sdftrack synth``: rendered sequences and exercises with exact poses, to try everything with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import sdftrack as st
from sdftrack.cli.common import Unit, floats
from sdftrack.cli.options import Usage, argument, option
from sdftrack.cli.record import Recording, items_of, write_all

TRUTH = "exercise.json"
TOUCHING_M = 0.0005  # between objects that touch: none enters the other


def _noise(text: str) -> str | float | None:
    if text in ("kinect", "stereo"):
        return text
    if text == "none":
        return None
    (sigma,) = floats(text, 1) or (-1.0,)
    if not 0 <= sigma < 1:
        raise Usage(f"expected none, kinect, stereo or a standard deviation in metres, got {text!r}")
    return sigma


@dataclass(frozen=True, kw_only=True)
class Synth(Recording):
    """Render a sequence with exact poses, masks and models, to try the other commands with."""

    scene: Literal["sequence", "exercise"] = argument(
        "sequence: objects on a path; exercise: of rehabilitation, with an object on a table, and its truth in "
        "exercise.json.",
        "sequence|exercise",
        default="sequence",
    )
    model: tuple[Path, ...] = option(
        (), "Mesh; repeat for several objects.", metavar="M.ply", show_default="a duck; an exercise: a cup"
    )
    unit: Unit | None = option(None, "Unit of the meshes.")
    frames: int | None = option(None, "Number of frames.", min=1, show_default="120; an exercise: all")
    motion: Literal["random", "orbit", "sweep", "static"] | None = option(
        None, "Path of the objects in a sequence.", show_default="random"
    )
    kind: Literal["reach", "pouring", "circle", "tremor", "two-handed"] | None = option(
        None, "Kind of exercise.", show_default="reach"
    )
    object_: Literal["cup", "ball", "box", "stick", "duck", "can"] | None = option(
        None, "Object of an exercise.", show_default="cup"
    )
    repetitions: int | None = option(None, "Repetitions of an exercise.", min=1, show_default="5")
    noise: str = option("kinect", "Depth noise; SIGMA in metres.", metavar="none|kinect|stereo|SIGMA")
    hidden: float = option(0.0, "Part of the first object that a hand hides.", min=0, max=0.8)
    around: Literal["none", "wall", "table", "objects", "touching"] | None = option(
        None, "Surroundings; of an exercise: none, wall or table.", show_default="objects; an exercise: table"
    )
    fps: float = option(30.0, "Frames per second.", min=1, max=1000)
    seed: int = option(0, "Random seed of path, noise, surroundings and colours.", min=0)


def synth(job: Synth) -> None:
    from sdftrack.io.writers import Contents

    out = job.folder
    noise = _noise(job.noise)
    job.on_cpu()
    loaded = {path: st.Mesh.load(path, unit=job.unit) for path in job.model}
    meshes = [loaded[path] for path in job.model]
    common = {"seed": job.seed, "threads": job.threads, "noise": noise, "occluder": job.hidden or None}
    truth = None
    if job.scene == "exercise":
        truth, seq = _exercise(job, meshes, common)
    else:
        seq = _sequence(job, meshes, common)
    with job.writer(Contents(seq.camera, seq.objects, seq.models)) as writer:
        write_all(
            writer, items_of(seq, writer.count, "rendering", job.quiet), "synthetic", "synth", job.quiet
        )
    if truth is not None:
        truth.save(out / TRUTH)
    if not job.quiet and writer.name == "bop" and len(seq.objects) == 1:
        print(f"try it: sdftrack track {out} --model {out / 'models/obj_000001.ply'} --out tracked")


def _sequence(job: Synth, meshes: list[Any], common: dict[str, Any]) -> Any:
    from sdftrack.synth.objects import duck_mesh

    _refuse(job, {"--kind": job.kind, "--object": job.object_, "--repetitions": job.repetitions})
    around = job.around or "objects"
    about = {"clutter": None if around == "none" else around, "fps": job.fps, **common}
    shapes, trajectory = meshes or [duck_mesh()], job.motion or "random"
    return st.synth.sequence(shapes, job.frames or 120, trajectory=trajectory, **about)


def _exercise(job: Synth, models: list[Any], common: dict[str, Any]) -> tuple[Any, Any]:
    _refuse(job, {"--motion": job.motion})
    if job.around in ("objects", "touching"):
        raise Usage("expected none, wall or table for an exercise", "--around")
    if models and job.object_ is not None:
        raise Usage("expected one of --object and --model, got both", "--object")
    meshes = models or [st.synth.exercise_object(job.object_ or "cup")]
    if len({round(float(mesh.bounds[0][2]), 3) for mesh in meshes}) > 1:
        raise Usage("expected models whose lowest points have the same z, which is their height", "--model")
    kind = (job.kind or "reach").replace("-", "_")
    own: dict[str, Any] = {"origin_m": -float(meshes[0].bounds[0][2]), "repetitions": job.repetitions or 5}
    if kind == "two_handed":
        own["meeting_m"] = float(meshes[0].bounds[1][0] - meshes[-1].bounds[0][0]) + TOUCHING_M
    made = st.synth.exercise(kind, seed=job.seed, fps=job.fps, **own)
    around = None if job.around == "none" else job.around or "table"
    return made, st.synth.exercise_sequence(made, meshes, around=around, frames=job.frames, **common)


def _refuse(job: Synth, options: dict[str, Any]) -> None:
    """Usage error for options that the scene would ignore."""
    for name, value in options.items():
        if value is not None:
            raise Usage(f"the scene {job.scene!r} does not use this option; leave it out", name)
