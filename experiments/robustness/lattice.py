# SPDX-License-Identifier: MIT
"""Depth with a lattice of holes, as of a registration by warping, against the same depth without."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np

import sdftrack as st
from experiments.calibration.intrinsics import UNIT
from experiments.common.protocol import load_mesh, say
from experiments.common.sweeps import START, TRUTH, box_mesh, swept, values_of
from experiments.reconstruction.rebuilt import relative_errors
from experiments.reconstruction.reconstruction import DISTANCE_M, PARTS, path_of
from experiments.registry import experiment
from experiments.table import Table

EVERY = (3, 4, 5)
NOISES: tuple[Any, ...] = (0.001, "kinect")
PATHS: tuple[Any, ...] = (
    st.synth.orbit(distance_m=DISTANCE_M, turns=0.25, elevation_rad=0.5),
    path_of("hand"),
)
CALIBRATION_VOXELS = 200
COLUMNS = {
    "entry, 1 of n missing": "name",
    "runs": "runs:d",
    "mean error": "error:.3f",
    "unit": "unit",
    "by holes %": "more:+.0f",
    "by missing %": "limit:+.0f",
    "median by holes %": "median:+.0f",
    "ok %": "ok:.1f",
    "in 95 %": "inside:.0f",
}
Case = dict[
    str, Any
]  # of one run: error, ok, and of a calibration how many of its 95 % intervals hold the truth


def holed(frame: st.Frame, every: int) -> st.Frame:
    """The frame without every so-many-th row and column of its depth; 0: as it is."""
    if not every or frame.depth is None:
        return frame
    depth = frame.depth.copy()
    depth[::every] = depth[:, ::every] = 0
    return st.Frame(depth, frame.color, frame.timestamp, index=frame.index)


def scenes(data: Path, part: str, seeds: int, frames: int) -> Iterator[tuple[Any, Any]]:
    """(mesh, sequence) of each mesh of the part, path, noise and seed."""
    meshes, first = PARTS[part]
    for seed in range(first, first + seeds):
        for noise in NOISES:
            for path in PATHS:
                for name in meshes:
                    mesh = load_mesh(data, name)
                    yield (
                        mesh,
                        st.synth.sequence(mesh, frames, path, noise, seed=seed, clutter="wall"),
                    )


def followed(star: Any, seq: Any, mesh: Any, frames: list[st.Frame], truth: Any) -> Case:
    """Error of the rotation, relative to the first frame, degrees; share of the frames that are ok."""
    found = [star.start(frames[0], mask=seq.masks(0)[0]), *map(star.track, frames[1:])]
    errors = relative_errors(np.array([r.poses[0] for r in found]), truth, mesh.bounds.mean(axis=0))
    return {
        "error": float(np.rad2deg(errors.radians).mean()),
        "ok": 100 * float(np.mean([r.status[0] == "ok" for r in found])),
    }


def poses(make: Callable[[Any, Any], Any], scene: tuple[Any, Any]) -> Iterator[Case]:
    """A tracker or a reconstructor, made from mesh and camera, with each lattice."""
    mesh, seq = scene
    frames = [seq[i] for i in range(len(seq))]
    truth = np.array([seq.ground_truth[i][0] for i in range(len(seq))])
    for every in (0, *EVERY):
        yield followed(make(mesh, seq.camera), seq, mesh, [holed(f, every) for f in frames], truth)


def fits(seed: int) -> Iterator[Case]:
    """Radius (mm) of a can in three frames, and of the wall behind it the distance in its middle (mm)."""
    can = st.SDF.cylinder(0.035, 0.12, voxels=160).to_mesh()
    seq = st.synth.sequence(can, 3, noise=0.001, seed=seed, clutter="wall")
    for every in (0, *EVERY):
        found = [
            st.fit_primitive(holed(seq[i], every), "cylinder", camera=seq.camera, mask=seq.masks(i)[0])
            for i in range(len(seq))
        ]
        yield {
            "error": float(np.mean([1e3 * abs(f.size["radius"] - 0.035) for f in found])),
            "ok": 100 * float(np.mean([f.status == "ok" for f in found])),
        }


def planes(seed: int) -> Iterator[Case]:
    """Direction of a wall (degrees) against that found without noise and holes."""
    duck = st.synth.duck_mesh()
    clean, seq = (st.synth.sequence(duck, 1, noise=n, seed=seed, clutter="wall") for n in (None, "kinect"))
    true = st.remove_plane(clean[0], seq.camera)[1][0]
    for every in (0, *EVERY):
        normal = st.remove_plane(holed(seq[0], every), seq.camera)[1][0]
        yield {"error": float(np.rad2deg(np.linalg.norm(np.cross(normal, true)))), "ok": None}


def calibrations(path: int, draw: int, frames: int, cache: Path | None) -> Iterator[Case]:
    """Focal length (%, mean of both) of a swept cube."""
    mesh, truth = box_mesh(), values_of(TRUTH)
    seq = swept(mesh, frames, 0.001, path, draw, cache=cache)
    sdf = st.SDF.from_mesh(mesh, voxels=CALIBRATION_VOXELS)
    seen = [seq[i] for i in range(frames)]
    for every in (0, *EVERY):
        found = st.calibrate_intrinsics([holed(f, every) for f in seen], sdf, START, seq.ground_truth[0][0])
        inside = (found.interval95[:, 0] <= truth) & (truth <= found.interval95[:, 1])
        yield {
            "error": float(np.abs((found.values - truth) / UNIT)[:2].mean()),
            "ok": 100.0 * (found.status == "ok"),
            "inside": 100 * float(inside.mean()),
        }


def rows_of(entry: str, unit: str, runs: list[list[Case]]) -> Iterator[Case]:
    """A row for each lattice, over all runs."""
    errors = np.array([[case["error"] for case in run] for run in runs])
    for k, every in enumerate((0, *EVERY)):
        row = {"name": f"{entry}, {every or 'none'}", "runs": len(runs), "unit": unit}
        row["error"] = float(errors[:, k].mean())
        if every:
            row["limit"] = 100 * (every / (every - 1) - 1)  # square root of the measurements over those left
            row["more"] = 100 * float(errors[:, k].mean() / errors[:, 0].mean() - 1)
            row["median"] = 100 * float(np.median(errors[:, k] / errors[:, 0]) - 1)
        for key in ("ok", "inside"):
            if runs[0][k].get(key) is not None:
                row[key] = float(np.mean([run[k][key] for run in runs]))
        yield row


@experiment(
    "lattice",
    needs=["meshes"],
    chosen_on="part choose: lm_cat, lm_duck, lm_can, lm_driller, spot, seed 1; the cube, paths 1 and 2, draws 0 and 1",
    reported_on="part report: bunny, lm_ape, lm_glue, from seed 11 on; the cube, paths 1 and 2, draws from 2 on",
    short={"only": "planes", "seeds": 1},
)
def lattice(
    *,
    data: Path,
    part: Literal["choose", "report"] = "report",
    only: str = "",
    seeds: int = 2,
    frames: int = 50,
    voxels: int = 100,
    cache: Path | None = None,
) -> Table:
    """Depth of which every third, fourth or fifth row and column is missing, against the same depth without holes.

    "track" and "reconstruct" are rendered objects before a wall, 0.7 m away, on two paths, with 1 mm and with a
    Kinect's noise; "fit" is a can, "planes" the wall, "calibrate" a cube swept through the image with 1 mm of noise.
    "by holes" compares the mean errors of all runs, "median by holes" is the median over the runs, each with its own;
    "by missing" is what independent errors grow by where so many measurements are missing.

    Parameters
    ----------
    part
        which meshes and seeds
    only
        the entries whose name contains this text
    seeds
        of each object, path and noise; eight times as many of "fit" and "planes"; draws of "calibrate"
    """
    first, draw = PARTS[part][1], 0 if part == "choose" else 2
    many = range(100 * first, 100 * first + 8 * seeds)

    def track(mesh: Any, camera: Any) -> Any:
        return st.Tracker(st.SDF.from_mesh(mesh, voxels=voxels), camera, mode="rgbd")

    def reconstruct(_: Any, camera: Any) -> Any:
        return st.Reconstructor(camera, voxels=voxels, mode="rgbd")

    def seen(make: Callable[[Any, Any], Any]) -> Callable[[], Iterator[Iterator[Case]]]:
        return lambda: (poses(make, scene) for scene in scenes(data, part, seeds, frames))

    entries: dict[str, tuple[str, Callable[[], Iterator[Iterator[Case]]]]] = {
        "track": ("deg", seen(track)),
        "reconstruct": ("deg", seen(reconstruct)),
    }
    entries["fit"] = "mm", lambda: map(fits, many)
    entries["planes"] = "deg", lambda: map(planes, many)
    entries["calibrate"] = (
        "%",
        lambda: (calibrations(p, d, frames, cache) for d in range(draw, draw + seeds) for p in (1, 2)),
    )
    rows: list[Case] = []
    for name, (unit, runs) in entries.items():
        if only in name:
            rows += rows_of(name, unit, [list(run) for run in runs()])
            say("; ".join(f"{r['name']}: {r['error']:.3f} {r['unit']}" for r in rows[-4:]))
    return Table.of(f"Lattices, {part}: {frames} frames, {voxels} voxels", COLUMNS, rows)
