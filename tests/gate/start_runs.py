# SPDX-License-Identifier: MIT
"""Starts without a pose, objects with symmetries, and solids whose size is estimated."""

import tempfile
from pathlib import Path

import numpy as np
from digest import CAMERA, Hashes, digest, tracked

import sdftrack as st
from sdftrack import geometry

SIDES_M = (0.10, 0.07, 0.08)
DOWN_RAD = 0.6  # the camera looks down on the table


def _on_table(x: float, along: float, above: float, turn: float = 0.0) -> np.ndarray:
    c, s = np.cos(DOWN_RAD), np.sin(DOWN_RAD)
    tilt = geometry.pose(
        [DOWN_RAD, 0, 0], np.array([x, c * -above - s * along, 0.75 - s * above + c * along])
    )
    return tilt @ geometry.pose([0, turn, 0], [0, 0, 0])


def _table() -> tuple[list[st.Frame], st.SDF, list[np.ndarray]]:
    """Two boxes of one size, told apart by colour, on a table before a wall, seen twice; and a mask of each."""
    box = st.SDF.box(SIDES_M, voxels=64)
    layers = [
        (st.SDF.box((1.2, 0.02, 0.9), voxels=100), _on_table(0, 0, -0.01), (200, 200, 195)),
        (st.SDF.box((2.0, 1.2, 0.02), voxels=100), _on_table(0, 0.5, 0.4), (90, 100, 110)),
        (box, _on_table(0.03, 0, 0.5 * SIDES_M[1], 0.5), (190, 60, 40)),
        (box, _on_table(0.19, 0.05, 0.5 * SIDES_M[1]), (60, 80, 190)),
    ]
    depth, color = np.zeros(CAMERA.shape, np.float32), np.zeros((*CAMERA.shape, 3), np.uint8)
    owner = np.full(CAMERA.shape, -1)
    for n, (shape, pose, rgb) in enumerate(layers):
        z = shape.render(CAMERA, pose)[0]
        nearer = (z > 0) & ((depth == 0) | (z < depth))
        depth[nearer], color[nearer], owner[nearer] = z[nearer], rgb, n
    rng = np.random.default_rng(0)
    frames = []
    for _ in range(2):
        seen = np.where(depth > 0, depth + 0.001 * rng.normal(size=depth.shape), 0).astype(np.float32)
        colors = np.clip(color + rng.normal(0, 4, color.shape), 0, 255).astype(np.uint8)
        frames.append(st.Frame(seen, colors))
    return frames, box, [owner == 2, owner == 3]


def _middle(mask: np.ndarray) -> tuple[int, int]:
    y, x = np.nonzero(mask)
    return int(np.median(x)), int(np.median(y))


def click() -> Hashes:
    """A pixel on an object that stands on a table: depth alone, with colours, two at once, and on the table."""
    (frame, later), box, masks = _table()
    clicks = [_middle(mask) for mask in masks]
    out = {}
    for mode in ("depth", "auto"):
        tracker = st.Tracker(box, CAMERA, mode=mode)
        out[mode] = digest(tracked([tracker.start(frame, clicks=clicks[0]), tracker.track(later)]))
    both = st.Tracker([box, box], CAMERA)
    out.update(tracked([both.start(frame, clicks=clicks), both.track(later)]))
    try:
        said = str(st.Tracker(box, CAMERA).start(frame, clicks=(10, CAMERA.height - 10)).status[0].value)
    except ValueError as error:
        said = str(error)
    return {**out, "on the table": digest(said)}


def anywhere() -> Hashes:
    """The whole image of a table is searched; a shape that is not there is lost."""
    (frame, later), box, _ = _table()
    tracker = st.Tracker(box, CAMERA)
    out = tracked([tracker.start(frame), tracker.track(later)])
    other = st.Tracker(st.SDF.cylinder(0.06, 0.22, voxels=64), CAMERA)
    return {**out, "not there": digest(tracked([other.start(frame)]))}


def symmetric() -> Hashes:
    """Declared and found symmetries: canonical poses from a pose, a mask and two of a kind."""
    can = st.SDF.cylinder(0.04, 0.11, voxels=64)
    round_and_turned = st.Symmetry(np.diag([1.0, -1, -1, 1])[None], (([0, 0, 1], [0, 0, 0]),))
    path = np.array([geometry.pose([0.9 + 0.02 * i, 0.1, 0.4 * i], [0.01 * i, 0, 0.55]) for i in range(6)])
    seq = st.synth.sequence(can.to_mesh(), 6, path, 0.001, seed=9, camera=CAMERA, clutter="wall")
    frames = list(seq)
    out = {}
    for name, start in (("pose", {"poses": path[0]}), ("mask", {"masks": seq.masks(0)[0]})):
        tracker = st.Tracker(can, CAMERA, symmetry=round_and_turned, motion="constant_velocity")
        results = [tracker.start(frames[0], **start)] + [tracker.track(f) for f in frames[1:]]
        out[name] = digest(tracked(results))
    out.update(tracked(results))
    half = st.find_symmetries(st.SDF.box(SIDES_M, voxels=48))
    turned = geometry.pose([2.0, 1.0, 0.5], [0, 0, 1])
    return {
        **out,
        "found": digest(half.discrete, len(half.continuous)),
        "nearest": digest(half.canonical(turned)),
    }


def free_size() -> Hashes:
    """A cylinder and a box whose size is estimated at the start and refined while they turn."""
    out = {}
    solids = {"cylinder": st.SDF.cylinder(0.045, 0.13, voxels=64), "box": st.SDF.box(SIDES_M, voxels=64)}
    for kind, solid in solids.items():
        path = np.array([geometry.pose([0.7 + 0.06 * i, 0.3, 0.05 * i], [0, 0, 0.6]) for i in range(8)])
        seq = st.synth.sequence(solid.to_mesh(), 8, path, 0.001, seed=3, camera=CAMERA, clutter="wall")
        frames, tracker = list(seq), st.Tracker(st.Primitive(kind, voxels=64), CAMERA)
        results, sizes = [tracker.start(frames[0], masks=seq.masks(0)[0])], []
        for frame in frames[1:]:
            results.append(tracker.track(frame))
            sizes += [[list(fit.size.values()), fit.covariance, fit.rms] for fit in tracker.sizes if fit]
        out[kind], out[f"{kind} sizes"] = digest(tracked(results)), digest(sizes)
    return out


def files() -> Hashes:
    """A sequence saved in every layout and read again, then played as if it came from a camera."""
    box = st.SDF.box(SIDES_M, voxels=64)
    seq = st.synth.sequence(box.to_mesh(), 4, None, 0.001, seed=2, camera=CAMERA, clutter="wall")
    out = {}
    with tempfile.TemporaryDirectory() as folder:
        for layout in ("bop", "tum", "open3d"):
            place = Path(folder) / layout
            st.save_sequence(place, seq, layout=layout)
            with st.open_sequence(place) as again:
                frames = list(again)
                out[layout] = digest(
                    [f.depth for f in frames], [f.color for f in frames], again.camera.depth.K
                )
        tracker, results = st.Tracker(box, CAMERA), []
        with st.open_camera(f"replay:{Path(folder) / 'bop'}", fps=float("inf")) as live:
            for frame in live:
                frame = frame.replace(timestamp=len(results) / 30)  # not the clock's, which may jump
                results.append(
                    tracker.track(frame) if results else tracker.start(frame, seq.ground_truth[0][0])
                )
    by_time = ("twists",)  # of the clock of today
    return {**out, **{k: v for k, v in tracked(results).items() if k not in by_time}}


SYNTHETIC = (click, anywhere, symmetric, free_size, files)
RECORDED = ()
