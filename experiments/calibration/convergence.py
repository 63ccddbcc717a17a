# SPDX-License-Identifier: MIT
"""Figures 3.12 and 3.13: intrinsics of a depth camera while a known object is moved, and how they are judged."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.bodies import VOXELS, Body, body
from experiments.common.samples import evenly, sample_frames
from experiments.common.sweeps import TRUTH, box_mesh, swept, values_of
from experiments.pictures import COLORS, Line, Panel, curves
from experiments.planes.planes import angle_errors
from experiments.progress import step
from experiments.registry import experiment
from experiments.synth.room import corner
from experiments.table import Table
from sdftrack.camera import Camera
from sdftrack.imaging.plane import three_planes

SIGMAS_M = (0.0, 0.001, 0.002, float(np.sqrt(10.0)) * 1e-3)
FIRST_GUESS = Camera(600.0, 600.0, 300.0, 200.0, 640, 480)  # of the thesis' real experiment (Table 3.1)
PARTS = (25, 50, 100, 200)  # frames after which the joint solution is looked at, beside all of them
NAMES = ("fx", "fy", "cx", "cy")
WITHIN = np.array([0.01 * TRUTH.fx, 0.01 * TRUTH.fy, 2.0, 2.0])  # printed, px
BEFORE = 200  # frames
RATIO_WITHIN = 0.01  # of fx / fy, "still right"
AT_1_MM, HIGHER = "1 %, 2 px before frame 200", "fx/fy right, cx cy worse, fx fy low"
ANGLES = tuple(f"angle_{k}" for k in (1, 2, 3))
TABLE_3_1 = {
    "printed: thesis": (90.18, 91.61, 89.69, 2.10),
    "printed: Zhang": (90.87, 92.19, 87.96, 5.10),
    "printed: Herrera et al.": (91.61, 89.22, 90.35, 2.75),
    "printed: start values": (88.40, 87.96, 94.18, 7.81),
}
CORNERS, TARGET_DEG = 10, 0.5
SHOWN_M = 0.25  # around the object
Array = NDArray[np.float64]


@experiment("thesis.3.11", chosen_on="nothing was chosen here", reported_on="a cube of 200 mm, path 0")
def calibration_object(*, mesh: Path | None = None, unit: str | None = None) -> Table:
    """Figure 3.11: the calibration object of Figures 3.12 and 3.13 and sample frames of its path.

    Six of 300 frames with a Kinect's noise. Printed: pictures of a recording with another object.

    Parameters
    ----------
    mesh
        instead of the cube
    unit
        of the mesh
    """
    it, _ = _object(mesh, unit)
    seq = swept(it.mesh, 300, "kinect", 0)
    return sample_frames(f"Figure 3.11, {it.name} and six of 300 frames", seq, evenly(300), SHOWN_M)


@experiment(
    "thesis.3.12",
    chosen_on="nothing was chosen here",
    reported_on="a cube of 200 mm, path and noise 0",
    short={"frames": BEFORE},
)
def convergence(
    *, frames: int = 300, mesh: Path | None = None, unit: str | None = None, threads: int = 0
) -> Table:
    """Figure 3.12: intrinsics over the number of frames of a known object, four noise levels.

    A cube swept once through the whole image, 0.5 to 1.2 m away, true intrinsics 575 575 319.5 239.5, start 600 600 300
    200 and the true first pose; object, frames, intrinsics and start are ours. "fused" is the thesis' information-
    weighted mean of the frames' own estimates (Eq. 3.23), by the depth at which rays meet the model; "as printed" by
    phi at the measured points (Eq. 3.11). Marks: the joint solution over the first frames. Printed: at 1 mm fx and fy
    within 1 %, cx and cy within 2 px from less than 200 frames; in higher noise fx / fy is still right (to 1 %), the
    principal point is worse, fx and fy are too low: judged of "as printed", whose fault it is.

    Parameters
    ----------
    mesh
        instead of the cube
    unit
        of the mesh
    """
    it, sdf = _object(mesh, unit)
    levels = [_level(it.mesh, sdf, sigma, frames, threads) for sigma in SIGMAS_M]
    columns = {"sigma mm, way": "case", **{name: f"{name}:.2f" for name in NAMES}, "fx/fy": "ratio:.4f"}
    columns |= {"within from, at most": "start", "status": "status", "printed": "printed", "kept": "kept"}
    return Table.of(
        f"Figure 3.12, {frames} frames of {it.name}, truth 575 575 319.5 239.5, start 600 600 300 200",
        columns,
        [row for level in levels for row in _rows(level, levels)],
        numbers=levels,
        picture=lambda: _curves(levels),
    )


def _object(mesh: Path | None, unit: str | None) -> tuple[Body, Any]:
    """The cube, or the mesh that the user names; and its volume."""
    if mesh is None:
        return Body(box_mesh(), "a cube of 200 mm"), st.SDF.box((0.2, 0.2, 0.2), voxels=VOXELS)
    it = body(mesh, unit)
    return it, it.sdf()


def _level(mesh: Any, sdf: Any, sigma: float, n: int, threads: int) -> dict[str, Any]:
    """One noise level: all frames, then the first ones for the marks."""
    seq = swept(mesh, n, sigma, 0, threads=threads)
    frames, pose = [seq[i] for i in range(n)], seq.ground_truth[0][0]
    label = f"sigma {1e3 * sigma:.2f} mm"

    def calibrated(part: int, **more: Any) -> Any:
        return st.calibrate_intrinsics(frames[:part], sdf, FIRST_GUESS, pose, threads=threads, **more)

    found = calibrated(n, progress=lambda i: step(i, n, label))
    running = found.per_frame.running()
    printed = calibrated(n, joint=False, residual="point").per_frame.running()
    joint = {n: found.values.tolist()}
    for part in (p for p in PARTS if p < n):
        try:
            joint[part] = calibrated(part).values.tolist()
        except ValueError:
            continue  # too little seen by then: no mark
    return {
        "sigma_m": float(sigma),
        "running": running.tolist(),
        "printed": printed.tolist(),
        "printed_within_from": within_from(printed, n),
        "joint": dict(sorted(joint.items())),
        "fused": running[-1].tolist(),
        "sd": found.sd.tolist(),
        "within_from": within_from(running, n),
        "left_out": len(found.left_out),
        "status": found.status,
        "seconds": found.seconds,
    }


def within_from(running: Array, frames: int) -> int | None:
    """Frames from which on the mean stays within 1 % and 2 px, at most; None: it is not even at the end.

    Frames without an optimum of their own are not in the mean; all of them are counted as if they had come before.
    """
    off = np.flatnonzero((np.abs(running - values_of(TRUTH)) > WITHIN).any(axis=1))
    first = int(off[-1]) + 2 if len(off) else 1
    return first + frames - len(running) if first <= len(running) else None


def _rows(level: dict[str, Any], levels: list[dict[str, Any]]) -> list[dict[str, Any]]:
    sigma, rows = level["sigma_m"], []
    for way, key in (("fused", ""), ("fused, as printed", "printed_"), ("joint", None)):
        values = level["joint"][max(level["joint"])] if key is None else level[key[:-1] or "running"][-1]
        row = {"case": f"{1e3 * sigma:.2f}, {way}", **dict(zip(NAMES, values, strict=True))}
        row |= {"ratio": values[0] / values[1], "status": level["status"]}
        if key is not None:
            start = level[f"{key}within_from"]
            row |= {"start": str(start or "never")}
            if sigma == SIGMAS_M[1]:
                row |= {"printed": AT_1_MM, "kept": start is not None and start < BEFORE}
            elif sigma > SIGMAS_M[1] and key:
                row |= {"printed": HIGHER, "kept": _biased(values, levels[1]["printed"][-1])}
        rows.append(row)
    return rows


def _biased(values: list[float], at_1_mm: list[float]) -> bool:
    """Whether intrinsics are off as the thesis says of higher noise."""
    off, less = np.array(values) - values_of(TRUTH), np.array(at_1_mm) - values_of(TRUTH)
    worse = np.linalg.norm(off[2:]) > np.linalg.norm(less[2:])
    return bool(worse and (off[:2] < 0).all() and abs(values[0] / values[1] - 1) < RATIO_WITHIN)


def _curves(levels: list[dict[str, Any]]) -> Any:
    panels = []
    for k, (name, true) in enumerate(zip(NAMES, values_of(TRUTH), strict=True)):
        lines = [Line(None, true, style={"color": "#222222", "linestyle": "--"})]
        lines += [Line(None, true + sign * WITHIN[k]) for sign in (-1, 1)]
        for level, color in zip(levels, COLORS, strict=False):
            for way, width in (("running", 1.3), ("printed", 0.6)):
                curve = np.array(level[way])[:, k]
                label = f"{1e3 * level['sigma_m']:.2f} mm" if way == "running" else ""
                lines.append(
                    Line(1 + np.arange(len(curve)), curve, label, {"color": color, "linewidth": width})
                )
            marks = [values[k] for values in level["joint"].values()]
            style = {"color": color, "marker": "o", "linestyle": "", "markersize": 4}
            lines.append(Line(list(level["joint"]), marks, style=style))
        axes = {"title": f"{name} (px)", "ylim": (true - 1.5 * WITHIN[k], true + 1.5 * WITHIN[k])}
        legend = {"ncols": 2, "title": "lines: fused (thin: as printed); dots: joint; dotted: 1 %, 2 px"}
        panels.append(Panel(lines, {**axes, "xlabel": "frames"}, legend if k == 0 else None))
    return curves([panels[:2], panels[2:]], (11.0, 6.5), sharex=True)


@experiment(
    "thesis.3.13",
    chosen_on="nothing was chosen here",
    reported_on="a cube of 200 mm, path and noise 0; ten corners",
    short={"frames": 60},
)
def judged_by_planes(
    *, frames: int = 500, mesh: Path | None = None, unit: str | None = None, threads: int = 0
) -> Table:
    """Figure 3.13 and Table 3.1: intrinsics judged by the angles between three orthogonal planes.

    The cube is moved before a camera with a Kinect's noise (true intrinsics 575 575 319.5 239.5), start 600 600 300 200
    as printed. Then corners of a room, ten poses with the same noise, are back-projected with what was found. The
    thesis used a real Kinect and one corner; truth, object and corners are ours. Overall error: the sum of the three
    angles' distances from 90 degrees. Printed: 2.10 by the thesis, 5.10 by a checkerboard, 2.75 by the toolbox of
    Herrera et al., 7.81 with the start values.

    Parameters
    ----------
    mesh
        instead of the cube
    unit
        of the mesh
    """
    it, sdf = _object(mesh, unit)
    seq = swept(it.mesh, frames, "kinect", 0, threads=threads)
    found = st.calibrate_intrinsics(
        seq,
        sdf,
        FIRST_GUESS,
        seq.ground_truth[0][0],
        progress=lambda i: step(i, frames, "calibrate"),
        threads=threads,
    )
    fx, fy, cx, cy = map(float, found.per_frame.fused)
    cameras = {
        "joint solution": found.camera,
        "mean of the frames": dataclasses.replace(FIRST_GUESS, fx=fx, fy=fy, cx=cx, cy=cy),
        "start values": FIRST_GUESS,
        "true intrinsics": TRUTH,
    }
    corners = list(corner(CORNERS, "kinect", 0, camera=TRUTH))
    rows = [_judged(name, camera, corners) for name, camera in cameras.items()]
    rows += [
        {"method": name, **dict(zip((*ANGLES, "overall"), printed, strict=True))}
        for name, printed in TABLE_3_1.items()
    ]
    values = ", ".join(f"{n} {v:.2f}" for n, v in zip(found.free, found.values, strict=True))
    columns = {
        name.replace("_", " "): f"{name}:.3f" for name in (*ANGLES, "overall", "mean_of_corners", "worst")
    }
    return Table.of(
        f"Table 3.1, {frames} frames, a Kinect's noise: {values}; angles of the first of {CORNERS} corners, degrees",
        {"method": "method", **columns, "kept": "kept"},
        rows,
        picture=lambda: _planes_picture(corners[0], rows, cameras),
    )


def _judged(name: str, camera: Camera, corners: list[Any]) -> dict[str, Any]:
    """Angles in all corners, degrees; three planes at right angles have 90 each."""
    off = angle_errors(corners, camera)
    total = np.abs(off).sum(axis=1)
    row = {
        "method": name,
        **dict(zip(ANGLES, (90 + off[0]).tolist(), strict=True)),
        "overall": float(total[0]),
        "mean_of_corners": float(total.mean()),
        "worst": float(total.max()),
    }
    kept = None if name in ("start values", "true intrinsics") else bool(total.max() <= TARGET_DEG)
    return {**row, "kept": kept}


def _planes_picture(frame: Any, rows: list[dict[str, Any]], cameras: dict[str, Camera]) -> Any:
    """Two planes along the edge between them, with the start values and the result; a bar for each overall error."""
    panels = []
    for name in ("start values", "joint solution"):
        points, own, angle = _along_edge(frame, cameras[name])
        dots = {"marker": ".", "markersize": 1, "linestyle": ""}
        lines = [
            Line(points[own == k, 0], points[own == k, 1], style={**dots, "color": COLORS[k]})
            for k in range(2)
        ]
        upright = {"color": "#222222", "linestyle": "--"}
        lines.append(Line([0, 0], [0, points[:, 1].max()], style=upright))
        title = f"{name}: {angle:.2f} deg along an edge"
        panels.append(Panel(lines, {"title": title, "xlabel": "cm", "aspect": "equal"}))
    fig = curves([[*panels, Panel([], {"title": "sum of |angle - 90|, deg"})]], (13.0, 3.8))
    ax, names, totals = fig.axes[2], [r["method"] for r in rows][::-1], [r["overall"] for r in rows][::-1]
    bars = ax.barh(names, totals, color=[COLORS["printed" in name] for name in names])
    ax.bar_label(bars, fmt=" %.2f", fontsize=8)
    ax.tick_params(axis="y", labelsize=8)
    return fig


def _along_edge(frame: Any, camera: Camera) -> tuple[Array, NDArray[np.int64], float]:
    """Points of two planes seen along the line where they meet (cm, first plane to the right), whose, and the angle."""
    n, d = three_planes(frame, camera, 0.01)
    points = camera.back_project(frame.depth)[frame.depth > 0][::23]
    off = points @ n.T + d
    own = np.abs(off).argmin(axis=1)
    keep = (np.abs(off).min(axis=1) < 0.03) & (own < 2)
    edge = np.cross(n[0], n[1])
    edge /= np.linalg.norm(edge)
    along = np.cross(edge, n[0])  # in the first plane, across the edge
    along *= np.sign(along @ n[1])
    corner = np.linalg.solve(n, -d)
    seen = (points[keep] - corner) @ np.column_stack([along, n[0]])
    angle = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(n[0], n[1])), -(n[0] @ n[1]))))
    return 100 * seen, own[keep], angle
