# SPDX-License-Identifier: MIT
"""Figures 5.11 and 5.12: two look-alikes tracked by one model, reconstructed from a recording of one of them."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.samples import COLUMNS, evenly
from experiments.common.tracked_scene import WRONG_M, WRONG_RAD
from experiments.progress import step
from experiments.registry import experiment
from experiments.several.identity import Tracked
from experiments.several.judged import errors
from experiments.several.look_alikes import PRINTED, options_of
from experiments.several.strips import Strip, counts, strip_table
from experiments.synth import several as scenes
from experiments.synth.contact import Solid
from experiments.table import Table
from sdftrack import geometry

WAYS = ("joint", "joint" + PRINTED, "single" + PRINTED)
SEEN = 0.5
TRUTH_VOXELS = 160
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inexact:
    """A reconstructed shape, the motion from its frame to the true object's, and its distance (mm) from the truth."""

    shape: Any
    T_true_own: Array
    seen: float  # share of its surface that a frame has shown
    off_mm: float  # median over that share
    guessed_mm: float  # and over the rest

    def own(self, poses: Array) -> Array:
        """Poses (..., 4, 4) of this model for true ones."""
        out: Array = poses @ self.T_true_own
        return out

    def true(self, poses: Array) -> Array:
        """And back."""
        out: Array = poses @ geometry.inverse(self.T_true_own)
        return out

    @property
    def note(self) -> str:
        return (
            f"The model: {self.off_mm:.1f} mm (median) from the true surface where it was seen, "
            f"{100 * self.seen:.0f} % of it, and {self.guessed_mm:.1f} mm where it was not."
        )


def reconstructed(seq: Any, k: int, voxels: int, threads: int) -> Inexact:
    """Instance k of a recording, from its mask in frame 0, over all frames."""
    star = st.Reconstructor(seq.camera, voxels=voxels, threads=threads)
    T_true_own = geometry.inverse(seq.ground_truth[0][k]) @ star.start(seq[0], mask=seq.masks(0)[k]).pose
    for i in range(1, len(seq)):
        star.track(seq[i])
        step(i + 1, len(seq), "reconstruct")
    mesh = star.mesh()
    truth = st.SDF.from_mesh(next(iter(seq.models.values())), voxels=TRUTH_VOXELS)
    off = 1e3 * np.abs(truth(geometry.transform_points(T_true_own, mesh.vertices)))
    own = np.asarray(mesh.seen) >= SEEN
    rest = float(np.median(off[~own])) if (~own).any() else 0.0
    shape = star.shape
    bare = st.SDF(shape.values, shape.voxel_size, shape.origin)  # without the recording's colours
    return Inexact(bare, T_true_own, float(own.mean()), float(np.median(off[own])), rest)


@experiment(
    "thesis.5.11",
    needs=["k1"],
    chosen_on="nothing",
    reported_on="k1",
    short={"frames": 200, "voxels": 60},
)
def hands(*, data: Path, frames: int = 250, voxels: int = 200, threads: int = 0) -> Table:
    """Figure 5.11: two look-alikes that interact, both by one reconstructed, inexact model.

    The thesis tracks two hands of a fixed gesture; no such recording is at hand: two sponges in hands. The left one is
    reconstructed from its mask in the first frame over the recording; its shape is then the model of both, in all
    frames, from their reference poses in the first one. "at references": the largest distance from the reference poses
    of frames 46 to 98. Printed: the models do not fit, yet the tracker recovers the poses of both.
    """
    rows: list[dict[str, Any]] = []
    with st.open_sequence(data / "k1") as seq:
        model = reconstructed(seq, 0, voxels, threads)
        truth = {i: np.array([T for _, T in sorted(found.items())]) for i, found in seq.ground_truth.items()}
        strip = Strip([model.shape] * 2, seq.camera, seq, evenly(frames, COLUMNS, int(0.3 * frames)))
        for way in WAYS:
            first = not rows
            options = {"mode": "rgbd", "threads": threads, "membership": first, **options_of(way)}
            tracked = strip.run(way, model.own(truth[0]), way.removesuffix(PRINTED), options, first)
            judged = [i for i in truth if 0 < i < frames and len(truth[i]) == 2]
            metres, radians = errors(model.true(tracked.poses[judged]), np.array([truth[i] for i in judged]))
            off = {"mm": 1e3 * float(metres.max()), "deg": float(np.rad2deg(radians.max()))}
            rows.append({**counts(way, tracked), **off})
    more = {"at references mm": "mm:.1f", "deg": "deg:.1f"}
    return strip_table("Figure 5.11", rows, strip, more, [model.note])


@experiment(
    "thesis.5.12",
    needs=["mustard0"],
    chosen_on="nothing",
    reported_on="mustard0, and two copies of its model on a synthetic path, seed 0",
    short={"frames": 250, "voxels": 60},
)
def shoes(*, data: Path, frames: int = 400, voxels: int = 200, threads: int = 0) -> Table:
    """Figure 5.12: two look-alikes by an inexact model that is nearly round about its long axis, one mostly hidden.

    The thesis tracks two shoes; no such recording is at hand. The bottle of `mustard0` is reconstructed from the
    recording, of which the robot shows a part of the surface; two copies of its true model, in one colour, then circle
    each other, in contact and one before the other (depth and colour, 1 mm and 5 grey levels), and are tracked by the
    reconstruction from their true poses. A frame is wrong where an object is 20 mm or 10 degrees off. Printed: two
    failures, a turn about the long axis and a shoe that is mostly hidden, from which the tracker recovers by itself.
    """
    with st.open_sequence(data / "mustard0") as seq:
        model = reconstructed(seq, 0, voxels, threads)
        mesh = next(iter(seq.models.values()))
    solid = Solid.of(mesh, st.SDF.from_mesh(mesh, voxels=voxels))
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as cache:
        scene = scenes.meetings(mesh, solid, frames, 0, Path(cache), color=True, threads=threads)
        strip = Strip([model.shape] * 2, scene.camera, scene, evenly(frames, COLUMNS, frames // 8))
        for way in WAYS:
            first = not rows
            options = {"mode": "rgbd", "threads": threads, "membership": first, **options_of(way)}
            tracked = strip.run(way, model.own(scene.poses[0]), way.removesuffix(PRINTED), options, first)
            rows.append({**counts(way, tracked), **_spells(model, tracked, scene.poses)})
    columns = {name: f"{name}:d" for name in ("wrong", "failures", "recovered")}
    columns |= {"at the end mm": "mm:.1f", "deg": "deg:.1f"}
    return strip_table("Figure 5.12", rows, strip, columns, [model.note])


def _spells(model: Inexact, tracked: Tracked, truth: Array) -> dict[str, Any]:
    """Frames with a wrong pose, how often an object became wrong, and how often it was right again; the end."""
    metres, radians = errors(model.true(tracked.poses), truth[: len(tracked.poses)])
    wrong = ~((metres < WRONG_M) & (radians < WRONG_RAD))
    began = np.count_nonzero(wrong[1:] & ~wrong[:-1])
    ended = np.count_nonzero(~wrong[1:] & wrong[:-1])
    end = {"mm": 1e3 * float(metres[-1].max()), "deg": float(np.rad2deg(radians[-1].max()))}
    return {"wrong": int(wrong.any(axis=1).sum()), "failures": int(began), "recovered": int(ended), **end}
