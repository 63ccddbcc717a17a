# SPDX-License-Identifier: MIT
"""Figure 4.13, run (b): an unknown object tracked and reconstructed, from a ball; run (a), the known one, beside it.

Set-up: the scene of 4.13a, 300 frames, sigma 0 and 1 mm, the true mask in the first frame alone. "as printed" is the
source's evolution and tracker (``evolution="printed"``, Eqs. 4.18 and 4.29 to 4.42), sigma_d of 8 voxels. Errors are
relative to the first frame. Printed: at most 3 mm and 6 degrees.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.tracked_scene import track_scene
from experiments.thesis import Context
from experiments.thesis.curves import rotation_vectors
from experiments.thesis.growing import VOXELS, Scene, reconstructor, scene_of
from experiments.thesis.measures.rebuilt import Errors, rebuild, relative_errors
from sdftrack.evaluation.tables import text_table

__all__ = ["run"]

SIGMAS_M = (0.0, 0.001)
WAYS = {"from a ball": None, "as printed": 8.0}
KNOWN = "known model"
PRINTED = {KNOWN: (2.0, 1.0), **dict.fromkeys(WAYS, (3.0, 6.0))}
HEAD = ["sigma_mm", "way", "mean_mm", "max_mm", "mean_deg", "max_deg", "not_ok", "ms", "printed", "kept"]
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    scene = scene_of(context)
    n = len(scene.poses)
    rows: list[dict[str, Any]] = []
    errors: dict[tuple[float, str], Errors] = {}
    with tempfile.TemporaryDirectory() as cache:
        for sigma in SIGMAS_M:
            seq = scene.frames(sigma, cache)
            for way, voxels in WAYS.items():
                label = f"{way}, sigma {1e3 * sigma:.2f} mm"
                live = rebuild(reconstructor(scene, seq, voxels), seq, None, n, _teller(context, n, label))
                errors[sigma, way] = relative_errors(live.poses, scene.poses, scene.middle)
                rows.append(_row(sigma, way, errors[sigma, way], live.status, live.seconds))
            errors[sigma, KNOWN], more = _known(scene, seq, context)
            rows.append(_row(sigma, KNOWN, errors[sigma, KNOWN], *more))
    cells = [r.pop("cells") for r in rows]
    title = f"Figure 4.13 (b), {n} frames of {scene.name}, {VOXELS} voxels"
    write_text(context.out / "table.txt", text_table(title, HEAD, cells) + "\n")
    _plot(context.out / "figure.png", scene.poses, errors)
    return {"title": title, "head": HEAD, "rows": cells, "levels": rows}


def _teller(context: Context, n: int, label: str) -> Callable[[int, Any], None]:
    return lambda i, result: context.step(i + 1, n, label)


def _known(scene: Scene, seq: Any, context: Context) -> tuple[Errors, tuple[list[str], Any]]:
    """Run (a) on the same frames."""
    import sdftrack as st

    sdf = st.SDF.from_mesh(scene.mesh, voxels=VOXELS, unit="m")
    tracked = track_scene(sdf, seq, "auto", context.options)
    found = Errors(tracked.errors.translation_m, tracked.errors.rotation_rad)
    return found, (tracked.status, np.array(tracked.seconds))


def _row(sigma: float, way: str, errors: Errors, status: list[str], seconds: Array) -> dict[str, Any]:
    mm, deg = 1e3 * errors.metres, np.rad2deg(errors.radians)
    limit_mm, limit_deg = PRINTED[way]
    row = {
        "sigma_m": sigma, "way": way, "mean_mm": float(mm.mean()), "max_mm": float(mm.max()),
        "mean_deg": float(deg.mean()), "max_deg": float(deg.max()), "not_ok": sum(s != "ok" for s in status),
        "ms": 1e3 * float(np.median(seconds[1:])), "printed": f"{limit_mm:g} mm, {limit_deg:g} deg",
        "kept": bool(mm.max() <= limit_mm and deg.max() <= limit_deg),
    }  # fmt: skip
    numbers = (f"{row[k]:.3f}" for k in ("mean_mm", "max_mm", "mean_deg", "max_deg"))
    row["cells"] = [
        f"{1e3 * sigma:.2f}", way, *numbers, str(row["not_ok"]), f"{row['ms']:.1f}", row["printed"],
        "yes" if row["kept"] else "no",
    ]  # fmt: skip
    return row


def _plot(path: Any, poses: Array, errors: dict[tuple[float, str], Errors]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, axes = figure(2, 1 + len(SIGMAS_M), size=(15.0, 6.5), sharex=True)
    frames = np.arange(len(poses))
    turn = np.rad2deg(rotation_vectors(poses))
    for j in range(3):
        style = {"color": COLORS[j], "linewidth": 1.2}
        axes[0, 0].plot(frames, 1e3 * (poses[:, j, 3] - poses[0, j, 3]), label=f"t{'xyz'[j]}", **style)
        axes[1, 0].plot(frames, turn[:, j], label=f"r{'xyz'[j]}", **style)
    axes[0, 0].set(ylabel="true translation (mm)", title="truth, from the first frame")
    axes[1, 0].set_ylabel("true rotation (deg)")
    for k, sigma in enumerate(SIGMAS_M, start=1):
        for way, limits in PRINTED.items():
            e = errors[sigma, way]
            for ax, values in ((axes[0, k], 1e3 * e.metres), (axes[1, k], np.rad2deg(e.radians))):
                ax.plot(frames, values, label=way, linewidth=1)
            if way in WAYS:
                for ax, limit in zip(axes[:, k], limits, strict=True):
                    ax.axhline(limit, color="0.6", linestyle=":", linewidth=0.9)
                    ax.set_ylim(0, 1.5 * limit)  # a run that is lost leaves the picture
        axes[0, k].set(ylabel="translation error (mm)", title=f"sigma {1e3 * sigma:g} mm; dotted: printed")
        axes[1, k].set_ylabel("rotation error (deg)")
    for a in axes.ravel():
        a.legend(fontsize=8, ncols=3)
    for a in axes[1]:
        a.set_xlabel("frame")
    save_figure(fig, path)
