# SPDX-License-Identifier: MIT
"""Loss and recovery: the object leaves, or is hidden, for 15 frames and comes back elsewhere.

    python -m sdftrack.eval.recovery --meshes DIR --cache DIR

Every trial is 60 frames over a cluttered table: 20 of tracking, 15 without the object (it is out of the image
in even trials, behind a board in odd ones), 25 with the object at another place, turned at random. Counted are
the frames until it is called lost, the frames until it is found again, and frames that are called ok with a
pose more than 20 mm or 10 deg off, or with no object to be seen: false recoveries.
"""

from __future__ import annotations

from collections.abc import Sequence as Seq
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sdftrack.evaluation.tracked_scene import (
    ASTRAY_M,
    ASTRAY_RAD,
    Run,
    arguments,
    load_sdf,
    settings_of,
    track_scene,
    write_rows,
)
from sdftrack.evaluation.tables import text_table

__all__ = ["Trial", "judge", "main"]

# Changing these numbers breaks comparisons with docs/results.md.
FIRST, AWAY, AFTER = 20, 15, 25
FLAG_WITHIN, FIND_WITHIN = 3, 10
HEAD = [
    "mode", "trials", "lost before", f"flagged <= {FLAG_WITHIN}", "slowest", f"found <= {FIND_WITHIN}", "% found",
    "never", "false", "ms median", "99 %", "max",
]  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """What became of one trial; frames are counted from the first without the object, or with it again.

    Attributes
    ----------
    flagged, found : int or None
        1: in the first frame; None: never.
    false_frames : int
        Frames called ok that are not.
    lost_before : int
        Frames called lost or off while the object was tracked in the beginning.
    """

    flagged: int | None
    found: int | None
    false_frames: int
    lost_before: int


def judge(run: Run, first: int = FIRST, away: int = AWAY) -> Trial:
    """Count what a trial's run says against the truth."""
    off = (run.errors.translation_m > ASTRAY_M) | (run.errors.rotation_rad > ASTRAY_RAD)
    lost = np.array([s in ("lost", "bad_frame") for s in run.status])
    ok = np.array([s == "ok" for s in run.status])
    back = first + away
    gone = np.flatnonzero(lost[first:back])
    flagged = None if not len(gone) else int(gone[0]) + 1
    right = np.flatnonzero(~lost[back:] & ~off[back:])
    # Late to notice is one fault, sure of a wrong pose after it has been noticed another.
    since = first + (min(flagged, FLAG_WITHIN) if flagged is not None else FLAG_WITHIN)
    absent = np.zeros(len(ok), bool)
    absent[first:back] = True
    false = ok & (off | absent)
    return Trial(
        flagged,
        None if not len(right) else int(right[0]) + 1,
        int(np.count_nonzero(false[since:])),
        int(np.count_nonzero(lost[:first] | off[:first])),
    )


def _cells(mode: str, trials: list[Trial], milliseconds: Any) -> list[str]:
    flagged = [t.flagged for t in trials if t.flagged is not None]
    in_time = sum(f <= FLAG_WITHIN for f in flagged)
    found = [t.found for t in trials if t.found is not None]
    quick = sum(f <= FIND_WITHIN for f in found)
    return [
        mode, str(len(trials)), str(sum(t.lost_before > 0 for t in trials)), str(in_time),
        str(max(flagged)) if len(flagged) == len(trials) else "never", str(quick), f"{100 * quick / len(trials):.0f}",
        str(len(trials) - len(found)), str(sum(t.false_frames > 0 for t in trials)),
        f"{np.median(milliseconds):.2f}", f"{np.percentile(milliseconds, 99):.2f}", f"{max(milliseconds):.2f}",
    ]  # fmt: skip


def main(given: Seq[str] | None = None) -> int:
    """Run the protocol and print the table."""
    import sdftrack as st

    p = arguments("sdftrack.eval.recovery", __doc__, frames=FIRST + AWAY + AFTER, seeds=25)
    p.add_argument("--trials", action="store_true", help="print every trial")
    a = p.parse_args(given)
    if a.frames <= FIRST + AWAY:
        p.error(f"--frames: expected more than {FIRST + AWAY}, got {a.frames}")
    tables: list[list[str]] = []
    rows: dict[str, Any] = {}
    names = [n for n in a.only.split(",") if n]
    for mode in a.mode.split(","):
        trials: list[Trial] = []
        milliseconds: list[float] = []
        for name in names:
            mesh = st.Mesh.load(a.meshes / f"{name}.ply")
            sdf = load_sdf(mesh, name, a.voxels, a.cache)
            for seed in range(a.seeds):
                run = track_scene(sdf, _scene(mesh, seed, a), mode, settings_of(a))
                trials.append(judge(run))
                milliseconds += [1e3 * s for s in run.seconds[1:]]
                if a.trials:
                    print(f"{mode} {name} seed {seed} {trials[-1]}", flush=True)
        tables.append(_cells(mode, trials, milliseconds))
        rows[mode] = {"trials": [asdict(t) for t in trials], "milliseconds": milliseconds}
    print(text_table(f"{len(names) * a.seeds} trials, noise {1e3 * a.sigma:g} mm", HEAD, tables))
    write_rows(a.json, a, rows)
    return 0


def _scene(mesh: Any, seed: int, a: Any) -> Any:
    from sdftrack import synth

    hidden = seed % 2 == 1
    return synth.sequence(
        mesh,
        a.frames,
        synth.leave_and_return(FIRST, AWAY, out_m=0.0 if hidden else 3.0),
        a.sigma,
        occluder=synth.Cover(FIRST, AWAY) if hidden else None,
        seed=seed,
        clutter=True,
        threads=a.threads,
        cache=a.cache,
    )


if __name__ == "__main__":
    raise SystemExit(main())
