# SPDX-License-Identifier: MIT
"""Sequences of several copies of one shape that touch, occlude and push each other, with exact ground truth.

No two solids ever penetrate: pairs are set apart along their line of centres until the least gap is the wanted
one. An object moves by at most 5 mm (its middle) and 1.5 deg from frame to frame wherever it can be seen.
Changing a number in this file breaks comparisons with every figure that was printed with it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.contact import (
    CONTACT_M,
    DISTANCE_M,
    MAX_STEP_M,
    Solid,
    apart,
    first_contact,
    gap,
    ramped,
    rotations,
    smooth,
    spins,
    steps,
    unit,
    wander,
)
from experiments.synth.staged import Scene, kept, make
from sdftrack import geometry

Array = NDArray[np.float64]
HOLD, OPEN_M = 12, 0.05  # frames of a contact; gap between two that have parted
HALVES = 13  # turns of 180 deg in which the two of `meetings` touch once and pass once
FIRST, AWAY, AFTER = 20, 20, 25  # of `hidden`


def meetings(
    mesh: Any, solid: Solid, frames: int | None, seed: int, cache: Path | None = None, **more: Any
) -> Scene:
    """Two copies circle each other: they touch side by side, part, pass one before the other, and so on.

    Half of the meetings are contacts, half crossings, in which the nearer one hides the other partly or wholly.
    Without a number of frames there are `HALVES` of each.
    """
    found = kept(
        cache, ("meetings", mesh.vertices, frames, seed), lambda: {"poses": _meetings(solid, frames, seed)}
    )
    return make("meetings", mesh, solid, found["poses"], seed=seed, cache=cache, **more)


def _meetings(solid: Solid, wanted: int | None, seed: int) -> Array:
    rng = np.random.default_rng([seed, 21])
    phase, R0 = rng.uniform(0, 2 * np.pi, 4), rotations(rng, 2)
    swing = max(40, round(np.pi * (solid.radius + 0.5 * OPEN_M) / 0.0035))
    for _ in range(8):
        frames = HALVES * (HOLD + swing) + HOLD if wanted is None else wanted
        # Turned by half a circle in `swing` frames, then at rest for a contact of `HOLD`.
        cycle, within = np.divmod(np.arange(frames), HOLD + swing)
        moving = np.clip((within - HOLD) / swing, 0, 1)
        theta = np.pi * (cycle + ramped(moving))
        tilt = 0.3 * np.sin(0.37 * theta + phase[0])
        direction = unit(np.column_stack([np.cos(theta), tilt * np.sin(theta), np.sin(theta)]))
        open_m = OPEN_M * smooth(np.abs(np.sin(theta)) / 0.6)
        turning = np.where(within < HOLD, 0.1, 1.2)
        R = spins(R0, np.deg2rad(turning), phase)
        poses = apart(solid, R, wander(frames, phase), direction, CONTACT_M + open_m)
        worst = steps(solid, poses)
        if worst <= 1:
            return poses
        swing = int(np.ceil(swing * min(1.5, 1.03 * worst)))
    raise ValueError(f"meetings: cannot keep to {1e3 * MAX_STEP_M:g} mm a frame; got {worst:.2f} times that")


def push(
    mesh: Any,
    solid: Solid,
    frames: int,
    seed: int,
    push_m: float = 0.004,
    cache: Path | None = None,
    **more: Any,
) -> Scene:
    """Two copies in contact that roll about each other, shown up to `push_m` nearer to each other than they are."""
    rng = np.random.default_rng([seed, 22])
    phase, R0 = rng.uniform(0, 2 * np.pi, 4), rotations(rng, 2)

    def planned() -> dict[str, Array]:
        i = np.arange(frames)
        theta = np.deg2rad(55) * np.sin(2 * np.pi * i / 400 + phase[0])
        direction = unit(np.column_stack([np.cos(theta), 0.3 * np.sin(i / 90 + phase[1]), np.sin(theta)]))
        R = spins(R0, np.full(frames, np.deg2rad(0.3)), phase)
        gaps = CONTACT_M + 0.03 * smooth(np.abs(np.cos(np.pi * i / 100)) * 5 - 4)  # apart at 0, 100, 200, ...
        return {"poses": apart(solid, R, wander(frames, phase), direction, gaps)}

    poses = kept(cache, ("push", mesh.vertices, frames, seed), planned)["poses"]
    line = unit(solid.place(poses[:, 1]) - solid.place(poses[:, 0]))
    # Comes and goes within each contact, so that the trackers are pushed, not shifted once.
    strength = 0.5 * push_m * smooth(2 * np.sin(np.pi * np.arange(frames) / 100) ** 2 - 0.5)[:, None]
    shown = poses.copy()
    shown[:, 0, :3, 3] += strength * line
    shown[:, 1, :3, 3] -= strength * line
    return make("push", mesh, solid, poses, shown=shown, seed=seed, cache=cache, **more)


def approach(
    mesh: Any, solid: Solid, frames: int = 220, seed: int = 0, cache: Path | None = None, **more: Any
) -> Scene:
    """Figure 5.6: two copies that meet every 32 frames (78, 110, 142, ...), one before the other; apart at 94."""
    rng = np.random.default_rng([seed, 23])
    phase, R0 = rng.uniform(0, 2 * np.pi, 4), rotations(rng, 2)

    def planned() -> dict[str, Array]:
        i = np.arange(frames)
        parted = ramped(1 - np.abs(1 - ((i - 78) / 16) % 2), 0.3)  # 0: together, 1: side by side
        swing, R = np.deg2rad(60), spins(R0, np.deg2rad(0.2 + 0.8 * parted), phase)
        for _ in range(8):
            theta = np.deg2rad(75) - swing * parted
            direction = unit(
                np.column_stack([np.cos(theta), 0.15 * np.sin(i / 60 + phase[1]), np.sin(theta)])
            )
            poses = apart(solid, R, wander(frames, phase), direction, CONTACT_M + 0.02 * parted)
            worst = steps(solid, poses)
            if worst <= 1:
                return {"poses": poses}
            swing *= 0.97 / worst  # as far around each other as 16 frames allow
        raise ValueError(
            f"approach: cannot keep to {1e3 * MAX_STEP_M:g} mm a frame; got {worst:.2f} times that"
        )

    poses = kept(cache, ("approach", mesh.vertices, frames, seed), planned)["poses"]
    return make("approach", mesh, solid, poses, seed=seed, cache=cache, **more)


def still_pair(
    mesh: Any, solid: Solid, frames: int = 200, seed: int = 0, gap_m: float = 0.003, **more: Any
) -> Scene:
    """Figure 5.8: two copies at rest, nearly touching, and a camera that moves about and keeps facing them."""
    rng = np.random.default_rng([seed, 24])
    R0, phase = rotations(rng, 2), rng.uniform(0, 2 * np.pi, 3)
    still = apart(solid, R0[None], np.zeros((1, 3)), np.array([[1.0, 0, 0]]), np.array([gap_m]))[0]
    i = np.arange(frames)
    around = np.deg2rad(40) * np.sin(2 * np.pi * i / 220 + phase[0])
    up = np.deg2rad(25 + 10 * np.sin(2 * np.pi * i / 160 + phase[1]))
    away = DISTANCE_M + 0.05 * np.sin(2 * np.pi * i / 130 + phase[2])
    eyes = away[:, None] * np.column_stack(
        [np.cos(up) * np.sin(around), np.sin(up), -np.cos(up) * np.cos(around)]
    )
    poses = np.array([[geometry.look_at(eye, np.zeros(3), (0, 1.0, 0)) @ T for T in still] for eye in eyes])
    return make("still pair", mesh, solid, poses, seed=seed, clutter="wall", **more)


def hidden(mesh: Any, solid: Solid, seed: int, after: int = AFTER, **more: Any) -> Scene:
    """Object 0 is covered for 20 frames beside object 1, and comes out 50-150 mm away, turned by up to 30 deg."""
    from sdftrack.synth import Cover

    rng = np.random.default_rng([seed, 25])
    frames, back = FIRST + AWAY + after, FIRST + AWAY
    i = np.arange(frames)
    for _ in range(200):
        R0, phase = rotations(rng, 2), rng.uniform(0, 2 * np.pi, 4)
        R = spins(R0, np.full(frames, np.deg2rad(0.5)), phase)
        angle = rng.uniform(-0.5, 0.5) + np.pi * rng.integers(2)
        direction = unit(np.tile([np.cos(angle), np.sin(angle), rng.uniform(-0.2, 0.2)], (frames, 1)))
        poses = apart(solid, R, wander(frames, phase), direction, np.full(frames, rng.uniform(0.002, 0.03)))
        shift = rng.normal(size=3) * [1, 1, 0.2]
        shift *= rng.uniform(0.05, 0.15) / np.linalg.norm(shift)
        turn = rng.normal(size=3)
        turn *= rng.uniform(0, np.deg2rad(30)) / np.linalg.norm(turn)
        for n in i[i >= FIRST + AWAY // 2]:  # it moves while nobody sees it
            T = poses[n, 0]
            poses[n, 0] = solid.at(geometry.pose(turn)[:3, :3] @ T[:3, :3], solid.place(T) + shift)
        if min(gap(solid, *poses[n]) for n in i[back - AWAY // 2 :: 5]) > 0.005 and _clear(
            solid, poses[back]
        ):
            return make("hidden", mesh, solid, poses, occluder=Cover(FIRST, AWAY), seed=seed, **more)
    raise ValueError(f"hidden: found no free place beside the other object with seed {seed}")


def _clear(solid: Solid, poses: Array) -> bool:
    """Whether both can be seen: their balls overlap by less than half in the image."""
    a, b = solid.place(poses)
    return bool(np.linalg.norm(a[:2] / a[2] - b[:2] / b[2]) * min(a[2], b[2]) > solid.radius)


def row(mesh: Any, solid: Solid, count: int, frames: int, seed: int = 0, **more: Any) -> Scene:
    """`count` copies of one orientation in a grid, each in contact with its neighbours, as near as all are in view."""
    R = rotations(np.random.default_rng([seed, 26]), 1)[0]
    far, origin = 2 * solid.radius + 0.01, np.zeros(3)
    first = solid.at(R, origin)
    across = np.array([first_contact(solid, [first], R, origin, -np.eye(3)[0], far, CONTACT_M), 0.0, 0.0])
    beside = [solid.at(R, k * across) for k in (-1, 0, 1)]
    down = np.array([0.0, first_contact(solid, beside, R, origin, -np.eye(3)[1], far, CONTACT_M), 0.0])
    columns = min(range(1, count + 1), key=lambda c: max(c * across[0] / 4, -(-count // c) * down[1] / 3))
    rows = -(-count // columns)
    away = max(0.6, 525 * columns * across[0] / 560, 525 * rows * down[1] / 420) + solid.radius
    k = np.arange(count)[:, None]
    places = (k % columns - 0.5 * (columns - 1)) * across + (k // columns - 0.5 * (rows - 1)) * down
    still = np.array([solid.at(R, place) for place in places])
    sway = [np.sin(2 * np.pi * np.arange(frames) / p) for p in (60, 75, 90)]
    moves = [
        geometry.pose(np.deg2rad([0.0, 0.0, 1.0 * a]), [0.01 * b, 0.01 * a, away + 0.02 * c])
        for a, b, c in zip(*sway, strict=True)
    ]
    poses = np.array([[M @ T for T in still] for M in moves])
    return make("row", mesh, solid, poses, seed=seed, clutter="wall", **more)
