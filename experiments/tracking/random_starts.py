# SPDX-License-Identifier: MIT
"""The three objects of the recorded set ycbv10, each started off its true pose many times."""

from __future__ import annotations

from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from experiments.common.bound import pose_information
from experiments.common.pose_errors import pose_errors, track_frames
from experiments.common.pose_sets import half_turns, off_pose
from experiments.common.protocol import say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table

Array = NDArray[np.float64]
START_OFF_M, START_OFF_RAD = 0.010, np.deg2rad(5.0)
YCB_NAMES = {1: "box", 2: "mug", 3: "brick"}
YCB_LIMIT_M = {1: 0.002, 2: 0.0025, 3: 0.002}
YCB_LIMIT_RAD = np.deg2rad(1.5)
MUG_TURN_LIMIT_RAD = np.deg2rad(2.0)
YCB_NOISE_M = 0.0009  # median |measured - rendered| of the set's own check, taken as one sigma


def cup_axis(vertices: Array) -> Array:
    """Axis (3,) of an upright cup: the coordinate direction whose end cuts are rings.

    The top 2 mm along each coordinate axis are fitted by a circle; the best relative fit wins.
    """
    scores = []
    for k in range(3):
        top = vertices[vertices[:, k] > vertices[:, k].max() - 0.002][:, [j for j in range(3) if j != k]]
        A = np.column_stack([2 * top, np.ones(len(top))])
        x, *_ = np.linalg.lstsq(A, (top**2).sum(axis=1), rcond=None)
        radius = np.sqrt(max(1e-12, x[2] + x[0] ** 2 + x[1] ** 2))
        off = np.linalg.norm(top - x[:2], axis=1) / radius - 1
        spread = np.ptp(top, axis=0).min() / (2 * radius)
        scores.append(float(np.sqrt(np.mean(off**2)) + abs(1 - spread)))
    return np.eye(3)[int(np.argmin(scores))]


def run_ycbv10(
    data: Path,
    starts: int,
    frames: int,
    only: Seq[int],
    voxels: int,
    options: dict[str, Any],
    from_mask: bool,
) -> dict[str, dict[str, Any]]:
    """Start each object off the truth `starts` times, track `frames` frames, judge the last pose.

    With `from_mask` from the mask of every frame that `frames` frames follow, whatever `starts`.
    """
    import sdftrack as st

    out: dict[str, dict[str, Any]] = {}
    with st.open_sequence(data) as seq:
        stock = [seq[i] for i in range(len(seq))]
        ids = list(seq.objects)
        for obj_id in only:
            k = ids.index(obj_id)
            mesh = seq.models[obj_id]
            sdf = st.SDF.from_mesh(mesh, voxels=voxels)
            centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
            axis = cup_axis(mesh.vertices) if obj_id == 2 else None
            turns = {1: half_turns(centre), 2: None, 3: half_turns(centre, quarter_axis=1)}[obj_id]
            rows: list[dict[str, Any]] = []
            firsts = len(stock) - frames + 1
            for n in range(firsts if from_mask else starts):
                first = n % (len(stock) - frames + 1)
                T = seq.ground_truth[first][k]
                rng = np.random.default_rng([obj_id, n])
                camera = stock[first].camera or seq.camera
                tracker = st.Tracker(sdf, camera, **{"mode": "depth", **options})
                results = track_frames(
                    tracker,
                    stock[first : first + frames],
                    None if from_mask else [off_pose(T, START_OFF_M, START_OFF_RAD, rng)],
                    start_options={"masks": [seq.masks(first)[k]]} if from_mask else None,
                )
                last = first + frames - 1
                truth = np.array([seq.ground_truth[first][k], seq.ground_truth[last][k]])
                error = pose_errors(np.array([results[0].poses[0], results[-1].poses[0]]), truth, axis, turns)
                sd = np.sqrt(np.diag(results[-1].covariances[0]))
                rows.append(
                    {
                        "mm": 1e3 * error.translation_m,
                        "deg": np.rad2deg(error.rotation_rad),
                        "turn": np.rad2deg(error.turn_rad),
                        "status": str(results[-1].status[0]),
                        "sd_mm": 1e3 * float(np.linalg.norm(sd[:3])),
                        "turn_sd": _turn_sd(results[-1], axis),
                        "seconds": float(np.median([r.seconds for r in results])),
                    }
                )
            out[YCB_NAMES[obj_id]] = _ycb_row(rows, obj_id, axis)
            if axis is not None:
                out[YCB_NAMES[obj_id]]["turn_bound_deg"] = _turn_bound(
                    mesh, axis, stock[0].camera or seq.camera, seq.ground_truth[0][k]
                )
            say(f"{YCB_NAMES[obj_id]}: {out[YCB_NAMES[obj_id]]}")
    return out


def _turn_sd(result: Any, axis: Array | None) -> float:
    """The tracker's own standard deviation of the turn about the axis, deg."""
    if axis is None:
        return float("nan")
    a = result.poses[0][:3, :3] @ axis
    return float(np.rad2deg(np.sqrt(max(0.0, a @ result.covariances[0][3:, 3:] @ a))))


def _turn_bound(mesh: Any, axis: Array, camera: Any, T: Array) -> float:
    """Least standard deviation (deg) of the turn about `axis` at the set's noise, from the whole visible
    surface."""
    camera = getattr(camera, "depth", camera)
    depth, normals, _ = mesh.raycast(camera, np.ascontiguousarray(T))
    information, _ = pose_information(depth, normals, camera.rays, T[:3, 3])
    covariance = YCB_NOISE_M**2 * np.linalg.pinv(information, rcond=1e-14)
    a = T[:3, :3] @ axis
    return float(np.rad2deg(np.sqrt(a @ covariance[3:, 3:] @ a)))


def _ycb_row(rows: list[dict[str, Any]], obj_id: int, axis: Array | None) -> dict[str, Any]:
    mm, deg = np.array([r["mm"] for r in rows]), np.array([r["deg"] for r in rows])
    turn = np.array([r["turn"][1] for r in rows])
    limit = 1e3 * YCB_LIMIT_M[obj_id]
    back = (mm <= limit) & (deg <= np.rad2deg(YCB_LIMIT_RAD))
    row: dict[str, Any] = {
        "starts": len(rows),
        "back_percent": _percent(back[:, 1]),
        "back_at_start_percent": _percent(back[:, 0]),
        "median_mm": float(np.median(mm[:, 1])),
        "max_mm": float(mm[:, 1].max()),
        "median_deg": float(np.median(deg[:, 1])),
        "max_deg": float(deg[:, 1].max()),
        "lost": sum(r["status"] == "lost" for r in rows),
        "weak": sum(r["status"] == "weak" for r in rows),
        "ms_per_frame": 1e3 * float(np.median([r["seconds"] for r in rows])),
    }
    if axis is not None:
        row["turn_within_percent"] = _percent(turn <= np.rad2deg(MUG_TURN_LIMIT_RAD))
        row["turn_median_deg"] = float(np.median(turn))
        row["turn_sd_deg"] = float(np.nanmedian([r["turn_sd"] for r in rows]))
    return row


def _percent(flags: Array) -> float:
    return 100.0 * float(np.mean(flags)) if len(flags) else float("nan")


COLUMNS = {
    "object": "name",
    "back %": "back_percent:.1f",
    "1st frame %": "back_at_start_percent:.1f",
    "median mm": "median_mm:.2f",
    "max mm": "max_mm:.2f",
    "median deg": "median_deg:.2f",
    "max deg": "max_deg:.2f",
    "lost": "lost:d",
    "weak": "weak:d",
    "ms": "ms_per_frame:.2f",
}


@experiment(
    "real.ycbv10",
    needs=["ycbv10"],
    chosen_on="ycbv10 and k1",
    reported_on="ycbv10, the same recording",
    short={"only": ("box",), "starts": 2, "frames": 2, "voxels": 80},
)
def random_start(
    *,
    data: Path,
    only: tuple[Literal["box", "mug", "brick"], ...] = ("box", "mug", "brick"),
    starts: int = 50,
    frames: int = 5,
    from_mask: bool = False,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Three recorded objects from random starts 10 mm / 5 deg off the reference pose, or from a mask.

    By depth alone; ``--set mode=rgbd`` uses colour.

    Parameters
    ----------
    frames
        after which a start is judged
    from_mask
        start from the first frame's mask, not from a pose
    """
    ids = [i for i, name in YCB_NAMES.items() if name in only]
    told = {"threads": threads, **options}
    rows = run_ycbv10(data / "ycbv10", starts, frames, ids, voxels, told, from_mask)
    notes = [
        f"{name}, turn about the axis: <= 2 deg in {q['turn_within_percent']:.1f} %, median "
        f"{q['turn_median_deg']:.2f} deg; its standard deviation: {q['turn_sd_deg']:.2f} deg by the tracker, "
        f"{q['turn_bound_deg']:.2f} deg by the bound"
        for name, q in rows.items()
        if "turn_within_percent" in q
    ]
    return Table.of(f"ycbv10, judged after {frames} frames", COLUMNS, rows, notes=notes)
