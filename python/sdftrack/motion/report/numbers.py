# SPDX-License-Identifier: MIT
"""The measures of one or several objects and sessions as JSON and CSV."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sdftrack import __version__
from sdftrack._internal.text_files import text_cell
from sdftrack.io.report_file import plain
from sdftrack.motion.analysis import Analysis, MeasuredRepetition
from sdftrack.motion.report.sessions import Change
from sdftrack.motion.report.words import gaps_of
from sdftrack.motion.spline import continuous_quaternions
from sdftrack.motion.two_objects import Pair

FORMAT = 1  # of measures.json; changes when a program that reads it has to change


def measures_json(
    sessions: Mapping[str, Sequence[Analysis]],
    changes: Sequence[Change] = (),
    settings: Mapping[str, Any] | None = None,
    *,
    notes: Sequence[str] = (),
    pairs: Mapping[str, Sequence[Pair]] | None = None,
) -> dict[str, Any]:
    """What ``measures.json`` holds, ready for JSON; docs/reference/motion.schema.json describes it.

    Parameters
    ----------
    sessions : dict of str to list of Analysis
        By name; one Analysis per object.
    changes : list of Change
        Of :func:`compare_sessions`.
    settings : dict
        How the measures were made.
    notes : list of str
        What a reader of the numbers should know, in sentences.
    pairs : dict of str to list of Pair, optional
        Of :func:`pairs_of`, by session.
    """
    asked = {d.name: d for each in sessions.values() for a in each for d in a.definitions}
    content = {
        "format": FORMAT,
        "version": __version__,
        "settings": dict(settings or {}),
        "notes": list(notes),
        "definitions": {
            d.name: {"label": d.label, "unit": d.unit, "definition": d.text, "source": d.source}
            for d in asked.values()
        },
        "sessions": [
            {
                "name": name,
                "objects": [_object(a) for a in each],
                "pairs": [p.to_dict() for p in (pairs or {}).get(name, ())],
            }
            for name, each in sessions.items()
        ],
        "changes": [c.to_dict() for c in changes],
    }
    return dict(plain(content))


def _object(a: Analysis) -> dict[str, Any]:
    trajectory = a.trajectory
    gaps = sum(r.gap_s for r in a.repetitions)
    return {
        "object": trajectory.name,
        "frame": trajectory.frame,
        "start_s": float(trajectory.times_s[0]),
        "duration_s": trajectory.duration_s,
        "rate_hz": trajectory.rate_hz,
        "images": len(trajectory),
        "status": a.shares,
        "gaps_s": gaps_of(a),
        "gap_in_repetitions_s": gaps,
        "noise_scales": list(a.motion.noise_scales),
        "position_noise_m": a.motion.position_noise_m,
        "repetitions": {"count": a.count[0], "low": a.count[1], "high": a.count[2]},
        "path_difference_m": a.path_difference_m,
        "averages": [m.to_dict() for m in a.averages.values()],
        "coefficient_of_variation": a.variation,
        "tremor": [
            {
                "start_s": start, "end_s": end, "rms_m": t.rms_m, "low_m": t.low_m, "high_m": t.high_m,
                "noise_floor_m": t.floor_m, "frequency_hz": t.frequency_hz, "band_hz": list(t.band_hz),
                "determined": t.determined,
            }
            for start, end, t in a.tremors
        ],
        "each": [_repetition(r) for r in a.repetitions],
    }  # fmt: skip


def _repetition(r: MeasuredRepetition) -> dict[str, Any]:
    return {
        "start_s": r.span.start_s,
        "end_s": r.span.end_s,
        "cue_s": r.cue_s,
        "gap_s": r.gap_s,
        "phases": [{"name": p.name, "start_s": p.start_s, "end_s": p.end_s} for p in r.span.phases],
        "measures": [m.to_dict() for m in r.values.values()],
    }


def measures_csv(sessions: Mapping[str, Sequence[Analysis]]) -> str:
    """One row per repetition. Columns of a measure are ``name_unit``, ``name_low`` and ``name_high``.

    A cell is empty where the measure is undefined; of one that is not determined the value is empty, its interval not.
    """
    everything = [
        (name, a, k, r)
        for name, each in sessions.items()
        for a in each
        for k, r in enumerate(a.repetitions, 1)
    ]
    units = {n: m.unit for _, _, _, r in everything for n, m in r.values.items()}
    head = ["session", "object", "repetition", "start_s", "end_s", "gap_s"]
    for name, unit in units.items():
        unit = unit.replace("/", "_per_").replace("^", "").replace("%", "percent")  # m/s^2 is m_per_s2
        head += [name if unit == "1" else f"{name}_{unit}", f"{name}_low", f"{name}_high"]
    rows = [[text_cell(column) for column in head]]
    for session, a, k, r in everything:
        row = [
            text_cell(session),
            text_cell(a.trajectory.name),
            str(k),
            f"{r.span.start_s:.4f}",
            f"{r.span.end_s:.4f}",
            f"{r.gap_s:.3f}",
        ]
        for name in units:
            m = r.values.get(name)
            row += (
                ["", "", ""]
                if m is None
                else [_cell(m.value) if m.determined else "", _cell(m.low), _cell(m.high)]
            )
        rows.append(row)
    return "".join(",".join(row) + "\n" for row in rows)


def repetitions_text(analyses: Sequence[Analysis]) -> str:
    """``repetitions.json``: a line per repetition, to be corrected by hand and given back with --repetitions."""
    objects = []
    for a in analyses:
        rows = [f"      [{r.span.start_s:.3f}, {r.span.end_s:.3f}]" for r in a.repetitions]
        listed = "[\n" + ",\n".join(rows) + "\n    ]" if rows else "[]"
        name = json.dumps(a.trajectory.name, ensure_ascii=False)
        objects.append(f'  {{\n    "object": {name},\n    "repetitions": {listed}\n  }}')
    return '{"columns": ["start_s", "end_s"], "objects": [\n' + ",\n".join(objects) + "\n]}\n"


def _cell(value: float) -> str:
    return f"{value:.9g}" if np.isfinite(value) else ""


COLUMNS = (
    "time_s", "x_m", "y_m", "z_m", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s", "qx", "qy", "qz", "qw",
    "wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s",
)  # fmt: skip
ROW = ",".join(["%.4f", *["%.7g"] * (len(COLUMNS) - 1)])


def smoothed_csv(sessions: Mapping[str, Sequence[Analysis]]) -> str:
    """A row per object and frame, at regular times of the frame rate; in gaps only the time.

    Position and velocity are those of the measured point, the rotation is a quaternion of the object in the reference
    frame, the angular velocity has the axes of that frame.
    """
    lines = [",".join(["session", "object", *COLUMNS])]
    for session, each in sessions.items():
        for a in each:
            head = f"{text_cell(session)},{text_cell(a.trajectory.name)}"
            lines += [f"{head},{row}" for row in _rows(a)]
    return "\n".join(lines) + "\n"


def _rows(a: Analysis) -> list[str]:
    mean = a.motion.mean(a.motion.times_s(a.trajectory.rate_hz))
    seen = mean.observed
    q = np.full((len(seen), 4), np.nan)
    if seen.any():
        q[seen] = continuous_quaternions(mean.rotations[0, seen])
    turning = mean.angular_velocities_radps[0]
    table = np.column_stack([mean.times_s, mean.positions_m[0], mean.velocities_mps[0], q, turning])
    empty = "," * (len(COLUMNS) - 1)
    return [
        ROW % tuple(row) if known else f"{row[0]:.4f}{empty}"
        for row, known in zip(table.tolist(), seen.tolist(), strict=True)
    ]
