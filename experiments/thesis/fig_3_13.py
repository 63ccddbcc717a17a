# SPDX-License-Identifier: MIT
"""Figure 3.13 and Table 3.1: intrinsics judged by the angles between three orthogonal planes.

Set-up: a cube of 200 mm is moved before a camera with a Kinect's noise (true intrinsics 575 575 319.5 239.5), start
600 600 300 200 as printed, 500 frames. Then corners of a room, ten poses with the same noise, are back-projected with
what was found. The thesis used a real Kinect and one corner; truth, object and corners are ours. Overall error: the
sum of the three angles' distances from 90 degrees. Printed: 2.10 by the thesis, 5.10 by a checkerboard, 2.75 by the
toolbox of Herrera et al., 7.81 with the start values.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.room import corner
from experiments.thesis import Context
from experiments.thesis.fig_3_12 import FIRST_GUESS, calibration_object
from experiments.thesis.scenes.sweeps import TRUTH, swept
from sdftrack.camera import Camera
from sdftrack.evaluation.tables import text_table
from sdftrack.imaging.plane import three_planes

__all__ = ["run"]

FRAMES, SEED, CORNERS = 500, 0, 10
TARGET_DEG = 0.5
PRINTED = (
    ("printed: thesis", (90.18, 91.61, 89.69), 2.10),
    ("printed: Zhang", (90.87, 92.19, 87.96), 5.10),
    ("printed: Herrera et al.", (91.61, 89.22, 90.35), 2.75),
    ("printed: start values", (88.40, 87.96, 94.18), 7.81),
)
HEAD = ["method", "angle 1", "angle 2", "angle 3", "overall", "mean of corners", "worst", "kept"]
SLAB_M = 0.03  # measurements nearer than this to a plane are drawn as its own
Array = NDArray[np.float64]


def run(context: Context) -> dict[str, Any]:
    """Make the table: figure.png, table.txt, and the numbers."""
    from sdftrack._internal.files import write_text

    found = _calibrated(context)
    fx, fy, cx, cy = map(float, found.per_frame.fused)
    cameras = {
        "joint solution": found.camera,
        "mean of the frames": dataclasses.replace(FIRST_GUESS, fx=fx, fy=fy, cx=cx, cy=cy),
        "start values": FIRST_GUESS,
        "true intrinsics": TRUTH,
    }
    corners = list(corner(CORNERS, "kinect", SEED, camera=TRUTH))
    levels = [_judged(name, camera, corners) for name, camera in cameras.items()]
    cells = [_cells(level) for level in levels]
    cells += [
        [name, *(f"{x:.2f}" for x in angles), f"{total:.2f}", "-", "-", "-"]
        for name, angles, total in PRINTED
    ]
    values = ", ".join(f"{n} {v:.2f}" for n, v in zip(found.free, found.values, strict=True))
    n = len(found.frames) + len(found.left_out)
    title = f"Table 3.1, {n} frames, a Kinect's noise: {values}; angles of the first of {CORNERS} corners, degrees"
    write_text(context.out / "table.txt", text_table(title, HEAD, cells) + "\n")
    _plot(context.out / "figure.png", corners[0], levels, cameras)
    return {
        "title": title, "head": HEAD, "rows": cells, "levels": levels, "values": found.values.tolist(),
        "sd": found.sd.tolist(), "left_out": len(found.left_out), "status": found.status,
    }  # fmt: skip


def _calibrated(context: Context) -> Any:
    import sdftrack as st

    mesh, sdf, _ = calibration_object(context)
    n = FRAMES if context.frames is None else context.frames
    threads = int(context.options.get("threads", 0))
    seq = swept(mesh, n, "kinect", SEED, threads=threads)
    return st.calibrate_intrinsics(
        seq, sdf, FIRST_GUESS, seq.ground_truth[0][0],
        progress=lambda i: context.step(i, n, "calibrate"), threads=threads,
    )  # fmt: skip


def _judged(name: str, camera: Camera, corners: Any) -> dict[str, Any]:
    """Angles in all corners, degrees; three planes at right angles have 90 each."""
    import sdftrack as st

    angles = np.array([st.metrics.plane_angles(corners[i], camera) for i in range(len(corners))])
    total = np.abs(angles - 90).sum(axis=1)
    return {
        "method": name,
        "angles_deg": angles[0].tolist(),
        "overall_deg": float(total[0]),
        "mean_deg": float(total.mean()),
        "worst_deg": float(total.max()),
        "kept": bool(total.max() <= TARGET_DEG) if name not in ("start values", "true intrinsics") else None,
    }


def _cells(level: dict[str, Any]) -> list[str]:
    kept = level["kept"]
    return [
        level["method"], *(f"{x:.3f}" for x in level["angles_deg"]), f"{level['overall_deg']:.3f}",
        f"{level['mean_deg']:.3f}", f"{level['worst_deg']:.3f}", "-" if kept is None else "yes" if kept else "no",
    ]  # fmt: skip


def _along_edge(frame: Any, camera: Camera) -> tuple[Array, NDArray[np.int64], float]:
    """Points of two planes seen along the line where they meet (cm, first plane to the right), whose, and the angle."""
    n, d = three_planes(frame, camera, 0.01)
    points = camera.back_project(frame.depth)[frame.depth > 0][::23]
    off = points @ n.T + d
    own = np.abs(off).argmin(axis=1)
    keep = (np.abs(off).min(axis=1) < SLAB_M) & (own < 2)
    edge = np.cross(n[0], n[1])
    edge /= np.linalg.norm(edge)
    along = np.cross(edge, n[0])  # in the first plane, across the edge
    along *= np.sign(along @ n[1])
    corner = np.linalg.solve(n, -d)
    seen = (points[keep] - corner) @ np.column_stack([along, n[0]])
    angle = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(n[0], n[1])), -(n[0] @ n[1]))))
    return 100 * seen, own[keep], angle


def _plot(path: Path, frame: Any, levels: list[dict[str, Any]], cameras: dict[str, Camera]) -> None:
    from sdftrack.viz.plots import COLORS, figure, save_figure

    fig, axes = figure(1, 4, size=(14.0, 3.8), width_ratios=(1.2, 1, 1, 1.3))
    n, d = three_planes(frame, TRUTH, 0.01)
    z = frame.depth
    which = np.abs(TRUTH.back_project(z) @ n.T + d).argmin(axis=-1)
    tints = np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in COLORS[:3]]) / 255.0
    near = np.clip(1.25 - 0.45 * z / np.median(z[z > 0]), 0.3, 1)[..., None]
    axes[0].imshow(np.where(z[..., None] > 0, tints[which] * near, 1.0))
    axes[0].set_title("depth of a corner, its three planes", fontsize=9)
    axes[0].set_axis_off()
    for ax, name in zip(axes[1:3], ("start values", "joint solution"), strict=True):
        seen, own, angle = _along_edge(frame, cameras[name])
        ax.scatter(*seen.T, s=1, c=[COLORS[k] for k in own], linewidths=0)
        ax.plot([0, 0], [0, seen[:, 1].max()], color="#222222", linestyle="--", linewidth=1)
        ax.set_aspect("equal")
        ax.set_title(f"{name}: {angle:.2f} deg along an edge", fontsize=9)
        ax.set_xlabel("cm")
    ours = [(f"{r['method']}, here", r["overall_deg"]) for r in levels]
    bars = ours + [(name, total) for name, _, total in PRINTED]
    colors = [COLORS[0]] * len(ours) + [COLORS[1]] * len(PRINTED)
    axes[3].barh([b[0] for b in bars][::-1], [b[1] for b in bars][::-1], color=colors[::-1])
    for k, (_, total) in enumerate(bars[::-1]):
        axes[3].text(total, k, f" {total:.2f}", va="center", fontsize=8)
    axes[3].set_title("sum of |angle - 90|, deg", fontsize=9)
    axes[3].tick_params(axis="y", labelsize=8)
    axes[3].margins(x=0.15)
    save_figure(fig, path)
