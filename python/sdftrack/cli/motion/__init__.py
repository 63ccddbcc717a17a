# SPDX-License-Identifier: MIT
"""The options of ``sdftrack motion``, and what they exclude."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import typer

from sdftrack.cli.common import ALL_LOST, Common, floats
from sdftrack.cli.options import Usage, argument, option

__all__ = ["Motion", "motion"]

EXPORTS = ("c3d", "sto", "trc", "csv")


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
        """Usage error for options that do not go together."""
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
        """Whether the table has to be found in the recording."""
        return "table" in (self.up, self.frame)

    def up_camera(self) -> tuple[float, ...] | None:
        return None if self.up in (None, "table") else _direction(str(self.up), "--up")

    def point_obj(self) -> str | tuple[float, ...]:
        """The point that is measured: "center", "origin" or coordinates, m."""
        named = self.point in ("center", "origin")
        return self.point if named else _three(self.point, "--point")

    def options(self) -> dict[str, Any]:
        """Keyword arguments of `analyze`."""
        from sdftrack.cli.motion.inputs import read_cues
        from sdftrack.motion import DEFINITIONS, parse_target

        try:
            targets = [parse_target(text) for text in self.target]
        except ValueError as error:
            raise Usage(str(error), "--target") from None
        return {
            "by": self.by,
            "max_gap_s": self.max_gap,
            "axis_obj": _direction(self.axis, "--axis"),
            "cues_s": read_cues(self.cues),
            "threads": self.threads,
            "targets": targets,
            "measures": None
            if self.measures is None
            else _listed(self.measures, tuple(DEFINITIONS), "--measures"),
        }


def motion(job: Motion) -> None:
    from sdftrack.cli.motion.inputs import AllLost, load_sessions, read_spans
    from sdftrack.cli.motion.run import OUTPUTS, measure

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
    measure(sessions, options, spans, job)


def _three(text: str, name: str) -> tuple[float, ...]:
    values = floats(text, 3)
    if not values:
        raise Usage(f"expected 3 numbers separated by commas, got {text!r}", name)
    return values


def _direction(text: str, name: str) -> tuple[float, ...]:
    values = _three(text, name)
    if not any(values):
        raise Usage(f"expected a direction x,y,z, got {text!r}", name)
    return values


def _listed(text: str | None, known: tuple[str, ...], name: str) -> list[str]:
    """Words separated by commas, all of them known."""
    words = [] if text is None else [t.strip() for t in text.split(",")]
    for word in words:
        if word not in known:
            raise Usage(f"expected some of {', '.join(known)}, got {word!r}", name)
    return list(dict.fromkeys(words))
