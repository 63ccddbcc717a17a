# SPDX-License-Identifier: MIT
"""Several objects of the same appearance that touch and hide each other, tracked jointly and one by one.

Swaps count events: a pose that is claimed (ok, or weak with confidence 0.5) is nearer to another object's truth than to
its own. Errors are those of objects of which more than 30 % is visible, and so is "lost"; "deepest" is the deepest
penetration in any frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as Seq
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from experiments.common.protocol import load_mesh, load_sdf, say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.several.growth import COUNTS, fit_text, growth, time_row
from experiments.several.identity import run_way
from experiments.several.judged import COLUMNS, Measured, judge, measure, total
from experiments.several.shuffle import hands
from experiments.synth import several as scenes
from experiments.synth.contact import Solid
from experiments.synth.staged import Scene
from experiments.table import Table, cells

MESHES = ("lm_driller", "lm_cat", "spot", "lm_duck")
FIND_WITHIN = 10
CHOSEN = "lm_driller, lm_cat, spot, lm_duck; the seeds that are reported are among them"
QUICK = {"only": ("spot",), "ways": ("joint",), "voxels": 60, "frames": 4}
Ways: TypeAlias = tuple[Literal["joint", "single"], ...]
Modes: TypeAlias = tuple[Literal["depth", "rgbd"], ...]
Make: TypeAlias = "Callable[[Any, Solid, int], Scene]"


def noise_of(text: str | None, sigma: float) -> Any:
    """Noise by name: "kinect", or a number of millimetres as in "1mm"; None: `sigma` metres."""
    if text is None or text == "kinect":
        return sigma if text is None else text
    if not text.endswith("mm"):
        raise ValueError(f'noise: expected "kinect" or millimetres as in "1mm", got {text!r}')
    return 1e-3 * float(text[:-2])


@dataclass(frozen=True)
class Setting:
    """What all cases are rendered and tracked with.

    Attributes
    ----------
    options : dict
        Keyword arguments of the tracker.
    """

    data: Path
    ways: Ways
    mode: Modes
    noise: str
    voxels: int
    threads: int
    options: Any
    cache: Path | None

    @property
    def rendering(self) -> dict[str, Any]:
        """Keyword arguments of all scenes."""
        return {
            "noise": noise_of(self.noise, 0.0), "color": "rgbd" in self.mode, "threads": self.threads,
            "cache": self.cache,
        }  # fmt: skip

    @property
    def tracking(self) -> dict[str, Any]:
        """Keyword arguments of the tracker."""
        return {"threads": self.threads, **self.options}

    def solid(self, name: str) -> tuple[Any, Solid]:
        """The mesh of that name and the solid that it bounds."""
        mesh = load_mesh(self.data, name)
        return mesh, Solid.of(mesh, load_sdf(mesh, name, self.voxels, self.cache))

    def pairs(self) -> Iterator[tuple[str, str]]:
        """(mode, way) in the order of the tables."""
        for mode in self.mode:
            for way in self.ways:
                yield mode, way


def judged_frames(case: str, only: Seq[str], seeds: int, s: Setting, make: Make) -> Table:
    """A case that is judged frame by frame: a row for each mesh and way, and for all meshes together."""
    rows: dict[str, Any] = {}
    parts: dict[str, list[Measured]] = {}
    contacts = crossings = 0
    for name in only:
        mesh, solid = s.solid(name)
        own: dict[str, list[Measured]] = {}
        for seed in range(seeds):
            scene = make(mesh, solid, seed)
            contacts, crossings = contacts + scene.contacts, crossings + scene.crossings
            for mode, way in s.pairs():
                found = measure(scene, run_way(scene, way, mode, s.tracking))
                own.setdefault(f"{way}, {mode}", []).append(found)
        for key, found_all in own.items():
            rows[f"{name}, {key}"] = total(found_all)
            parts.setdefault(key, []).extend(found_all)
            say("  ".join(cells(COLUMNS, {"name": f"{name}, {key}", **rows[f"{name}, {key}"]})))
    if len(only) > 1:
        rows |= {f"all, {key}": total(measured) for key, measured in parts.items()}
    title = f"{case}: {contacts} contacts, {crossings} crossings, noise {s.noise}"
    return Table.of(title, COLUMNS, rows)


def _case(
    name: str,
    summary: str,
    make: Callable[..., Scene],
    frames: int | None,
    only: tuple[str, ...],
    reported_on: str,
) -> None:
    """Register ``several.NAME``: a scene of each mesh and seed, judged frame by frame."""

    def run(
        *,
        data: Path,
        only: tuple[str, ...] = only,
        ways: Ways = ("joint", "single"),
        mode: Modes = ("depth",),
        seeds: int = 1,
        frames: int | None = frames,
        noise: str = "1mm",
        voxels: int = 200,
        threads: int = 0,
        options: Settings = NO_SETTINGS,
        cache: Path | None = None,
    ) -> Table:
        s = Setting(data, ways, mode, noise, voxels, threads, options, cache)
        return judged_frames(
            name, only, seeds, s, lambda mesh, solid, seed: make(mesh, solid, frames, seed, **s.rendering)
        )

    run.__doc__ = f"""{summary}

    Parameters
    ----------
    noise
        "kinect", or millimetres as in "1mm"
    frames
        none: as many as the encounters take
    """
    register = experiment(
        f"several.{name}", needs=["meshes"], chosen_on=CHOSEN, reported_on=reported_on, short=QUICK
    )
    register(run)


_case(
    "meetings",
    "Two copies of an object touch and pass before each other.",
    scenes.meetings,
    None,
    MESHES,
    "the same four meshes, seed 0",
)
_case("hands", "Five copies of an object are shuffled.", hands, 1000, ("spot",), "spot, seed 0")
_case(
    "push",
    "Depth data that push two objects into each other, by 4 mm.",
    partial(scenes.push, push_m=0.004),
    400,
    MESHES,
    "the same four meshes, seed 0",
)


@experiment(
    "several.hidden",
    needs=["meshes"],
    chosen_on=CHOSEN,
    reported_on="the same four meshes in turn, seeds 0 to 49",
    short={**QUICK, "trials": 1},
)
def hidden(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    ways: Ways = ("joint", "single"),
    mode: Modes = ("depth",),
    trials: int = 50,
    frames: int = scenes.AFTER,
    noise: str = "1mm",
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """One of two copies is covered beside the other and comes out elsewhere: is it found, is anything swapped?

    Parameters
    ----------
    frames
        after the board is gone
    noise
        "kinect", or millimetres as in "1mm"
    trials
        with the meshes in turn
    """
    s = Setting(data, ways, mode, noise, voxels, threads, options, cache)
    solids = {name: s.solid(name) for name in only}
    rows: dict[str, Any] = {}
    for seed in range(trials):
        scene = scenes.hidden(*solids[only[seed % len(only)]], seed, frames, **s.rendering)
        for way_mode, way in s.pairs():
            tracked = run_way(scene, way, way_mode, s.tracking)
            found, wrong = judge(scene, tracked, scenes.FIRST + scenes.AWAY, FIND_WITHIN)
            empty: dict[str, Any] = {"found": [], "swapped": [], "deepest_mm": 0.0, "ms": []}
            row = rows.setdefault(f"{way}, {way_mode}", empty)
            row["found"].append(found)
            row["swapped"].append(wrong)
            row["deepest_mm"] = max(row["deepest_mm"], 1e3 * float(measure(scene, tracked).crowded.max()))
            row["ms"].append(1e3 * float(np.median(tracked.seconds[1:])))
    found_all = {
        name: {
            **row,
            "trials": trials,
            "quick": sum(f is not None for f in row["found"]),
            "slowest": max((f for f in row["found"] if f is not None), default=None),
            "swaps": sum(row["swapped"]),
            "median_ms": float(np.median(row["ms"])),
        }
        for name, row in rows.items()
    }
    columns = {
        "way": "name",
        "trials": "trials:d",
        f"found <= {FIND_WITHIN}": "quick:d",
        "slowest": "slowest:d",
    }
    columns |= {"swapped": "swaps:d", "deepest mm": "deepest_mm:.2f", "ms": "median_ms:.2f"}
    return Table.of(f"hidden for {scenes.AWAY} frames beside the other one", columns, found_all, numbers=rows)


@experiment(
    "several.row",
    needs=["meshes"],
    chosen_on="nothing: a time",
    reported_on="spot",
    short={**QUICK, "counts": (1, 2)},
)
def row_of_objects(
    *,
    data: Path,
    only: tuple[str, ...] = ("spot",),
    ways: Ways = ("joint", "single"),
    mode: Modes = ("depth",),
    counts: tuple[int, ...] = COUNTS,
    frames: int = 40,
    noise: str = "1mm",
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """Time of a frame against the number of objects side by side, for the first mesh.

    Parameters
    ----------
    counts
        numbers of objects, comma separated
    noise
        "kinect", or millimetres as in "1mm"
    """
    s = Setting(data, ways, mode, noise, voxels, threads, options, cache)
    mesh, solid = s.solid(only[0])
    rows: dict[str, Any] = {}
    notes, fits = [], {}
    for way_mode, way in s.pairs():
        own = [time_row(mesh, solid, n, way, way_mode, frames, s.tracking, **s.rendering) for n in counts]
        rows |= {f"{way}, {way_mode}, {n} objects": row for n, row in zip(counts, own, strict=True)}
        key = f"{way}, {way_mode}, fit"
        fits[key] = growth(counts, [r["ms_per_frame"] for r in own])
        notes.append(f"{way}, {way_mode}: {fit_text(fits[key])}")
    columns = {**COLUMNS, "pixels": "pixels:d"}
    return Table.of(f"{only[0]} side by side", columns, rows, notes=notes, numbers={**rows, **fits})
