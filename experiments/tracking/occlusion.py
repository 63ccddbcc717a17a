# SPDX-License-Identifier: MIT
"""Tracking through a hand that holds the object, of another colour and of the object's own colours.

    python -m sdftrack.eval.occlusion --meshes DIR --cache DIR

300 frames at 5 mm and 1.5 deg per frame over a cluttered table, noise 1 mm. Within the first second a hand
closes around the object; from then on its fingers hide 60 % of what would be seen, in contact with the
surface. One row per mesh, colour of the hand and mode.
"""

from __future__ import annotations

from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack.evaluation.tracked_scene import (
    Run,
    arguments,
    load_sdf,
    settings_of,
    summary,
    track_scene,
    write_rows,
)
from sdftrack.evaluation.tables import text_table

__all__ = ["MAX_DEG", "MAX_MM", "MEAN_DEG", "MEAN_MM", "main", "scene"]

# Changing these numbers breaks comparisons with docs/results.md.
SHARE, GROW, COLORS = 0.6, 30, ("other", "similar")
MEAN_MM, MEAN_DEG, MAX_MM, MAX_DEG = 0.5, 0.5, 1.5, 1.5
HEAD = [
    "mesh, hand, mode",
    "hidden %",
    "mean mm",
    "max",
    "mean deg",
    "max",
    "lost",
    "weak",
    "astray",
    "ms",
    "kept",
]


def scene(
    mesh: Any,
    frames: int,
    seed: int,
    *,
    share: float = SHARE,
    grow: int = GROW,
    color: str = "other",
    sigma_m: float = 0.001,
    threads: int = 0,
    cache: Path | None = None,
) -> Any:
    """The sequence of one row and seed."""
    from sdftrack import synth

    held = None if share == 0 else synth.Grip(share, color, grow=grow)
    return synth.sequence(
        mesh, frames, noise=sigma_m, occluder=held, seed=seed, clutter=True, threads=threads, cache=cache
    )


def kept(row: dict[str, Any]) -> bool:
    """Whether a row is within what is asked for."""
    return bool(
        row["lost"] == 0
        and row["astray"] == 0
        and row["mean_mm"] <= MEAN_MM
        and row["mean_deg"] <= MEAN_DEG
        and row["max_mm"] <= MAX_MM
        and row["max_deg"] <= MAX_DEG
    )


def _cells(name: str, row: dict[str, Any]) -> list[str]:
    return [
        name, f"{row['hidden_percent']:.0f}", f"{row['mean_mm']:.3f}", f"{row['max_mm']:.2f}", f"{row['mean_deg']:.3f}",
        f"{row['max_deg']:.2f}", str(row["lost"]), str(row["weak"]), str(row["astray"]), f"{row['ms_per_frame']:.2f}",
        "yes" if row["kept"] else "no",
    ]  # fmt: skip


def main(given: Seq[str] | None = None) -> int:
    """Run the protocol and print the table."""
    import sdftrack as st

    p = arguments("sdftrack.eval.occlusion", __doc__, frames=300, seeds=1)
    p.add_argument("--share", type=float, default=SHARE, help="share of the visible object that is hidden")
    p.add_argument("--grow", type=int, default=GROW, help="frames in which the hand closes")
    p.add_argument("--color", default=",".join(COLORS), help="of the hand: other, similar, skin")
    a = p.parse_args(given)
    rows: dict[str, dict[str, Any]] = {}
    for name in [n for n in a.only.split(",") if n]:
        mesh = st.Mesh.load(a.meshes / f"{name}.ply")
        sdf = load_sdf(mesh, name, a.voxels, a.cache)
        for color in a.color.split(","):
            sequences = [
                scene(
                    mesh, a.frames, seed, share=a.share, grow=a.grow, color=color, sigma_m=a.sigma,
                    threads=a.threads, cache=a.cache,
                )
                for seed in range(a.seeds)
            ]  # fmt: skip
            hidden = 100 * float(np.mean([_hidden(s, mesh, a.threads) for s in sequences]))
            for mode in a.mode.split(","):
                runs: list[Run] = [track_scene(sdf, s, mode, settings_of(a)) for s in sequences]
                row = {**summary(runs), "hidden_percent": hidden}
                row["kept"] = kept(row)
                rows[f"{name}, {color}, {mode}"] = row
                print(text_table("", HEAD, [_cells(f"{name}, {color}, {mode}", row)]), flush=True)
    title = f"{a.frames} frames, noise {1e3 * a.sigma:g} mm, a hand that hides {100 * a.share:g} %, {a.seeds} seeds"
    print(text_table(title, HEAD, [_cells(name, row) for name, row in rows.items()]))
    write_rows(a.json, a, rows)
    return 0


def _hidden(seq: Any, mesh: Any, threads: int) -> float:
    """Share of the object that the hand hides in the last frame."""
    i = len(seq) - 1
    bare = mesh.raycast(seq.camera, seq.ground_truth[i][0], threads=threads)[0] > 0
    return 1 - np.count_nonzero(seq.masks(i)[0]) / np.count_nonzero(bare)


if __name__ == "__main__":
    raise SystemExit(main())
