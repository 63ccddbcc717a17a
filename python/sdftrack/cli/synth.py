# SPDX-License-Identifier: MIT
"""``sdftrack synth``: rendered sequences and exercises with exact poses, to try everything with."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    Usage,
    check_cpu_only,
)
from sdftrack.cli.recording import (
    ColorFiles,
    ColorOption,
    ResumeOption,
    ToOption,
    check_to,
    items_of,
    opened,
    write_all,
)
from sdftrack.cli.synth_exercise import (
    TRUTH,
    ExerciseKind,
    ExerciseObject,
    exercise_scene,
    refuse_given,
)


class Scene(str, Enum):
    sequence = "sequence"
    exercise = "exercise"


class Motion(str, Enum):
    random = "random"
    orbit = "orbit"
    sweep = "sweep"
    static = "static"


class Around(str, Enum):
    none = "none"
    wall = "wall"
    table = "table"
    objects = "objects"
    touching = "touching"


def synth(
    scene: Annotated[
        Scene,
        typer.Argument(
            help="sequence: objects on a path; exercise: of rehabilitation, with an object on a table, and its truth "
            "in exercise.json.",
            case_sensitive=False,
        ),
    ] = Scene.sequence,
    model: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="M.ply",
            help="Mesh; repeat for several objects.",
            show_default="a duck; an exercise: a cup",
        ),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the meshes: m, mm, cm or in.")] = None,
    frames: Annotated[
        int | None,
        typer.Option(min=1, help="Number of frames.", show_default="120; an exercise: all"),
    ] = None,
    motion: Annotated[
        Motion | None,
        typer.Option(help="Path of the objects in a sequence.", case_sensitive=False, show_default="random"),
    ] = None,
    kind: Annotated[
        ExerciseKind | None,
        typer.Option(help="Kind of exercise.", case_sensitive=False, show_default="reach"),
    ] = None,
    object_: Annotated[
        ExerciseObject | None,
        typer.Option("--object", help="Object of an exercise.", case_sensitive=False, show_default="cup"),
    ] = None,
    repetitions: Annotated[
        int | None, typer.Option(min=1, help="Repetitions of an exercise.", show_default="5")
    ] = None,
    noise: Annotated[
        str, typer.Option(metavar="none|kinect|stereo|SIGMA", help="Depth noise; SIGMA in metres.")
    ] = "kinect",
    hidden: Annotated[
        float, typer.Option(min=0, max=0.8, help="Part of the first object that a hand hides.")
    ] = 0.0,
    around: Annotated[
        Around | None,
        typer.Option(
            help="Surroundings; of an exercise: none, wall or table.",
            case_sensitive=False,
            show_default="objects; an exercise: table",
        ),
    ] = None,
    fps: Annotated[float, typer.Option(min=1, max=1000, help="Frames per second.")] = 30.0,
    seed: Annotated[
        int, typer.Option(min=0, help="Random seed of path, noise, surroundings and colours.")
    ] = 0,
    to: ToOption = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    resume: ResumeOption = False,
    color: ColorOption = ColorFiles.png,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Render a sequence with exact poses, masks and models, to try the other commands with."""
    import sdftrack as st
    from sdftrack.io.writers import Contents
    from sdftrack.synth.duck import duck_mesh

    out = check_to(to, out)
    level = _noise(noise)
    check_cpu_only(config, device)
    loaded = {path: st.Mesh.load(path, unit=unit) for path in model or []}
    meshes = [loaded[path] for path in model or []]
    truth = None
    if scene is Scene.exercise:
        refuse_given("exercise", {"--motion": motion})
        truth, seq = exercise_scene(
            kind, object_, meshes, repetitions, fps, seed, around=_around_exercise(around), frames=frames,
            noise=level, occluder=hidden or None, threads=threads,
        )  # fmt: skip
    else:
        refuse_given("sequence", {"--kind": kind, "--object": object_, "--repetitions": repetitions})
        surroundings = around or Around.objects
        seq = st.synth.sequence(
            meshes or [duck_mesh()],
            frames or 120,
            (motion or Motion.random).value,
            level,
            hidden or None,
            seed,
            clutter=None if surroundings is Around.none else surroundings.value,
            fps=fps,
            threads=threads,
        )
    with opened(out, to, Contents(seq.camera, seq.objects, seq.models), color, resume, overwrite) as writer:
        write_all(writer, items_of(seq, writer.count, "rendering", quiet), "synthetic", "synth", quiet)
    if truth is not None:
        truth.save(out / TRUTH)
    if not quiet and writer.name == "bop" and len(seq.objects) == 1:
        print(f"try it: sdftrack track {out} --model {out / 'models/obj_000001.ply'} --out tracked")


def _around_exercise(around: Around | None) -> str | None:
    if around in (Around.objects, Around.touching):
        raise Usage("expected none, wall or table for an exercise", "--around")
    return None if around is Around.none else (around or Around.table).value


def _noise(text: str) -> Any:
    if text in ("kinect", "stereo"):
        return text
    if text == "none":
        return None
    try:
        sigma = float(text)
    except ValueError:
        sigma = -1.0
    if not 0 <= sigma < 1:
        raise Usage(
            f"expected none, kinect, stereo or a standard deviation in metres, got {text!r}", "--noise"
        )
    return sigma
