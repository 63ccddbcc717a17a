# SPDX-License-Identifier: MIT
"""The work of ``sdftrack motion``: each trajectory measured, the files written, a table printed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sdftrack._internal.files import write_json, write_text
from sdftrack.cli.common import show_table
from sdftrack.cli.motion.inputs import Session, Spans, spans_of

if TYPE_CHECKING:
    from sdftrack.cli.motion import Motion

OUTPUTS = ("measures.json", "measures.csv", "report.html", "repetitions.json", "trajectory_smoothed.csv")
NOTE_RATE_HZ = 50.0  # a zone that is entered for less than 20 ms is not


def measure(
    sessions: Sequence[Session], options: dict[str, Any], spans: tuple[Path, Spans] | None, job: Motion
) -> None:
    """Measure and write; nothing is written where a trajectory cannot be measured."""
    analyses = {s.name: [_analysis(t, s.up, options, spans) for t in s.trajectories] for s in sessions}
    notes = [note for s in sessions for note in _notes(s, analyses[s.name], options["targets"], spans)]
    out = job.folder
    _write(sessions, analyses, notes, _settings(sessions, options, spans), job)
    if job.quiet:
        return
    for name, each in analyses.items():
        for a in each:
            _print(name, a)
    for note in notes:
        print(note)
    print(f"written to {out}; open {out / 'report.html'} in a browser")


def _write(
    sessions: Sequence[Session],
    analyses: dict[str, list[Any]],
    notes: list[str],
    settings: dict[str, Any],
    job: Motion,
) -> None:
    from sdftrack.motion import report

    out, changes = job.folder, report.compare_sessions(analyses)
    pairs = {name: report.pairs_of(each) for name, each in analyses.items()}
    job.make_out()
    values = report.measures_json(analyses, changes, settings, notes=notes, pairs=pairs)
    write_json(out / "measures.json", values)
    write_text(out / "measures.csv", report.measures_csv(analyses))
    for k, each in enumerate(analyses.values(), 1):
        name = "repetitions.json" if len(analyses) == 1 else f"repetitions_{k}.json"
        write_text(out / name, report.repetitions_text(each))
    write_text(out / "trajectory_smoothed.csv", report.smoothed_csv(analyses))
    names = ", ".join(dict.fromkeys(a.trajectory.name for each in analyses.values() for a in each))
    lines = [f"{s.name}: {s.path}" for s in sessions] + notes
    page = report.report_html(analyses, changes, title=f"Exercise with {names}", notes=lines, pairs=pairs)
    write_text(out / "report.html", page)
    _export(analyses, out, job.exports)


def _analysis(trajectory: Any, up: Any, options: dict[str, Any], spans: tuple[Path, Spans] | None) -> Any:
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
            nearest = _nearest(a, target)
            if nearest > 0:
                notes.append(
                    f"{session.name}: target {k} was never entered by {name}; the nearest distance is "
                    f"{1e3 * nearest:.0f} mm."
                )
        if spans is not None and a.trajectory.name not in spans[1] and None not in spans[1]:
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


def _settings(
    sessions: Sequence[Session], options: dict[str, Any], spans: tuple[Path, Spans] | None
) -> dict[str, Any]:
    return {
        "results": [str(s.path) for s in sessions],
        **{k: v for k, v in options.items() if k not in ("targets", "threads")},
        "targets": [str(t) for t in options["targets"]],
        "up": [None if s.up is None else [float(v) for v in s.up] for s in sessions],
        "repetitions": None if spans is None else str(spans[0]),
    }


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


def _export(analyses: dict[str, list[Any]], out: Path, wanted: Sequence[str]) -> None:
    from sdftrack.motion import save, smoothed_trajectory

    for k, each in enumerate(analyses.values(), 1):
        stem = "trajectory" if len(analyses) == 1 else f"trajectory_{k}"
        for suffix in wanted:
            save(out / f"{stem}.{suffix}", [smoothed_trajectory(a.motion) for a in each])
