# SPDX-License-Identifier: MIT
"""What the named numbers of voxels cost and give, and what a mesh loses with its faces."""

from __future__ import annotations

import itertools
import time
from pathlib import Path
from typing import Any

import numpy as np

import sdftrack as st
from experiments.common.protocol import load_mesh, say
from experiments.reconstruction.reconstruction import TRUTH_VOXELS
from experiments.registry import experiment
from experiments.table import Table
from experiments.thesis.measures.rebuilt import rebuild
from experiments.thesis.measures.seen_part import Truth, compare
from sdftrack.geometry import inverse
from sdftrack.synth.trajectories import orbit

__all__ = ["presets"]

SEED = 1
SENSORS = {"0.7 m, 1 mm": (0.7, 0.001), "0.35 m, 0.2 mm": (0.35, 0.0002)}  # away, noise
PRESETS = ("quick", "normal", "fine")
FACES = (None, 50_000, 20_000, 5000, 2000, 500)


@experiment(
    "reconstruction.presets",
    needs=["meshes"],
    chosen_on="nothing: the numbers of voxels were given",
    reported_on="lm_cat, spot; seed 1",
    short={"only": ("spot",), "frames": 3, "voxels": ("quick",)},
)
def presets(
    *,
    data: Path,
    only: tuple[str, ...] = ("lm_cat", "spot"),
    voxels: tuple[str, ...] = PRESETS,
    frames: int = 150,
    threads: int = 0,
) -> list[Table]:
    """One turn of an object on a turntable, with each of the named numbers of voxels; then meshes with fewer faces.

    Parameters
    ----------
    only
        meshes that are turned
    voxels
        names; the meshes with fewer faces are of the last but one, from far away
    """
    rows, fewer = [], []
    for name, (sensor, (away_m, noise_m)) in itertools.product(only, SENSORS.items()):
        mesh = load_mesh(data, name)
        path = orbit(distance_m=away_m, turns=1.0, elevation_rad=0.5)
        seq = st.synth.sequence(mesh, frames, path, noise_m, seed=SEED, clutter="wall", threads=threads)
        poses = np.array([seq.ground_truth[i][0] for i in range(frames)])
        truth = Truth.of(
            mesh, st.SDF.from_mesh(mesh, voxels=TRUTH_VOXELS, holes="close", unit="m"), seq.camera, poses
        )
        for which in voxels:
            star = st.Reconstructor(seq.camera, voxels=which, threads=threads)
            live = rebuild(star, seq, None, frames)
            own_true = inverse(live.poses[0]) @ poses[0]
            found = compare(star.mesh().transformed(inverse(own_true)), truth)
            begin = time.perf_counter()
            star.refine()
            seconds = time.perf_counter() - begin
            refined = compare(star.mesh().transformed(inverse(own_true)), truth)
            numbers = [
                1e3 * star.shape.voxel_size, 1e3 * live.seconds[0], 1e3 * np.median(live.seconds[1:]), seconds,
                live.peak_mb, 1e3 * found.chamfer_m, 1e3 * refined.chamfer_m, 100 * refined.complete,
            ]  # fmt: skip
            digits = (2, 0, 0, 1, 0, 2, 2, 1)
            cells = [f"{x:.{d}f}" for x, d in zip(numbers, digits, strict=True)]
            rows.append([f"{name}, {sensor}, {which}", str(star.voxels), *cells])
            say("  ".join(rows[-1]))
            if which == voxels[max(0, len(voxels) - 2)] and sensor == next(iter(SENSORS)):
                fewer += _with_fewer_faces(name, star, truth, inverse(own_true))
    head = ["case", "voxels", "voxel_mm", "first_ms", "ms", "refine_s", "peak_MB", "chamfer_mm", "refined_mm",
            "within_3mm_%"]  # fmt: skip
    faces_head = ["case", "faces", "closed", "off_mm", "off_max_mm", "chamfer_mm", "within_3mm_%", "s"]
    return [
        Table(f"one turn in {frames} frames", head, rows),
        Table("refined meshes with fewer faces", faces_head, fewer),
    ]


def _with_fewer_faces(name: str, star: Any, truth: Truth, T: Any) -> list[list[str]]:
    whole, rows = star.mesh(), []
    for count in FACES:
        begin = time.perf_counter()
        mesh = whole if count is None else whole.decimated(count)
        seconds = time.perf_counter() - begin
        off = mesh._rays.closest(whole.vertices)[0]
        c = compare(mesh.transformed(T), truth)
        closed = "yes" if mesh.to_trimesh().is_watertight else "no"
        rows.append([
            f"{name}, {'all' if count is None else count}", str(len(mesh.faces)), closed, f"{1e3 * off.mean():.3f}",
            f"{1e3 * off.max():.2f}", f"{1e3 * c.chamfer_m:.2f}", f"{100 * c.complete:.1f}", f"{seconds:.2f}",
        ])  # fmt: skip
        say("  ".join(rows[-1]))
    return rows
