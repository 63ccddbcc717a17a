# SPDX-License-Identifier: MIT
"""Fast motion: how far an object may move from frame to frame.

    python -m sdftrack.eval.motion --meshes DIR --cache DIR

By default 30 mm and 10 deg per frame over a cluttered table, noise 1 mm. One row per mesh, mode and motion
model; "lost" counts frames that the tracker calls lost, "astray" those farther than 20 mm or 10 deg off.
"""

from __future__ import annotations

from collections.abc import Sequence as Seq
from typing import Any

import numpy as np

from sdftrack.evaluation.tracked_scene import arguments, load_sdf, settings_of, summary, track_scene, write_rows
from sdftrack.evaluation.tables import text_table

__all__ = ["main"]

STEP_MM, STEP_DEG = 30.0, 10.0
HEAD = ["mesh, mode, motion model", "mean mm", "max", "mean deg", "max", "lost", "weak", "astray", "ms"]


def _cells(name: str, row: dict[str, Any]) -> list[str]:
    return [
        name, f"{row['mean_mm']:.3f}", f"{row['max_mm']:.2f}", f"{row['mean_deg']:.3f}", f"{row['max_deg']:.2f}",
        str(row["lost"]), str(row["weak"]), str(row["astray"]), f"{row['ms_per_frame']:.2f}",
    ]  # fmt: skip


def main(given: Seq[str] | None = None) -> int:
    """Run the protocol and print the table."""
    import sdftrack as st

    p = arguments("sdftrack.eval.motion", __doc__, frames=300, seeds=1)
    p.add_argument("--step-mm", type=float, default=STEP_MM)
    p.add_argument("--step-deg", type=float, default=STEP_DEG)
    p.add_argument("--motion", default="static,constant_velocity", help="motion models, comma separated")
    a = p.parse_args(given)
    walk = st.synth.random_walk(step_m=1e-3 * a.step_mm, step_rad=float(np.deg2rad(a.step_deg)))
    rows: dict[str, dict[str, Any]] = {}
    for name in [n for n in a.only.split(",") if n]:
        mesh = st.Mesh.load(a.meshes / f"{name}.ply")
        sdf = load_sdf(mesh, name, a.voxels, a.cache)
        sequences = [
            st.synth.sequence(
                mesh, a.frames, walk, a.sigma, seed=seed, clutter=True, threads=a.threads, cache=a.cache
            )
            for seed in range(a.seeds)
        ]
        for mode in a.mode.split(","):
            for motion in a.motion.split(","):
                options = {"motion": motion, **settings_of(a)}
                row = summary([track_scene(sdf, s, mode, options) for s in sequences])
                rows[f"{name}, {mode}, {motion}"] = row
    title = (
        f"{a.frames} frames, {a.step_mm:g} mm and {a.step_deg:g} deg per frame, noise {1e3 * a.sigma:g} mm"
    )
    print(text_table(f"{title}, {a.seeds} seeds", HEAD, [_cells(name, row) for name, row in rows.items()]))
    write_rows(a.json, a, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
