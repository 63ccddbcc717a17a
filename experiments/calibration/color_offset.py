# SPDX-License-Identifier: MIT
"""Why the colour of the recording k1 lies beside where its P and q put it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.calibration.color_edges import Scene, crease_shift, depth_step_shift, outline_shift, robust
from experiments.registry import experiment
from experiments.table import Table

__all__ = ["color_offset", "moving_shifts", "rounding_px", "static_shifts"]

Array = NDArray[np.float64]
STILL = 25  # frames at the start in which nothing moves
MOVING = range(70, 156, 3)  # both sponges carried about, before they hide each other
BOOTSTRAPS = 200


def static_shifts(scene: Scene) -> list[dict[str, Any]]:
    """Shift of each sponge in the mean of the still frames, by every measure."""
    frames = [scene.seq[i] for i in range(STILL)]
    image = np.mean([f.color for f in frames], axis=0).astype(np.float32)
    depths = np.stack([f.depth for f in frames])
    rows = []
    for k in range(2):
        T = np.asarray(scene.seq.ground_truth[0][k])
        z, u = float(T[2, 3]), float(scene.project(T[None, :3, 3])[0, 0])
        for name, picture in (
            ("all colour", image),
            ("brightness", _brightness(image)),
            ("hue", _hue(image)),
        ):
            x = outline_shift(scene, T, picture)
            if x is not None:
                rows.append({"sponge": k, "by": f"outline, {name}", "dx": x[0], "dy": x[1], "z": z, "u": u})
        crease = crease_shift(scene, T, _brightness(image)[..., 0])
        if crease is not None:
            rows.append(
                {
                    "sponge": k,
                    "by": "crease of two faces",
                    "dx": crease[0],
                    "dy": None,
                    "z": crease[1],
                    "u": crease[2],
                }
            )
        left, right = depth_step_shift(scene, T, depths, image)
        rows.append(
            {
                "sponge": k,
                "by": "steps in depth, left and right",
                "dx": 0.5 * (left + right),
                "dy": None,
                "z": z,
                "u": u,
            }
        )
    return rows


def moving_shifts(scene: Scene) -> dict[str, Array]:
    """Shifts of both sponges at depth-only poses while they are carried: arrays of one value per frame and sponge."""
    seq = scene.seq
    tracker = st.Tracker([scene.sdf, scene.sdf], seq.camera, mode="depth")
    first = [np.asarray(seq.ground_truth[0][k]) for k in range(2)]
    rows: list[tuple[float, ...]] = []
    poses = []
    for i in range(max(MOVING) + 2):
        result = tracker.start(seq[i], poses=first) if i == 0 else tracker.track(seq[i])
        poses.append((np.array(result.poses), [str(s.value) for s in result.status]))
    for i in [*range(0, STILL, 3), *MOVING]:
        for k in range(2):
            T, status = poses[i][0][k], poses[i][1][k]
            x = outline_shift(scene, T, np.asarray(seq[i].color)) if status == "ok" else None
            if x is None:
                continue
            before = scene.project(poses[max(i - 1, 0)][0][k][None, :3, 3])[0]
            after = scene.project(poses[i + 1][0][k][None, :3, 3])[0]
            v = (after - before) / (i + 1 - max(i - 1, 0))
            u = scene.project(T[None, :3, 3])[0]
            rows.append((i, k, x[0], x[1], T[2, 3], u[0], v[0], v[1]))
    names = ("frame", "sponge", "dx", "dy", "z", "u", "vx", "vy")
    return dict(zip(names, np.array(rows).T, strict=True))


def trends(shifts: dict[str, Array]) -> list[tuple[str, float, float]]:
    """Constant shift, and its slopes in velocity, nearness and column, one at a time; sd by resampling frames."""
    dx, one = shifts["dx"], np.ones(len(shifts["dx"]))
    columns = {
        "constant shift of x, px": one,
        "x per px/frame of motion (frames of delay)": shifts["vx"],
        "x per 1/m of nearness, px m": 1 / shifts["z"] - np.mean(1 / shifts["z"]),
        "x per 100 columns, px": (shifts["u"] - shifts["u"].mean()) / 100,
    }
    out = []
    for name, column in columns.items():
        A = one[:, None] if column is one else np.column_stack([column, one])
        out.append((name, float(robust(A, dx)[0]), _sd(A, dx, shifts["frame"])))
    out.append(
        (
            "constant shift of y, px",
            float(robust(one[:, None], shifts["dy"])[0]),
            _sd(one[:, None], shifts["dy"], shifts["frame"]),
        )
    )
    A = np.column_stack([shifts["vy"], one])
    out.append(
        (
            "y per px/frame of motion (frames of delay)",
            float(robust(A, shifts["dy"])[0]),
            _sd(A, shifts["dy"], shifts["frame"]),
        )
    )
    return out


def rounding_px(scene: Scene, z_m: float = 0.8) -> float:
    """The most that the printed digits of P and q can move a pixel of the image's middle half, px."""
    P, q = scene.seq.camera.projective
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 639, 9), np.linspace(0, 479, 9)))
    x = np.column_stack([u * z_m, v * z_m, np.full(len(u), z_m)])
    y = x @ P.T + q
    px = y[:, :2] / y[:, 2:]
    half = np.full((3, 3), 5e-7)  # six digits after the point
    numerator = x @ half.T + 5e-7
    return float(((numerator[:, :2] + np.abs(px) * numerator[:, 2:]) / y[:, 2:]).max())


def _sd(A: Array, d: Array, group: Array) -> float:
    rng = np.random.default_rng(0)
    frames = np.unique(group)
    found = []
    for _ in range(BOOTSTRAPS):
        chosen = np.concatenate([np.flatnonzero(group == f) for f in rng.choice(frames, len(frames))])
        found.append(robust(A[chosen], d[chosen])[0])
    return float(np.std(found))


def _brightness(image: NDArray[np.float32]) -> NDArray[np.float32]:
    grey = image @ np.array([0.299, 0.587, 0.114], np.float32)
    return np.repeat(grey[..., None], 3, axis=2)


def _hue(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Cr, Cb and a constant: what JPEG stores at half size."""
    grey = _brightness(image)[..., 0]
    cr, cb = (image[..., 0] - grey) * 0.713 + 128, (image[..., 2] - grey) * 0.564 + 128
    return np.stack([cr, cb, np.full_like(cr, 60)], axis=2)


@experiment(
    "k1_offset",
    needs=["k1"],
    chosen_on="nothing is chosen here",
    reported_on="k1",
    short={"moving": False},
)
def color_offset(*, data: Path, moving: bool = True) -> list[Table]:
    """Why the colour of k1 lies beside where its P and q put it: where, how far, and what that excludes.

    Parameters
    ----------
    moving
        also while the sponges are carried
    """
    with st.open_sequence(data / "k1") as seq:
        scene = Scene.of(seq)
        cells = [
            [
                f"{r['by']}, {('left', 'right')[r['sponge']]} sponge", f"{r['dx']:+.2f}",
                "" if r["dy"] is None else f"{r['dy']:+.2f}", f"{r['z']:.2f}", f"{r['u']:.0f}",
            ]
            for r in static_shifts(scene)
        ]  # fmt: skip
        head = ["measured less P, q", "dx px", "dy px", "depth m", "column"]
        rounding = f"rounding of P and q moves no pixel by more than {rounding_px(scene):.2f} px"
        still = Table(f"frames 0-{STILL - 1}, mean image, reference poses", head, cells, [rounding])
        return [still, *_moving_tables(scene)] if moving else [still]


def _moving_tables(scene: Scene) -> list[Table]:
    moved = moving_shifts(scene)
    still = moved["frame"] < STILL
    cells = []
    for name, part in (("still frames", still), (f"frames {MOVING.start}-{MOVING.stop}", ~still)):
        dx, dy, z = (moved[key][part] for key in ("dx", "dy", "z"))
        speed = np.hypot(moved["vx"], moved["vy"])[part].max()
        numbers = [f"{v:+.2f}" for v in (np.median(dx), np.median(dy))] + [
            f"{v:.2f}" for v in (dx.std(), dy.std())
        ]
        cells.append([name, *numbers, str(len(dx)), f"{z.min():.2f}-{z.max():.2f}", f"{speed:.1f}"])
    head = ["depth-only poses", "dx px", "dy px", "dx sd", "dy sd", "outlines", "depth m", "speed px/frame"]
    rows = [[name, f"{value:+.3f}", f"{sd:.3f}"] for name, value, sd in trends(moved)]
    return [
        Table("Outlines at depth-only poses, medians", head, cells),
        Table("All outlines at depth-only poses, one trend at a time", ["trend", "value", "sd"], rows),
    ]
