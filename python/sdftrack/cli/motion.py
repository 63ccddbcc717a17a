# SPDX-License-Identifier: MIT
"""``sdftrack motion``: an exercise measured from tracked poses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sdftrack.cli.common import (
    ConfigOption,
    Device,
    DeviceOption,
    OutOption,
    OverwriteOption,
    QuietOption,
    ThreadsOption,
    Usage,
    check_cpu_only,
    show_table,
)

EXPORTS = ("c3d", "sto", "trc", "csv")
FILES = ("measures.json", "measures.csv", "report.html", "repetitions.json")


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
        typer.Option("--object", metavar="NAME", help="Only objects of this name; repeatable."),
    ] = None,
    by: Annotated[
        str, typer.Option(metavar="auto|position|rotation", help="What a repetition is found by.")
    ] = "auto",
    repetitions: Annotated[
        Path | None,
        typer.Option(metavar="FILE.json", help="Repetitions corrected by hand: a changed repetitions.json."),
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
    max_gap: Annotated[
        float, typer.Option(min=0.01, max=10, help="Longest time without a pose that is bridged, s.")
    ] = 0.3,
    export: Annotated[
        str | None, typer.Option(metavar="c3d,sto,trc,csv", help="Smoothed trajectories for other programs.")
    ] = None,
    config: ConfigOption = None,
    device: DeviceOption = Device.auto,
    threads: ThreadsOption = 0,
    quiet: QuietOption = False,
) -> None:
    """Measure an exercise: repetitions, range, speed, smoothness, tremor, each with a 95 % interval.

    Writes report.html to read and print, measures.csv (a row per repetition), measures.json, and repetitions.json,
    which can be corrected and given back. With several RESULTs the report compares them as sessions.
    """
    from sdftrack.cli.motion_inputs import (
        Wishes,
        load_sessions,
        numbers_of,
        parse_point,
        read_cues,
        read_spans,
    )
    from sdftrack.io.out_folder import refuse_folder

    if out is None:
        raise Usage("expected the folder to write", "--out")
    if by not in ("auto", "position", "rotation"):
        raise Usage(f"expected auto, position or rotation, got {by!r}", "--by")
    if frame not in ("camera", "table"):
        raise Usage(f"expected camera or table, got {frame!r}", "--frame")
    if repetitions is not None and len(results) > 1:
        raise Usage("expected one RESULT with repetitions set by hand", "--repetitions")
    wanted = _exports(export)
    wishes = Wishes(
        fps=fps,
        unit=unit,
        objects=tuple(object_ or ()),
        point=parse_point(point),
        up=None if up in (None, "table") else numbers_of(str(up), 3, "--up"),
        table=up == "table" or frame == "table",
        in_table_frame=frame == "table",
    )
    options: dict[str, Any] = {"by": by, "max_gap_s": max_gap, "axis_obj": numbers_of(axis, 3, "--axis")}
    options["cues_s"] = read_cues(cues)
    options["threads"] = threads
    options["targets"] = _targets(target)
    options["measures"] = None if measures is None else [m.strip() for m in measures.split(",")]
    if repetitions is not None:
        options["spans_s"] = read_spans(repetitions)
    check_cpu_only(config, device)
    refuse_folder(out, overwrite)
    _measure(load_sessions(results, wishes), options, out, overwrite, wanted, quiet)


def _measure(
    sessions: Any, options: dict[str, Any], out: Path, overwrite: bool, wanted: list[str], quiet: bool
) -> None:
    from sdftrack._internal.files import write_json, write_text
    from sdftrack.motion import analyze
    from sdftrack.motion.report import compare_sessions, measures_csv, measures_json, report_html
    from sdftrack.motion.report.numbers import repetitions_json
    from sdftrack.recorder import prepare_folder

    analyses = {s.name: [analyze(t, up=s.up, **options) for t in s.trajectories] for s in sessions}
    changes = compare_sessions(analyses)
    settings = {"results": [str(s.path) for s in sessions], **_told(options)}
    prepare_folder(out, overwrite)
    write_json(out / "measures.json", measures_json(analyses, changes, settings))
    write_text(out / "measures.csv", measures_csv(analyses))
    first = next(iter(analyses.values()))
    write_json(out / "repetitions.json", {"objects": [repetitions_json(a) for a in first]})
    notes = [f"{s.name}: {s.path}" for s in sessions]
    title = ", ".join(dict.fromkeys(a.trajectory.name for each in analyses.values() for a in each))
    write_text(
        out / "report.html", report_html(analyses, changes, title=f"Exercise with {title}", notes=notes)
    )
    _export(analyses, out, wanted)
    if not quiet:
        for name, each in analyses.items():
            for a in each:
                _print(name, a)
        print(f"written to {out}; open {out / 'report.html'} in a browser")


def _told(options: dict[str, Any]) -> dict[str, Any]:
    targets = [str(t) for t in options["targets"]]
    return {**{k: v for k, v in options.items() if k not in ("targets", "threads")}, "targets": targets}


def _print(session: str, a: Any) -> None:
    count, low, high = a.count
    print(
        f"{session}, {a.trajectory.name}: {count} repetitions ({low} to {high}) in {a.trajectory.duration_s:.1f} s"
    )
    rows = [
        [
            m.name,
            f"{m.value:.4g}" if m.determined else "not determined",
            f"{m.low:.4g}",
            f"{m.high:.4g}",
            m.unit,
        ]
        for m in a.averages.values()
    ]
    if rows:
        show_table("averages over the repetitions", ["measure", "value", "low", "high", "unit"], rows)


def _targets(texts: list[str] | None) -> list[Any]:
    from sdftrack.motion import parse_target

    try:
        return [parse_target(t) for t in texts or []]
    except ValueError as error:
        raise Usage(str(error), "--target") from None


def _exports(text: str | None) -> list[str]:
    wanted = [] if text is None else [t.strip() for t in text.split(",")]
    for one in wanted:
        if one not in EXPORTS:
            raise Usage(f"expected some of {', '.join(EXPORTS)}, got {one!r}", "--export")
    return wanted


def _export(analyses: dict[str, list[Any]], out: Path, wanted: list[str]) -> None:
    from sdftrack.motion import save
    from sdftrack.motion.smoothed import smoothed_trajectory

    for k, each in enumerate(analyses.values(), 1):
        stem = "trajectory" if len(analyses) == 1 else f"trajectory_{k}"
        for suffix in wanted:
            save(out / f"{stem}.{suffix}", [smoothed_trajectory(a.motion) for a in each])
