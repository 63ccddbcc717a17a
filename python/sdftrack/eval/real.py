# SPDX-License-Identifier: MIT
"""Tracking of two recorded sequences against their reference poses, by depth (default) or with `--set mode=rgbd`.

python -m sdftrack.eval.real ycbv10 --data DIR     # random starts 10 mm / 5 deg off the truth
python -m sdftrack.eval.real k1 --data DIR         # each of two sponges by itself, still and in the hand
python -m sdftrack.eval.real ycbv10 --data DIR --from-mask    # the same without a pose: from the first frame's mask
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.eval.bound import pose_information
from sdftrack.eval.run import parse_settings, pose_errors, track_frames

__all__ = ["cup_axis", "half_turns", "main", "off_pose", "run_k1", "run_ycbv10"]

Array = NDArray[np.float64]
START_OFF_M, START_OFF_RAD = 0.010, np.deg2rad(5.0)
YCB_NAMES = {1: "box", 2: "mug", 3: "brick"}
YCB_LIMIT_M = {1: 0.002, 2: 0.0025, 3: 0.002}
YCB_LIMIT_RAD = np.deg2rad(1.5)
MUG_TURN_LIMIT_RAD = np.deg2rad(2.0)
YCB_NOISE_M = 0.0009  # median |measured - rendered| of the set's own check, taken as one sigma
K1_STILL = 41  # frames 0-40: nobody touches the sponges
K1_STILL_LIMITS = {0: (0.004, np.deg2rad(2.0)), 1: (0.004, np.deg2rad(4.0))}
K1_HAND_LIMITS = {0: (0.004, np.deg2rad(2.5)), 1: (0.006, np.deg2rad(4.0))}
K1_TO_FRAME, K1_LEAST_IOU = 124, 0.8  # the last frame with a mask
HIDING_M = 0.008  # a reading this much nearer than the model hides it
K1_SPREAD_LIMIT = (0.0005, np.deg2rad(0.3))
SIDES = ("left", "right")


def _rotation(axis: Array, angle_rad: float) -> Array:
    k = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    K = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.eye(3) + np.sin(angle_rad) * K + (1 - np.cos(angle_rad)) * (K @ K)


def off_pose(T: Array, metres: float, radians: float, rng: np.random.Generator) -> Array:
    """Push a pose by exactly `metres` and `radians` in random directions, about the object's origin."""
    d, w = rng.normal(size=3), rng.normal(size=3)
    out = np.array(T, np.float64)
    out[:3, 3] += metres * d / np.linalg.norm(d)
    out[:3, :3] = _rotation(w, radians) @ out[:3, :3]
    return out


def half_turns(centre: Array, quarter_axis: int | None = None) -> list[Array]:
    """Object-frame motions that map a box onto itself: half turns about its axes, with quarter turns about
    one."""
    rotations = [np.eye(3)] + [_rotation(np.eye(3)[k], np.pi) for k in range(3)]
    if quarter_axis is not None:
        quarter = _rotation(np.eye(3)[quarter_axis], np.pi / 2)
        rotations += [quarter @ R for R in rotations]
    out = []
    for R in rotations:
        S = np.eye(4)
        S[:3, :3] = R
        S[:3, 3] = centre - R @ centre
        out.append(S)
    return out


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


def _percent(flags: Array) -> float:
    return 100.0 * float(np.mean(flags)) if len(flags) else float("nan")


def run_ycbv10(
    data: Path,
    starts: int = 50,
    frames: int = 5,
    only: Seq[int] = (1, 2, 3),
    voxels: int = 200,
    options: dict[str, Any] | None = None,
    say: Callable[[str], None] = lambda text: None,
    from_mask: bool = False,
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
                tracker = st.Tracker(sdf, camera, **{"mode": "depth", **(options or {})})
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


def _spread(poses: Array) -> tuple[float, float]:
    """Standard deviation of position (m) and orientation (rad) about their mean."""
    t = poses[:, :3, 3] - poses[:, :3, 3].mean(axis=0)
    u, _, vt = np.linalg.svd(poses[:, :3, :3].mean(axis=0))
    mean = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    angles = [np.arccos(np.clip((np.trace(mean.T @ R) - 1) / 2, -1, 1)) for R in poses[:, :3, :3]]
    return float(np.sqrt(np.mean((t**2).sum(axis=1)))), float(np.sqrt(np.mean(np.square(angles))))


def mask_iou(sdf: Any, camera: Any, frame: Any, T: Array, masks: Iterable[Any]) -> float:
    """Intersection over union of what the pose shows of the object (not hidden by a nearer reading) with a mask.

    With the best of `masks`: objects that look alike are not told apart by theirs.
    """
    depth, _ = sdf.render(getattr(camera, "depth", camera), np.ascontiguousarray(T))
    shown = (depth > 0) & ~((frame.depth > 0) & (frame.depth < depth - HIDING_M))
    ratios = [int(np.count_nonzero(shown & m)) / max(1, int(np.count_nonzero(shown | m))) for m in masks]
    return float(max(ratios, default=np.nan))


def run_k1(
    data: Path,
    frames: int = 141,
    only: Seq[int] = (0, 1),
    voxels: int = 200,
    options: dict[str, Any] | None = None,
    say: Callable[[str], None] = lambda text: None,
    keep_poses: bool = False,
    from_mask: bool = False,
) -> dict[str, dict[str, Any]]:
    """Track each sponge by itself from its reference pose in frame 0, or from its mask there."""
    import sdftrack as st

    out: dict[str, dict[str, Any]] = {}
    with st.open_sequence(data) as seq:
        mesh = next(iter(seq.models.values()))
        sdf = st.SDF.from_mesh(mesh, voxels=voxels)
        frames = min(frames, len(seq))
        for k in only:
            tracker = st.Tracker(sdf, seq.camera, **{"mode": "depth", **(options or {})})

            def told(i: int, result: Any, k: int = k) -> None:
                if i % 20 == 0 or not result.ok:
                    say(f"{SIDES[k]} {i:3d}: {result.status[0]} {result.reason[0]}")

            results = track_frames(
                tracker,
                (seq[i] for i in range(frames)),
                None if from_mask else [np.asarray(seq.ground_truth[0][k])],
                told,
                {"masks": [seq.masks(0)[k]]} if from_mask else None,
            )
            poses = np.array([r.poses[0] for r in results])
            overlap = {
                i: mask_iou(sdf, seq.camera, seq[i], poses[i], masks.values())
                for i in range(min(frames, K1_TO_FRAME + 1))
                if (masks := seq.masks(i))
            }
            still = poses[:K1_STILL]
            first = pose_errors(still, np.tile(seq.ground_truth[0][k], (len(still), 1, 1)))
            spread = _spread(still)
            row: dict[str, Any] = {
                "spread_mm": 1e3 * spread[0],
                "spread_deg": float(np.rad2deg(spread[1])),
                "still_max_mm": 1e3 * float(first.translation_m.max()),
                "still_max_deg": float(np.rad2deg(first.rotation_rad.max())),
                "hand": {},
                "iou_least": min(overlap.values(), default=float("nan")),
                "iou_at": min(overlap, key=lambda i: overlap[i], default=-1),
                "iou_frames": len(overlap),
                "lost": sum(str(r.status[0]) == "lost" for r in results),
                "weak": sum(str(r.status[0]) == "weak" for r in results),
                "first_lost": next((i for i, r in enumerate(results) if str(r.status[0]) == "lost"), None),
                "ms_per_frame": 1e3 * float(np.median([r.seconds for r in results])),
            }
            for i in sorted(seq.ground_truth):
                if 0 < i < frames and k in seq.ground_truth[i]:
                    e = pose_errors(poses[i : i + 1], np.asarray(seq.ground_truth[i][k])[None])
                    row["hand"][i] = (1e3 * float(e.translation_m[0]), float(np.rad2deg(e.rotation_rad[0])))
            if keep_poses:
                row["poses"] = poses.tolist()
            out[SIDES[k]] = row
    return out


def _format_ycbv10(rows: dict[str, dict[str, Any]]) -> str:
    lines = [
        f"{'object':7s} {'back %':>7s} {'(1st)':>6s} {'median mm':>9s} {'max':>7s} {'median deg':>10s} "
        + f"{'max':>7s} {'lost':>4s} {'weak':>4s} {'ms':>6s}"
    ]
    for name, q in rows.items():
        lines.append(
            f"{name:7s} {q['back_percent']:7.1f} {q['back_at_start_percent']:6.1f} {q['median_mm']:9.2f} "
            f"{q['max_mm']:7.2f} {q['median_deg']:10.2f} {q['max_deg']:7.2f} {q['lost']:4d} {q['weak']:4d} "
            f"{q['ms_per_frame']:6.2f}"
        )
        if "turn_within_percent" in q:
            lines.append(
                f"{'':7s} turn about the axis: <= 2 deg in {q['turn_within_percent']:.1f} %, median "
                f"{q['turn_median_deg']:.2f} deg; its standard deviation: "
                f"{q['turn_sd_deg']:.2f} deg by the tracker, {q['turn_bound_deg']:.2f} deg by the bound"
            )
    return "\n".join(lines)


def _format_k1(rows: dict[str, dict[str, Any]]) -> str:
    lines = []
    for k, name in enumerate(SIDES):
        if name not in rows:
            continue
        q = rows[name]
        still, hand = (
            f"{1e3 * m:g} mm / {np.rad2deg(r):g} deg" for m, r in (K1_STILL_LIMITS[k], K1_HAND_LIMITS[k])
        )
        at = "  ".join(f"{i}: {mm:.1f} / {deg:.1f}" for i, (mm, deg) in q["hand"].items())
        indent = " " * len(name)
        lines.append(
            f"{name}: still (0-40) spread {q['spread_mm']:.3f} mm / {q['spread_deg']:.3f} deg "
            f"(want {1e3 * K1_SPREAD_LIMIT[0]:g} / {np.rad2deg(K1_SPREAD_LIMIT[1]):g}), "
            f"from the reference at most {q['still_max_mm']:.2f} mm / {q['still_max_deg']:.2f} deg "
            f"(want {still})"
        )
        lines.append(f"{indent}  in the hand, mm / deg at frame  {at}  (want {hand})")
        lines.append(
            f"{indent}  mask IoU at least {q['iou_least']:.3f} (frame {q['iou_at']}, {q['iou_frames']} trusted masks "
            f"to frame {K1_TO_FRAME}; want {K1_LEAST_IOU:g})"
        )
        lines.append(
            f"{indent}  lost {q['lost']}, weak {q['weak']}, first lost {q['first_lost']}, "
            f"{q['ms_per_frame']:.2f} ms per frame"
        )
    return "\n".join(lines)


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.real", description=(__doc__ or "").split("\n")[0]
    )
    p.add_argument("case", choices=["ycbv10", "k1"])
    p.add_argument("--data", type=Path, required=True, help="folder of the sequence (or its parent)")
    p.add_argument("--only", default="", help="ycbv10: box,mug,brick; k1: left,right")
    p.add_argument("--starts", type=int, default=50)
    p.add_argument(
        "--frames", type=int, default=0, help="ycbv10: frames after which a start is judged (5); k1: 141"
    )
    p.add_argument(
        "--from-mask", action="store_true", help="start from the first frame's mask, not from a pose"
    )
    p.add_argument("--voxels", type=int, default=200)
    p.add_argument("--threads", type=int, default=0)
    p.add_argument(
        "--set", action="append", default=[], metavar="OPTION=VALUE", help="an option of the tracker"
    )
    p.add_argument("--json", type=Path)
    return p


def main(arguments: Seq[str] | None = None) -> int:
    """Run the protocol and print the table."""
    a = _parser().parse_args(arguments)
    data = a.data / a.case if (a.data / a.case).is_dir() else a.data
    options = {"threads": a.threads, **parse_settings(a.set)}
    names = [n for n in a.only.split(",") if n]

    def say(text: str) -> None:
        print(f"# {text}", file=sys.stderr, flush=True)

    if a.case == "ycbv10":
        ids = [i for i, n in YCB_NAMES.items() if not names or n in names]
        rows = run_ycbv10(data, a.starts, a.frames or 5, ids, a.voxels, options, say, a.from_mask)
        print(_format_ycbv10(rows))
    else:
        sides = [k for k, n in enumerate(SIDES) if not names or n in names]
        keep = a.json is not None
        rows = run_k1(data, a.frames or 141, sides, a.voxels, options, say, keep, a.from_mask)
        print(_format_k1(rows))
    if a.json is not None:
        a.json.write_text(json.dumps({"settings": vars(a), "rows": rows}, default=str, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
