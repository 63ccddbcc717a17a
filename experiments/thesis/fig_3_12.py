# SPDX-License-Identifier: MIT
"""Figure 3.12: intrinsics of a depth camera while a known object is moved, four levels of Gaussian noise on Z.

Set-up: a cube of 200 mm swept once through the whole image, 0.5 to 1.2 m away, 300 frames, 640 x 480, true intrinsics
575 575 319.5 239.5, start 600 600 300 200 and the true first pose. Object, frames, intrinsics and start are not printed
in the thesis; these are ours. Curves: the thesis' information-weighted mean of the frames' own estimates (Eq. 3.23),
by the depth at which rays meet the model; thin: by phi at the measured points, as printed (Eq. 3.11). Marks: the joint
solution over the first frames. Printed: at 1 mm fx and fy within 1 %, cx and cy within 2 px from less
than 200 frames; in higher noise fx / fy is still right, the principal point is worse, fx and fy are too low.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.scenes.sweeps import TRUTH, box_mesh, swept, values_of
from sdftrack.camera import Camera
from sdftrack.evaluation.tables import text_table

__all__ = ["FIRST_GUESS", "calibration_object", "run"]

SIGMAS_M = (0.0, 0.001, 0.002, np.sqrt(10.0) * 1e-3)
FRAMES, SEED, VOXELS = 300, 0, 200
FIRST_GUESS = Camera(600.0, 600.0, 300.0, 200.0, 640, 480)  # of the thesis' real experiment (Table 3.1)
PARTS = (25, 50, 100, 200)  # frames after which the joint solution is looked at, beside all of them
WITHIN = np.array([0.01 * TRUTH.fx, 0.01 * TRUTH.fy, 2.0, 2.0])  # printed, px
BEFORE = 200  # frames
PRINTED = {0.001: "1 %, 2 px before frame 200", 0.0: "-"}
HIGHER = "fx/fy right, cx cy worse, fx fy low"
HEAD = ["sigma mm, way", "fx", "fy", "cx", "cy", "fx/fy", "within from, at most", "status", "printed", "kept"]
NAMES = ("fx", "fy", "cx", "cy")
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make the figure: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    mesh, sdf, name = calibration_object(context)
    n = FRAMES if context.frames is None else context.frames
    levels = [_level(mesh, sdf, sigma, n, context) for sigma in SIGMAS_M]
    rows = [cells for level in levels for cells in _cells(level)]
    title = f"Figure 3.12, {n} frames of {name}, truth 575 575 319.5 239.5, start 600 600 300 200"
    write_text(context.out / "table.txt", text_table(title, HEAD, rows) + "\n")
    _plot(context.out / "figure.png", levels)
    return {"title": title, "head": HEAD, "rows": rows, "levels": levels}


def calibration_object(context: Context) -> tuple[Any, Any, str]:
    """Mesh, volume and name: the cube, or the mesh that the user names."""
    import sdftrack as st

    if context.mesh is None:
        return box_mesh(), st.SDF.box((0.2, 0.2, 0.2), voxels=VOXELS), "a cube of 200 mm"
    mesh = st.Mesh.load(context.mesh, context.unit)
    sdf = st.SDF.from_mesh(mesh, voxels=VOXELS, unit="m" if context.unit == "m" else None)
    return mesh, sdf, context.mesh.name


def _level(mesh: Any, sdf: Any, sigma: float, n: int, context: Context) -> dict[str, Any]:
    """One noise level: all frames, then the first ones for the marks."""
    import sdftrack as st

    threads = int(context.options.get("threads", 0))
    seq = swept(mesh, n, sigma, SEED, threads=threads)
    label = f"sigma {1e3 * sigma:.2f} mm"
    frames = [seq[i] for i in range(n)]
    found = st.calibrate_intrinsics(
        frames, sdf, FIRST_GUESS, seq.ground_truth[0][0],
        progress=lambda i: context.step(i, n, label), threads=threads,
    )  # fmt: skip
    running = found.per_frame.running()
    printed = st.calibrate_intrinsics(
        frames, sdf, FIRST_GUESS, seq.ground_truth[0][0], False, residual="point", threads=threads
    ).per_frame.running()  # fmt: skip
    joint = {n: found.values.tolist()}
    for part in (p for p in PARTS if p < n):
        try:
            early = st.calibrate_intrinsics(
                frames[:part], sdf, FIRST_GUESS, seq.ground_truth[0][0], threads=threads
            )
        except ValueError:
            continue  # too little seen by then: no mark
        joint[part] = early.values.tolist()
    return {
        "sigma_m": float(sigma),
        "running": running.tolist(),
        "printed": printed.tolist(),
        "printed_within_from": _within_from(printed, n),
        "joint": dict(sorted(joint.items())),
        "fused": running[-1].tolist(),
        "sd": found.sd.tolist(),
        "within_from": _within_from(running, n),
        "left_out": len(found.left_out),
        "status": found.status,
        "seconds": found.seconds,
    }


def _within_from(running: Array, frames: int) -> int | None:
    """Frames from which on the mean stays within 1 % and 2 px, at most; None: it is not even at the end.

    Frames without an optimum of their own are not in the mean; all of them are counted as if they had come before.
    """
    off = np.flatnonzero((np.abs(running - values_of(TRUTH)) > WITHIN).any(axis=1))
    first = int(off[-1]) + 2 if len(off) else 1
    return first + frames - len(running) if first <= len(running) else None


def _cells(level: dict[str, Any]) -> list[list[str]]:
    sigma, start = level["sigma_m"], level["within_from"]
    kept = "-" if sigma != 0.001 else "yes" if start is not None and start < BEFORE else "no"
    joint = level["joint"][max(level["joint"])]
    rows = []
    for way, values, within, printed, held in (
        ("fused", level["fused"], _text(start), PRINTED.get(sigma, HIGHER), kept),
        ("fused, as printed", level["printed"][-1], _text(level["printed_within_from"]), "-", "-"),
        ("joint", joint, "-", "-", "-"),
    ):
        rows.append(
            [
                f"{1e3 * sigma:.2f}, {way}", *(f"{x:.2f}" for x in values), f"{values[0] / values[1]:.4f}", within,
                level["status"], printed, held,
            ]
        )  # fmt: skip
    return rows


def _text(start: int | None) -> str:
    return "never" if start is None else str(start)


def _plot(path: Path, levels: Sequence[dict[str, Any]]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, axes = figure(2, 2, size=(11.0, 6.5), sharex=True)
    for k, (ax, name, true) in enumerate(zip(axes.flat, NAMES, values_of(TRUTH), strict=True)):
        for level, color in zip(levels, COLORS, strict=False):
            curve = np.array(level["running"])[:, k]
            label = f"{1e3 * level['sigma_m']:.2f} mm"
            ax.plot(1 + np.arange(len(curve)), curve, color=color, linewidth=1.3, label=label)
            as_printed = np.array(level["printed"])[:, k]
            ax.plot(1 + np.arange(len(as_printed)), as_printed, color=color, linewidth=0.6)
            at = np.array(list(level["joint"]))
            ax.plot(at, [level["joint"][i][k] for i in at], "o", color=color, markersize=4)
        ax.axhline(true, color="#222222", linestyle="--", linewidth=1)
        for sign in (-1, 1):
            ax.axhline(true + sign * WITHIN[k], color="#888888", linestyle=":", linewidth=1)
        ax.set_ylim(true - 1.5 * WITHIN[k], true + 1.5 * WITHIN[k])
        ax.set_title(f"{name} (px)", fontsize=10, loc="left")
    axes[0, 0].legend(
        fontsize=8,
        ncols=2,
        title="lines: fused (thin: as printed); dots: joint; dotted: 1 %, 2 px",
        title_fontsize=8,
    )
    for ax in axes[1]:
        ax.set_xlabel("frames (lines: those that have an optimum of their own)")
    save_figure(fig, path)
