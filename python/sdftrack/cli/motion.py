# SPDX-License-Identifier: MIT
"""``sdftrack motion``: an exercise measured from tracked poses."""

from __future__ import annotations

import sys
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

EXPORTS = ("c3d", "sto", "trc", "csv")
ALL_LOST = 3  # exit code


def motion(
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT...",
            help="Folders of track, reconstruct or live, or TUM, BOP, C3D or CSV files; several are sessions in order.",
        ),
    ],
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    fps: Annotated[
        float | None, typer.Option(min=0.1, max=10_000, help="Frames per second, of files without times.")
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of lengths: m, mm or cm.")] = None,
    object_: Annotated[
        list[str] | None,
        typer.Option(
            "--object", metavar="NAME|N", help="Only this object, by name or number from 1; repeatable."
        ),
    ] = None,
    by: Annotated[
        str, typer.Option(metavar="auto|position|rotation", help="What a repetition is found by.")
    ] = "auto",
    repetitions: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Repetitions corrected by hand: a changed repetitions.json, or CSV of start_s,end_s.",
        ),
    ] = None,
    cues: Annotated[
        str | None, typer.Option(metavar="T1,T2,...|FILE", help="Times of the signals to start, s.")
    ] = None,
    up: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z|table",
            help="Direction against gravity in the camera frame, or the normal of the table in the recording.",
        ),
    ] = None,
    frame: Annotated[
        str, typer.Option(metavar="camera|table", help="Frame of positions; table: needs the recording.")
    ] = "camera",
    point: Annotated[
        str,
        typer.Option(
            metavar="center|origin|X,Y,Z",
            help="Point of the object that is measured; center: near the middle of its model, where it is known "
            "best.",
        ),
    ] = "center",
    axis: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Axis of the object that points up when it stands.")
    ] = "0,0,1",
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="sphere:x,y,z,r|box:x0,y0,z0,x1,y1,z1|path:FILE,r",
            help="Zone or path, metres; repeatable.",
        ),
    ] = None,
    measures: Annotated[str | None, typer.Option(metavar="A,B,...", help="Only these measures.")] = None,
    session: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME|DATE", help="Name of a session in the report; repeated, one for every RESULT."
        ),
    ] = None,
    max_gap: Annotated[
        float, typer.Option(min=0.01, max=10, help="Longest time without a pose that is bridged, s.")
    ] = 0.3,
    export: Annotated[
        str | None, typer.Option(metavar="c3d,sto,trc,csv", help="Smoothed trajectories for other programs.")
    ] = None,
    config: ConfigOption = None,
    device: DeviceOption = "auto",
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Measure an exercise: repetitions, range, speed, smoothness, tremor, each with a 95 % interval.

    Writes report.html to read and print, measures.csv (a row per repetition), measures.json, trajectory_smoothed.csv,
    and repetitions.json, which can be corrected and given back. With several RESULTs the report compares them as
    sessions. The exit code is 3 where all objects of a RESULT are lost in all frames.
    """
    from sdftrack.cli.motion_inputs import AllLost, Wishes, load_sessions, parse_point
    from sdftrack.cli.motion_run import OUTPUTS, measure
    from sdftrack.cli.motion_times import read_cues, read_spans
    from sdftrack.io.out_folder import refuse_folder, refuse_inputs

    if out is None:
        raise Usage("expected the folder to write", "--out")
    if by not in ("auto", "position", "rotation"):
        raise Usage(f"expected auto, position or rotation, got {by!r}", "--by")
    if frame not in ("camera", "table"):
        raise Usage(f"expected camera or table, got {frame!r}", "--frame")
    if repetitions is not None and len(results) > 1:
        raise Usage("expected one RESULT with repetitions set by hand", "--repetitions")
    if session and len(session) != len(results):
        raise Usage(f"expected one for every RESULT ({len(results)}), got {len(session)}", "--session")
    wanted = _listed(export, EXPORTS, "--export")
    wishes = Wishes(
        fps=fps,
        unit=unit,
        objects=tuple(object_ or ()),
        point=parse_point(point),
        up=None if up in (None, "table") else _direction(str(up), "--up"),
        table=up == "table" or frame == "table",
        in_table_frame=frame == "table",
    )
    options: dict[str, Any] = {"by": by, "max_gap_s": max_gap, "axis_obj": _direction(axis, "--axis")}
    options["cues_s"] = read_cues(cues)
    options["threads"] = threads
    check_cpu_only(config, device)
    options["targets"] = _targets(target)
    options["measures"] = _measures(measures)
    spans = None if repetitions is None else (repetitions, read_spans(repetitions))
    refuse_folder(out, overwrite)
    inputs = [("RESULT", path) for path in results if path.is_file()]
    refuse_inputs(out, [*OUTPUTS, *(f"trajectory.{e}" for e in wanted)], inputs)
    try:
        sessions = load_sessions(results, session or [], wishes)
    except AllLost as error:
        print(f"sdftrack: {error}; next: look at the recording with sdftrack view", file=sys.stderr)
        raise typer.Exit(ALL_LOST) from None
    measure(sessions, options, spans, out, overwrite, wanted, quiet)


def _direction(text: str, option: str) -> tuple[float, ...]:
    from sdftrack.cli.motion_inputs import numbers_of

    values = numbers_of(text, 3, option)
    if not any(values):
        raise Usage(f"expected a direction x,y,z, got {text!r}", option)
    return values


def _targets(texts: list[str] | None) -> list[Any]:
    if not texts:
        return []
    from sdftrack.motion import parse_target

    try:
        return [parse_target(t) for t in texts]
    except ValueError as error:
        raise Usage(str(error), "--target") from None


def _measures(text: str | None) -> list[str] | None:
    if text is None:
        return None
    from sdftrack.motion import DEFINITIONS

    return _listed(text, tuple(DEFINITIONS), "--measures")


def _listed(text: str | None, known: tuple[str, ...], option: str) -> list[str]:
    """Words separated by commas, all of them known."""
    words = [] if text is None else [t.strip() for t in text.split(",")]
    for word in words:
        if word not in known:
            raise Usage(f"expected some of {', '.join(known)}, got {word!r}", option)
    return list(dict.fromkeys(words))
