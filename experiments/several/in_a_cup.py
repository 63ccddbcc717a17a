# SPDX-License-Identifier: MIT
"""Figure 5.10: a ball carried in a cup, held by the collision term alone."""

from __future__ import annotations

from typing import Any

import numpy as np

import sdftrack as st
from experiments.pictures import images
from experiments.registry import experiment
from experiments.several.look_alikes import PRINTED, options_of
from experiments.synth.cup import CAMERA, PLAY_M, carried
from experiments.table import Table

WAYS: dict[str, dict[str, Any]] = {
    "joint": {},
    "joint, printed collision": {"collision": "printed"},
    "joint" + PRINTED: options_of("joint" + PRINTED),
    "joint, five frames only": {"carried_frames": 5},
    "no collision": {"collision": None},
}
COLUMNS = 6
HALF_PX = 45


@experiment("thesis.5.10", chosen_on="nothing", reported_on="a rendered cup, 30 frames", short={"frames": 12})
def in_a_cup(*, frames: int = 30) -> Table:
    """Figure 5.10: a ball in a cup that is carried, turned and tilted; of the ball nothing is ever seen.

    Depth with 1 mm of noise, the ball has 7 mm of play. Printed: a film strip of a recording in which the ball keeps
    its place without depth, by the collision term alone. "sd across" is what the tracker states across the cup.
    """
    scene = carried(frames)
    shown = set(np.linspace(0, frames - 1, COLUMNS).astype(int).tolist())
    rows: list[dict[str, Any]] = []
    pictures: dict[str, list[tuple[str, Any]]] = {}
    balls: dict[tuple[int, int], Any] = {}
    for way, options in WAYS.items():
        tracker = st.Tracker(list(scene.shapes), CAMERA, **options)
        strip: list[tuple[str, Any]] = []
        off, status, sd = [], [], 0.0
        for i, (frame, truth) in enumerate(zip(scene.frames, scene.poses, strict=True)):
            result = tracker.track(frame) if i else tracker.start(frame, poses=truth)
            off.append([1e3 * float(st.metrics.pose_error(result.poses[k], truth[k])[0]) for k in range(2)])
            status.append(str(result.status[1]))
            sd = 1e3 * float(np.sqrt(result.covariances[1][0, 0]))
            if i in shown:
                picture, balls[len(rows), len(strip)] = _around_the_cup(scene, result, i)
                strip.append((f"frame {i}" if not pictures else "", picture))
        placed = [o[1] for o, s in zip(off, status, strict=True) if s != "lost"]
        rows.append({
            "way": way, "cup": max(o[0] for o in off), "ball": max(placed), "lost": status.count("lost"), "sd": sd,
        })  # fmt: skip
        pictures[way] = strip
    columns = {"way": "way", "cup, max mm": "cup:.2f", "ball, max mm": "ball:.2f", "ball lost": "lost:d"}
    return Table.of(
        f"Figure 5.10, {frames} frames, {1e3 * PLAY_M:.0f} mm of play",
        {**columns, "sd across, mm": "sd:.1f"},
        rows,
        picture=lambda: images(pictures, 1.9, balls),
    )


def _around_the_cup(scene: Any, result: Any, i: int) -> tuple[Any, Any]:
    """The frame with the cup, and the pixels behind which the ball is said to be."""
    drawn = st.draw(scene.frames[i], result, list(scene.shapes), CAMERA)
    inside = np.asarray(scene.shapes[1].silhouette(CAMERA, result.poses[1])) > 0
    u, v = (round(float(c)) for c in CAMERA.project(result.poses[0][:3, 3]))
    window = (slice(max(0, v - HALF_PX), v + HALF_PX), slice(max(0, u - HALF_PX), u + HALF_PX))
    return drawn[window], inside[window]
