# SPDX-License-Identifier: MIT
"""Several objects of the same appearance that touch and hide each other, tracked jointly and one by one.

    python -m sdftrack.eval.several meetings --meshes DIR --cache DIR --ways joint,single
    python -m sdftrack.eval.several k1 --data DIR --mode rgbd

Cases: meetings (two copies touch and pass before each other), hands (five are shuffled), push (data that push
two into each other), hidden (one is covered beside the other and comes out elsewhere), row (time against their
number), approach (Figure 5.6), still (Figure 5.8), k1 (two recorded sponges). Swaps count events: a pose that is
claimed (ok, or weak with confidence 0.5) is nearer to another object's truth than to its own. Errors are those of
objects of which more than 30 % is visible, and so is "lost"; "deepest" is the deepest penetration in any frame.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack.reproduce.scenes import several as scenes
from sdftrack.reproduce.scenes.contact import Solid
from sdftrack.reproduce.measures.growth import COUNTS, fit_text, growth, time_row
from sdftrack.reproduce.measures.identity import WAYS, run_way
from sdftrack.reproduce.measures.judged import HEAD, Measured, cells, judge, measure, total
from sdftrack.evaluation.tracked_scene import arguments, load_sdf, settings_of, write_rows
from sdftrack.reproduce.scenes.staged import Scene
from sdftrack.evaluation.tables import text_table

__all__ = ["CASES", "main"]

MESHES = ("lm_driller", "lm_cat", "spot", "lm_duck")
CASES = ("meetings", "hands", "push", "hidden", "row", "approach", "still", "k1")
FRAMES = {"hands": 1000, "push": 400, "row": 40, "approach": 220, "still": 200, "k1": 251}
FIND_WITHIN, TRIALS = 10, 50


def noise_of(text: str | None, sigma: float) -> Any:
    """Noise by name: "kinect", or a number of millimetres as in "1mm"; None: `sigma` metres."""
    if text is None or text == "kinect":
        return sigma if text is None else text
    if not text.endswith("mm"):
        raise ValueError(f'--noise: expected "kinect" or millimetres as in "1mm", got {text!r}')
    return 1e-3 * float(text[:-2])


def solid_of(name: str, a: argparse.Namespace) -> tuple[Any, Solid]:
    """The mesh of that name and the solid that it bounds."""
    import sdftrack as st

    mesh = st.Mesh.load(a.meshes / f"{name}.ply")
    return mesh, Solid.of(mesh, load_sdf(mesh, name, a.voxels, a.cache))


def rendering(a: argparse.Namespace) -> dict[str, Any]:
    """What all scenes are rendered with."""
    noise = noise_of(a.noise, a.sigma)
    return {"noise": noise, "color": "rgbd" in a.mode, "threads": a.threads, "cache": a.cache}


def made(case: str, name: str, a: argparse.Namespace) -> Iterator[Scene]:
    """The scenes of a case with one mesh."""
    mesh, solid = solid_of(name, a)
    more = rendering(a)
    frames = a.frames or FRAMES.get(case)
    for seed in range(a.seeds):
        if case == "meetings":
            yield scenes.meetings(mesh, solid, frames, seed, **more)
        elif case == "hands":
            from experiments.several.shuffle import hands

            yield hands(mesh, solid, frames or 1, seed, **more)
        elif case == "push":
            yield scenes.push(mesh, solid, frames or 1, seed, push_m=1e-3 * a.push_mm, **more)
        elif case == "approach":
            yield scenes.approach(mesh, solid, frames or 1, seed, **more)
        else:
            yield scenes.still_pair(mesh, solid, frames or 1, seed, **more)


def _run_scenes(a: argparse.Namespace) -> dict[str, Any]:
    """The cases that are judged frame by frame: a row for each mesh and way, and for all meshes together."""
    rows: dict[str, Any] = {}
    parts: dict[str, list[Measured]] = {}
    contacts = crossings = 0
    names = [n for n in a.only.split(",") if n]
    for name in names:
        own: dict[str, list[Measured]] = {}
        for scene in made(a.case, name, a):
            contacts, crossings = contacts + scene.contacts, crossings + scene.crossings
            for mode in a.mode.split(","):
                for way in a.ways.split(","):
                    found = measure(scene, run_way(scene, way, mode, settings_of(a)))
                    own.setdefault(f"{way}, {mode}", []).append(found)
        for key, found_all in own.items():
            rows[f"{name}, {key}"] = total(found_all)
            parts.setdefault(key, []).extend(found_all)
            print(
                f"# {'  '.join(cells(f'{name}, {key}', rows[f'{name}, {key}']))}", file=sys.stderr, flush=True
            )
    if len(names) > 1:
        rows |= {f"all, {key}": total(measured) for key, measured in parts.items()}
    title = f"{a.case}: {contacts} contacts, {crossings} crossings, noise {a.noise or f'{1e3 * a.sigma:g}mm'}"
    print(text_table(title, HEAD, [cells(name, row) for name, row in rows.items()]))
    return rows


def _run_hidden(a: argparse.Namespace) -> dict[str, Any]:
    """Trials, meshes in turn: whether object 0 is found when it comes out, and whether anything was swapped."""
    names = [n for n in a.only.split(",") if n]
    solids = {name: solid_of(name, a) for name in names}
    rows: dict[str, Any] = {}
    for seed in range(a.trials):
        mesh, solid = solids[names[seed % len(names)]]
        scene = scenes.hidden(mesh, solid, seed, a.frames or scenes.AFTER, **rendering(a))
        for mode in a.mode.split(","):
            for way in a.ways.split(","):
                tracked = run_way(scene, way, mode, settings_of(a))
                found, wrong = judge(scene, tracked, scenes.FIRST + scenes.AWAY, FIND_WITHIN)
                row = rows.setdefault(
                    f"{way}, {mode}", {"found": [], "swapped": [], "deepest_mm": 0.0, "ms": []}
                )
                row["found"].append(found)
                row["swapped"].append(wrong)
                measured = measure(scene, tracked)
                row["deepest_mm"] = max(row["deepest_mm"], 1e3 * float(measured.crowded.max()))
                row["ms"].append(1e3 * float(np.median(tracked.seconds[1:])))
    head = ["way", "trials", f"found <= {FIND_WITHIN}", "slowest", "swapped", "deepest mm", "ms"]
    table = [
        [
            name, str(a.trials), str(sum(f is not None for f in r["found"])),
            str(max((f for f in r["found"] if f is not None), default="-")), str(sum(r["swapped"])),
            f"{r['deepest_mm']:.2f}", f"{np.median(r['ms']):.2f}",
        ]
        for name, r in rows.items()
    ]  # fmt: skip
    print(text_table(f"hidden for {scenes.AWAY} frames beside the other one", head, table))
    return rows


def _run_row(a: argparse.Namespace) -> dict[str, Any]:
    """Time against the number of objects, for the first mesh."""
    name = a.only.split(",")[0]
    mesh, solid = solid_of(name, a)
    counts = [int(c) for c in a.counts.split(",")]
    frames, more = a.frames or FRAMES["row"], rendering(a)
    rows: dict[str, Any] = {}
    lines, table = [], []
    for mode in a.mode.split(","):
        for way in a.ways.split(","):
            own = []
            for count in counts:
                own.append(time_row(mesh, solid, count, way, mode, frames, settings_of(a), **more))
                rows[f"{way}, {mode}, {count}"] = own[-1]
                table.append([*cells(f"{way}, {mode}, {count} objects", own[-1]), str(own[-1]["pixels"])])
            fit = growth(counts, [r["ms_per_frame"] for r in own])
            rows[f"{way}, {mode}, fit"] = fit
            lines.append(f"{way}, {mode}: {fit_text(fit)}")
    print("\n".join([text_table(f"{name} side by side", [*HEAD, "pixels"], table), *lines]))
    return rows


def _parser() -> argparse.ArgumentParser:
    p = arguments("sdftrack.eval.several", __doc__, frames=0, seeds=1)
    p.add_argument("case", choices=CASES)
    p.add_argument("--ways", default="joint,single", help=f"of {', '.join(WAYS)}; comma separated")
    p.add_argument("--noise", help='"kinect", or millimetres as in "1mm" (default: --sigma)')
    p.add_argument("--trials", type=int, default=TRIALS, help="of the case hidden")
    p.add_argument("--counts", default=",".join(map(str, COUNTS)), help="numbers of objects of the case row")
    p.add_argument(
        "--push-mm", type=float, default=4.0, help="of the case push: how far the data lie in each other"
    )
    p.add_argument("--data", type=Path, help="folder of the sequence k1 (or its parent)")
    p.add_argument("--pictures", type=Path, help="of the case k1: where to write overlays")
    for action in p._actions:
        if action.dest == "meshes":  # the other commands need them, the recorded case does not
            action.required = False
        elif action.dest == "frames":
            action.help = "0: as many as the case is made for; of the case hidden: those after the board"
    p.set_defaults(mode="depth", only=None)
    return p


def main(given: Seq[str] | None = None) -> int:
    """Run a case and print its table."""
    p = _parser()
    a = p.parse_args(given)
    needed = "data" if a.case == "k1" else "meshes"
    if getattr(a, needed) is None:
        p.error(f"--{needed}: needed for the case {a.case}")
    if unknown := [w for w in a.ways.split(",") if w not in WAYS]:
        p.error(f"--ways: expected some of {', '.join(WAYS)}, got {unknown[0]!r}")
    if a.only is None:
        a.only = ",".join(MESHES if a.case in ("meetings", "push", "hidden") else MESHES[2:3])
    if a.case == "k1":
        from experiments.several.recorded_pair import run

        rows = run(
            a.data, a.frames or FRAMES["k1"], a.ways.split(","), a.mode.split(","), settings_of(a), a.pictures
        )
    else:
        rows = {"hidden": _run_hidden, "row": _run_row}.get(a.case, _run_scenes)(a)
    write_rows(a.json, a, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
