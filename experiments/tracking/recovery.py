# SPDX-License-Identifier: MIT
"""Loss and recovery: the object leaves, or is hidden, and comes back elsewhere."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from experiments.common.protocol import MESHES, load_mesh, load_sdf, say
from experiments.common.tracked_scene import WRONG_M, WRONG_RAD, Run, track_scene
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table
from sdftrack import synth

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
    off = (run.errors.translation_m > WRONG_M) | (run.errors.rotation_rad > WRONG_RAD)
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


@experiment(
    "recovery",
    needs=["meshes"],
    chosen_on="the weights of confidence: `trust.fit`; the search: `start`",
    reported_on="lm_driller, lm_can, lm_cat, spot; seeds 0 to 24",
    short={"only": ("spot",), "mode": ("depth",), "seeds": 1, "frames": 40, "voxels": 80},
)
def recovery(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    mode: tuple[Literal["depth", "rgbd"], ...] = ("depth", "rgbd"),
    seeds: int = 25,
    frames: int = FIRST + AWAY + AFTER,
    sigma: float = 0.001,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """Loss and recovery: the object leaves, or is hidden, for 15 frames and comes back elsewhere.

    Every trial has 20 frames of tracking, 15 without the object (out of the image in even trials, behind a board in odd
    ones), 25 with the object at another place, rotated at random, over a cluttered table. Counted are the frames until
    it is called lost, the frames until it is found again, and frames that are called ok with a pose more than 20 mm or
    10 deg off, or without a visible object: false recoveries.

    Parameters
    ----------
    frames
        of each trial
    seeds
        trials of each mesh
    """
    if frames <= FIRST + AWAY:
        raise ValueError(f"frames: expected more than {FIRST + AWAY}, got {frames}")
    lines: list[list[str]] = []
    numbers: dict[str, Any] = {}
    for way in mode:
        trials: list[Trial] = []
        milliseconds: list[float] = []
        for name in only:
            mesh = load_mesh(data, name)
            sdf = load_sdf(mesh, name, voxels, cache)
            for seed in range(seeds):
                scene = _scene(mesh, seed, frames, sigma, threads, cache)
                run = track_scene(sdf, scene, way, {"threads": threads, **options})
                trials.append(judge(run))
                milliseconds += [1e3 * s for s in run.seconds[1:]]
                say(f"{way} {name} seed {seed} {trials[-1]}")
        lines.append(_cells(way, trials, milliseconds))
        numbers[way] = {"trials": [asdict(t) for t in trials], "milliseconds": milliseconds}
    return Table(f"{len(only) * seeds} trials, noise {1e3 * sigma:g} mm", HEAD, lines, numbers=numbers)


def _scene(mesh: Any, seed: int, frames: int, sigma: float, threads: int, cache: Path | None) -> Any:
    hidden = seed % 2 == 1
    return synth.sequence(
        mesh,
        frames,
        synth.leave_and_return(FIRST, AWAY, out_m=0.0 if hidden else 3.0),
        sigma,
        occluder=synth.Cover(FIRST, AWAY) if hidden else None,
        seed=seed,
        clutter=True,
        threads=threads,
        cache=cache,
    )
