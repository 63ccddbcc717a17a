# SPDX-License-Identifier: MIT
"""``sdftrack motion``: the measures of an exercise, from tracked poses."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from sdftrack._internal.files import write_json, write_text
from sdftrack.cli.common import ALL_LOST, Common, floats, show_table
from sdftrack.cli.options import Usage, argument, option

if TYPE_CHECKING:
    from sdftrack.cli.motion.inputs import Session, Spans

__all__ = ["Motion", "motion"]

EXPORTS = ("c3d", "sto", "trc", "csv")
OUTPUTS = ("measures.json", "measures.csv", "report.html", "repetitions.json", "trajectory_smoothed.csv")
NOTE_RATE_HZ = 50.0  # a zone that is entered for less than 20 ms is not


@dataclass(frozen=True, kw_only=True)
class Motion(Common):
    """Measure an exercise: repetitions, range, speed, smoothness, tremor, each with a 95 % interval.

    Writes report.html to read and print, measures.csv (a row per repetition), measures.json, trajectory_smoothed.csv,
    and repetitions.json, which can be corrected and given back. With several RESULTs the report compares them as
    sessions. The exit code is 3 where all objects of a RESULT are lost in all frames.
    """

    results: tuple[Path, ...] = argument(
        "Folders of track, reconstruct or live, or TUM, BOP, C3D or CSV files; several are sessions in order.",
        "RESULT...",
    )
    fps: float | None = option(None, "Frames per second, of files without times.", min=0.1, max=10_000)
    unit: Literal["m", "mm", "cm"] | None = option(None, "Unit of lengths.")
    object_: tuple[str, ...] = option(
        (), "Only this object, by name or number from 1; repeatable.", metavar="NAME|N"
    )
    by: Literal["auto", "position", "rotation"] = option("auto", "What a repetition is found by.")
    repetitions: Path | None = option(
        None,
        "Repetitions corrected by hand: a changed repetitions.json, or CSV of start_s,end_s.",
        metavar="FILE",
    )
    cues: str | None = option(None, "Times of the signals to start, s.", metavar="T1,T2,...|FILE")
    up: str | None = option(
        None,
        "Direction against gravity in the camera frame, or the normal of the table in the recording.",
        metavar="X,Y,Z|table",
    )
    frame: Literal["camera", "table"] = option("camera", "Frame of positions; table: needs the recording.")
    point: str = option(
        "center",
        "Point of the object that is measured; center: near the middle of its model, where it is known best.",
        metavar="center|origin|X,Y,Z",
    )
    axis: str = option("0,0,1", "Axis of the object that points up when it stands.", metavar="X,Y,Z")
    target: tuple[str, ...] = option(
        (), "Zone or path, metres; repeatable.", metavar="sphere:x,y,z,r|box:x0,y0,z0,x1,y1,z1|path:FILE,r"
    )
    measures: str | None = option(None, "Only these measures.", metavar="A,B,...")
    session: tuple[str, ...] = option(
        (), "Name of a session in the report; repeated, one for every RESULT.", metavar="NAME|DATE"
    )
    max_gap: float = option(0.3, "Longest time without a pose that is bridged, s.", min=0.01, max=10)
    export: str | None = option(None, "Smoothed trajectories for other programs.", metavar="c3d,sto,trc,csv")

    def check(self) -> None:
        if self.out is None:
            raise Usage("expected the folder to write", "--out")
        if self.repetitions is not None and len(self.results) > 1:
            raise Usage("expected one RESULT with repetitions set by hand", "--repetitions")
        if self.session and len(self.session) != len(self.results):
            raise Usage(
                f"expected one for every RESULT ({len(self.results)}), got {len(self.session)}", "--session"
            )

    @property
    def exports(self) -> list[str]:
        return _listed(self.export, EXPORTS, "--export")

    @property
    def table(self) -> bool:
        return "table" in (self.up, self.frame)

    def up_camera(self) -> tuple[float, ...] | None:
        return None if self.up in (None, "table") else _numbers(str(self.up), "--up", "a direction x,y,z")

    def point_obj(self) -> str | tuple[float, ...]:
        named = self.point in ("center", "origin")
        return self.point if named else _numbers(self.point, "--point")

    def options(self) -> dict[str, Any]:
        """Keyword arguments of `analyze`."""
        from sdftrack.cli.motion.inputs import read_cues
        from sdftrack.motion import DEFINITIONS, parse_target

        try:
            targets = [parse_target(text) for text in self.target]
        except ValueError as error:
            raise Usage(str(error), "--target") from None
        known, measures = tuple(DEFINITIONS), self.measures
        return {
            "by": self.by, "max_gap_s": self.max_gap, "axis_obj": _numbers(self.axis, "--axis", "a direction x,y,z"),
            "cues_s": read_cues(self.cues), "threads": self.threads, "targets": targets,
            "measures": None if measures is None else _listed(measures, known, "--measures"),
        }  # fmt: skip


def motion(job: Motion) -> None:
    from sdftrack.cli.motion.inputs import AllLost, load_sessions, read_spans

    job.check()
    exports, _, _ = job.exports, job.up_camera(), job.point_obj()
    job.on_cpu()
    options = job.options()
    spans = None if job.repetitions is None else (job.repetitions, read_spans(job.repetitions))
    inputs = [("RESULT", path) for path in job.results if path.is_file()]
    job.refuse_out([*OUTPUTS, *(f"trajectory.{e}" for e in exports)], inputs)
    try:
        sessions = load_sessions(job)
    except AllLost as error:
        print(f"sdftrack: {error}; next: look at the recording with sdftrack view", file=sys.stderr)
        raise typer.Exit(ALL_LOST) from None
    _measure(sessions, options, spans, job)


def _numbers(text: str, name: str, direction: str = "") -> tuple[float, ...]:
    """Three numbers; of a `direction`, as the usage error calls it, not all zero."""
    values = floats(text, 3)
    if not values or (direction and not any(values)):
        expected = direction if values else "3 numbers separated by commas"
        raise Usage(f"expected {expected}, got {text!r}", name)
    return values


def _listed(text: str | None, known: tuple[str, ...], name: str) -> list[str]:
    words = [] if text is None else [t.strip() for t in text.split(",")]
    for word in words:
        if word not in known:
            raise Usage(f"expected some of {', '.join(known)}, got {word!r}", name)
    return list(dict.fromkeys(words))


def _measure(
    sessions: Sequence[Session], options: dict[str, Any], spans: tuple[Path, Spans] | None, job: Motion
) -> None:
    """Measure and write; nothing is written where a trajectory cannot be measured."""
    from sdftrack.motion import report, save, smoothed_trajectory

    analyses = {s.name: [_analysis(t, s.up, options, spans) for t in s.trajectories] for s in sessions}
    notes = [note for s in sessions for note in _notes(s, analyses[s.name], options["targets"], spans)]
    settings = {
        "results": [str(s.path) for s in sessions],
        **{k: v for k, v in options.items() if k not in ("targets", "threads")},
        "targets": [str(t) for t in options["targets"]],
        "up": [None if s.up is None else [float(v) for v in s.up] for s in sessions],
        "repetitions": None if spans is None else str(spans[0]),
    }
    changes = report.compare_sessions(analyses)
    pairs = {name: report.pairs_of(each) for name, each in analyses.items()}
    out = job.make_out()
    values = report.measures_json(analyses, changes, settings, notes=notes, pairs=pairs)
    write_json(out / "measures.json", values)
    write_text(out / "measures.csv", report.measures_csv(analyses))
    write_text(out / "trajectory_smoothed.csv", report.smoothed_csv(analyses))
    for k, each in enumerate(analyses.values(), 1):
        number = "" if len(analyses) == 1 else f"_{k}"
        write_text(out / f"repetitions{number}.json", report.repetitions_text(each))
        for suffix in job.exports:
            save(out / f"trajectory{number}.{suffix}", [smoothed_trajectory(a.motion) for a in each])
    names = ", ".join(dict.fromkeys(a.trajectory.name for each in analyses.values() for a in each))
    lines = [f"{s.name}: {s.path}" for s in sessions] + notes
    page = report.report_html(analyses, changes, title=f"Exercise with {names}", notes=lines, pairs=pairs)
    write_text(out / "report.html", page)
    if not job.quiet:
        _tell(analyses, notes, out)


def _tell(analyses: dict[str, list[Any]], notes: list[str], out: Path) -> None:
    def value(m: Any) -> str:
        return f"{m.value:.4g}" if m.determined else "not determined"

    for session, each in analyses.items():
        for a in each:
            count, low, high = a.count
            repetitions = f"{count} repetitions ({low} to {high}) in {a.trajectory.duration_s:.1f} s"
            print(f"{session}, {a.trajectory.name}: {repetitions}")
            rows = [[m.name, value(m), f"{m.low:.4g}", f"{m.high:.4g}", m.unit] for m in a.averages.values()]
            if rows:
                head = ["measure", "value", "low", "high", "unit"]
                show_table("averages over the repetitions", head, rows)
    for note in notes:
        print(note)
    print(f"written to {out}; open {out / 'report.html'} in a browser")


def _analysis(trajectory: Any, up: Any, options: dict[str, Any], spans: tuple[Path, Spans] | None) -> Any:
    from sdftrack.cli.motion.inputs import spans_of
    from sdftrack.motion import analyze

    own = None if spans is None else spans_of(spans[1], spans[0], trajectory)
    try:
        return analyze(trajectory, up=up, spans_s=own, **options)
    except ValueError as error:
        raise ValueError(str(error).replace("(max_gap_s)", "(--max-gap)")) from None


def _notes(
    session: Session, analyses: Sequence[Any], targets: Sequence[Any], spans: tuple[Path, Spans] | None
) -> list[str]:
    """What the numbers alone do not tell, in sentences."""
    notes = []
    for a in analyses:
        name = a.trajectory.name
        for k, target in enumerate(targets, 1):
            nearest_mm = 1e3 * _nearest(a, target)
            if nearest_mm > 0:
                never = f"target {k} was never entered by {name}"
                notes.append(f"{session.name}: {never}; the nearest distance is {nearest_mm:.0f} mm.")
        if spans is not None and name not in spans[1] and None not in spans[1]:
            notes.append(f"{session.name}: {spans[0]} has no repetitions of {name}; they were found anew.")
    spans_s = {(float(a.trajectory.times_s[0]), float(a.trajectory.times_s[-1])) for a in analyses}
    if len(spans_s) > 1:
        start, end = max(s for s, _ in spans_s), min(e for _, e in spans_s)
        notes.append(
            f"{session.name}: the recordings of the objects differ in length; what concerns two of them is "
            f"computed for the time that they have in common ({start:.2f} to {end:.2f} s for all)."
        )
    return notes


def _nearest(a: Any, target: Any) -> float:
    """Smallest distance of the smoothed path from a target; 0 inside."""
    import numpy as np

    distances = target.distances(a.motion.mean(a.motion.times_s(NOTE_RATE_HZ)).positions_m[0])
    return max(float(np.nanmin(distances)), 0.0)
