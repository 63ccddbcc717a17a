# SPDX-License-Identifier: MIT
"""Five copies of one shape that hands take, turn and put down again, beside and upon one another."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.contact import (
    CONTACT_M,
    DISTANCE_M,
    Solid,
    first_contact,
    gap,
    ramped,
    rotations,
    unit,
)
from experiments.synth.staged import Scene, kept, make
from sdftrack import geometry
from sdftrack.synth.bodies import SKIN, Stage
from sdftrack.synth.surroundings import Layer, hand_mesh, mesh_layer

Array = NDArray[np.float64]
# Changing these numbers breaks comparisons.
COUNT, STEP_M, STEP_RAD, TURN_RAD = 5, 0.0038, np.deg2rad(1.2), np.deg2rad(60.0)
LOW, HIGH = (
    np.array([-0.15, -0.10, -0.16]),
    np.array([0.15, 0.10, 0.08]),
)  # where they are put down, about the middle
OVER_M, SMOOTHED = 0.025, 7  # above all others while carried; frames over which a path's corners are rounded
HAND_M, CLEAR_M, CHANGE, ENTER = (
    0.10,
    0.02,
    60,
    30,
)  # a hand's length, its distance; frames with one object, to come in


def hands(
    mesh: Any, solid: Solid, frames: int = 1000, seed: int = 0, cache: Path | None = None, **more: Any
) -> Scene:
    """Five copies: one hand carries one after the other over the rest, another one passes before them."""
    found = kept(cache, ("hands", mesh.vertices, frames, seed), lambda: _plan(solid, frames, seed))
    poses, held = found["poses"], found["held"]
    turns = np.arange(frames) // CHANGE
    paths = np.stack([_over(solid, poses, held), _over(solid, poses, (2 * turns + turns // COUNT) % COUNT)])
    return make("hands", mesh, solid, poses, occluder=Hands(paths), seed=seed, cache=cache, **more)


@dataclass(frozen=True, repr=False, eq=False)
class Hands:
    """Hands whose fingertips follow paths (H, n, 3), m, camera frame."""

    paths: Array

    def __repr__(self) -> str:
        # Names the cached pictures: equal paths must read alike, others not.
        return f"Hands({hashlib.sha256(np.ascontiguousarray(self.paths).tobytes()).hexdigest()[:16]})"

    def ready(self, stage: Stage) -> Callable[[int, Any, Any], Layer]:
        """A function (frame, visible, depth) -> the hands' picture."""
        mesh = hand_mesh(HAND_M)

        def layer(i: int, visible: Any, depth: Any) -> Layer:
            out = Layer.empty(stage.camera)
            for h, path in enumerate(self.paths):
                # From below left and right, as of a person who sits before the camera's table.
                side = -0.5 * np.pi + (0.7 if h else -0.7) + 0.2 * np.sin(i / 50)
                inward = np.array([np.cos(side), np.sin(side), 0.0])
                T = np.eye(4)
                T[:3, :3] = np.column_stack([np.cross(-inward, [0, 0, 1]), -inward, [0, 0, 1]])
                # In from below in the first second; then the fingers creep.
                reach = -0.02 + 0.02 * np.sin(i / 23) - 0.2 * (1 - min(1.0, i / ENTER)) ** 2
                T[:3, 3] = path[i] + reach * inward
                out.put(mesh_layer(mesh, stage.camera, T, SKIN))
            return out

        return layer


def _over(solid: Solid, poses: Array, which: NDArray[Any]) -> Array:
    """Points just before the objects `which` (n,), smoothed where it changes from one to another."""
    place = solid.place(poses)[np.arange(len(poses)), which.astype(int)]
    away = np.linalg.norm(place, axis=1, keepdims=True)
    return _rounded(place * (1 - (solid.radius + CLEAR_M) / away), 25)


def _rounded(path: Array, window: int) -> Array:
    padded = np.concatenate([np.repeat(path[:1], window // 2, 0), path, np.repeat(path[-1:], window // 2, 0)])
    kernel = np.ones(window) / window
    return np.column_stack([np.convolve(column, kernel, "valid") for column in padded.T])


def _plan(solid: Solid, frames: int, seed: int) -> dict[str, Array]:
    """Poses (n, 5, 4, 4) and the object in hand (n,); the group sways a little as a whole."""
    rng = np.random.default_rng([seed, 31])
    now = _first(solid, rng)
    rows: list[Array] = []
    held: list[int] = []
    while len(rows) < frames:
        k, path = _move(solid, now, rng, held[-1] if held else -1)
        for T in path:
            now = now.copy()
            now[k] = T
            rows.append(now)
            held.append(k)
    i = np.arange(frames)[:, None]
    tilts = np.deg2rad([3.0, 4.0, 3.0]) * np.sin(2 * np.pi * i / [310, 270, 350])
    shifts = np.array([0.005, 0.005, 0.01]) * np.sin(2 * np.pi * i / [240, 210, 300]) + [0, 0, DISTANCE_M]
    sway = np.array([geometry.pose(w, t) for w, t in zip(tilts, shifts, strict=True)])
    return {"poses": sway[:, None] @ np.array(rows[:frames]), "held": np.array(held[:frames])}


def _first(solid: Solid, rng: np.random.Generator) -> Array:
    """Pushed together from the sides, one after the other."""
    R = rotations(rng, COUNT)
    poses = [solid.at(R[0], np.zeros(3))]
    while len(poses) < COUNT:
        k = len(poses)
        at = rng.uniform(0, 2 * np.pi)
        from_ = np.array([np.cos(at), 0.6 * np.sin(at), rng.uniform(-0.2, 0.2)])
        s = first_contact(solid, poses, R[k], np.zeros(3), -unit(from_), 0.5, CONTACT_M)
        place = s * unit(from_)
        if (place > LOW).all() and (place < HIGH).all():
            poses.append(solid.at(R[k], place))
        else:
            R[k] = rotations(rng, 1)[0]
    return np.array(poses)


def _move(solid: Solid, poses: Array, rng: np.random.Generator, last: int) -> tuple[int, Array]:
    """An object that is free towards the camera, and its way (n, 4, 4) up, across and down onto the others."""
    for _ in range(500):
        k = int(rng.integers(COUNT))
        others = [T for j, T in enumerate(poses) if j != k]
        if k == last:
            continue
        here, R = solid.place(poses[k]), poses[k][:3, :3]
        ceiling = min(solid.place(T)[2] for T in others) - 2 * solid.radius - OVER_M
        up, down = _toward_camera(rng), _toward_camera(rng)
        lift = (ceiling - here[2]) / up[2]
        if not _free(solid, others, R, here, up, lift):
            continue
        turn = rng.normal(size=3)
        turn *= rng.uniform(0.3, 1) * TURN_RAD / np.linalg.norm(turn)
        R_new = geometry.pose(turn)[:3, :3] @ R
        onto = solid.place(others[int(rng.integers(len(others)))]) + rng.normal(scale=0.02, size=3) * [
            1,
            1,
            0,
        ]
        drop = (ceiling - onto[2]) / down[2]
        s = first_contact(solid, others, R_new, onto, -down, drop, CONTACT_M)
        there = onto + s * down
        if (there < LOW).any() or (there > HIGH).any() or s <= 0:
            continue
        corners = np.array([here, here + lift * up, onto + drop * down, there])
        return k, _way(solid, corners, R, turn)
    raise ValueError("hands: found no object that can be moved; try another seed")


def _toward_camera(rng: np.random.Generator) -> Array:
    """A direction up to 50 deg off the way to the camera."""
    slope, at = np.tan(np.deg2rad(rng.uniform(0, 50))), rng.uniform(0, 2 * np.pi)
    return unit(np.array([slope * np.cos(at), slope * np.sin(at), -1.0]))


def _free(solid: Solid, others: list[Array], R: Array, start: Array, along: Array, length: float) -> bool:
    """Whether a copy can leave in a straight line without touching."""
    s = 0.0
    while s < length:
        room = min(gap(solid, solid.at(R, start + s * along), T) for T in others)
        if room < 0.4 * CONTACT_M:
            return False
        s += max(0.5 * room, 0.002)
    return True


def _way(solid: Solid, corners: Array, R: Array, turn: Array) -> Array:
    """Along the corners at no more than `STEP_M` a frame; it turns on the middle leg, high above the others."""
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    # Speed peaks at 1.25 times the mean, that of the turn at twice it: both have a way's whole time or a leg's.
    across = max(legs[1], 1.6 * float(np.linalg.norm(turn)) / STEP_RAD * STEP_M)
    lengths = np.array([legs[0], across, legs[2]])
    n = int(np.ceil(1.25 * lengths.sum() / STEP_M))
    s = lengths.sum() * ramped(np.linspace(0, 1, n))
    at = np.concatenate([[0], np.cumsum(lengths)])
    places = _rounded(np.column_stack([np.interp(s, at, c) for c in corners.T]), SMOOTHED)
    share = np.clip((s - at[1]) / across, 0, 1)
    share = share * share * (3 - 2 * share)
    return np.array(
        [solid.at(geometry.pose(f * turn)[:3, :3] @ R, p) for f, p in zip(share, places, strict=True)]
    )
