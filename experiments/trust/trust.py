# SPDX-License-Identifier: MIT
"""What status, confidence and covariance are worth, measured: the tables of docs/trust.md."""

from __future__ import annotations

from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import sdftrack as st
from experiments.common.protocol import MESHES, load_mesh, load_sdf, say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table, cells
from experiments.tracking.synthetic import paths
from experiments.trust import absent, confidence, coverage
from experiments.trust import sensor as sensor_noise

# Changing these numbers breaks comparisons with docs/trust.md.
STEP_MM, STEP_DEG, TRUTH_FRAMES = 5.0, 1.5, 300
SCENES, TEST_SEED = 75, 2
TEST = ("lm_ape", "lm_duck", "lm_glue", "bunny")
VOXELS = 200
ABSENT_TRIALS, ABSENT_TEST = 50, 0


def occluders() -> tuple[Any, ...]:
    """Nothing (twice), a hand in front, fingers around it, and a hand over half of it."""
    from sdftrack import synth

    return (None, None, synth.Hand(0.3), synth.Grip(0.3), synth.Hand(0.5))


def volume(data: Path, name: str, cache: Path | None) -> tuple[Any, Any]:
    """(mesh, SDF of 200 voxels) of DATA/meshes."""
    mesh = load_mesh(data, name)
    return mesh, load_sdf(mesh, name, VOXELS, cache)


@experiment(
    "trust.coverage",
    needs=["meshes"],
    chosen_on="the same four meshes",
    reported_on="lm_driller, lm_can, lm_cat, spot; seeds 0 to 2",
    short={"only": ("spot",), "seeds": 1, "frames": 4, "path_frames": 6},
)
def coverage_of_truth(
    *,
    data: Path,
    only: tuple[str, ...] = MESHES,
    seeds: int = 3,
    frames: int = 100,
    path_frames: int = TRUTH_FRAMES,
    threads: int = 1,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> Table:
    """How often the stated 95 % ellipsoid holds the true pose, on rendered sequences.

    Parameters
    ----------
    path_frames
        of the rendered path, of which the first `frames` are tracked
    """
    rows: dict[str, Any] = {}
    for name in only:
        mesh, sdf = volume(data, name, cache)
        truths = paths(mesh, seeds, path_frames, STEP_MM, STEP_DEG, threads, cache)
        for sigma in (0.001, 0.00316):
            key = f"{name} {1e3 * sigma:.2f} mm"
            # The noise alone: renderings have no error that pixels share.
            told = {"threads": threads, "max_systematic_m": 0.0, **options}
            rows[key] = coverage.row(coverage.synthetic_coverage(sdf, truths, sigma, told, frames))
            say("  ".join(cells(coverage.COLUMNS, {"name": key, **rows[key]})))
    return Table.of("Stated covariance against the truth", coverage.COLUMNS, rows)


@experiment(
    "trust.sensor",
    needs=["k1", "ycbv10"],
    chosen_on="nothing is chosen here: the tracker's noise model is",
    reported_on="k1 and ycbv10",
    short={"frames": 2},
)
def sensor(*, data: Path, frames: int = 10, threads: int = 1) -> Table:
    """Noise of recorded depth over distance, and how far its errors reach from pixel to pixel.

    Parameters
    ----------
    frames
        tracked of each object, at most
    """
    return Table("Noise of recorded depth", notes=sensor_noise.lines(data, frames, threads))


def _synthetic(
    data: Path, names: Seq[str], scenes: int, seed: int, threads: int, cache: Path | None
) -> list[confidence.Sample]:
    out = []
    for name in names:
        mesh, sdf = volume(data, name, cache)
        out += confidence.synthetic(name, mesh, sdf, scenes, seed, occluders(), threads)
        say(f"{name}: {len(out)} poses so far")
    return out


@experiment(
    "trust.auc",
    needs=["meshes", "k1", "ycbv10"],
    chosen_on="the poses of `trust.fit`: lm_cat, lm_can, lm_driller, spot, seed 1",
    reported_on="lm_ape, lm_duck, lm_glue, bunny, seed 2; k1; ycbv10's brick",
    short={"only": ("bunny",), "scenes": 1, "recorded": False},
)
def separation(
    *,
    data: Path,
    only: tuple[str, ...] = TEST,
    scenes: int = SCENES,
    recorded: bool = True,
    threads: int = 1,
    cache: Path | None = None,
) -> Table:
    """Correct poses against wrong ones, by confidence: areas under the ROC curve.

    Parameters
    ----------
    scenes
        of each mesh
    recorded
        also the recorded sequences
    """
    groups = {"synthetic": _synthetic(data, only, scenes, TEST_SEED, threads, cache)}
    if recorded:
        with st.open_sequence(data / "k1") as seq:
            sdf = st.SDF.from_mesh(next(iter(seq.models.values())))
            groups["k1"] = confidence.recorded(seq, sdf, 0, 20, 10, threads=threads)
        with st.open_sequence(data / "ycbv10") as seq:
            groups["ycbv10 brick"] = confidence.recorded(
                seq, st.SDF.from_mesh(seq.models[3]), 0, 10, 10, only=[2], threads=threads
            )
    numbers = {g: [[s.kind, s.right, s.confidence] for s in many] for g, many in groups.items()}
    rows = [confidence.area_cells(name, many) for name, many in groups.items()]
    return Table("Confidence of correct and of wrong poses", confidence.AREAS, rows, numbers=numbers)


@experiment(
    "trust.absent",
    needs=["meshes", "osd"],
    chosen_on="the same scenes and models, seed 7 (`trust.fit`)",
    reported_on="osd's scenes with six models that are not in them, seed 0",
    short={"trials": 2},
)
def absent_objects(
    *, data: Path, trials: int = ABSENT_TRIALS, threads: int = 1, cache: Path | None = None
) -> Table:
    """Status and confidence of an object that is not in the scene.

    Parameters
    ----------
    trials
        of each way
    """
    sdfs = {name: volume(data, name, cache)[1] for name in absent.MODELS}
    scenes = list(absent.osd_scenes(data / "osd"))
    rows = []
    for how, made in (("put at random", absent.placed), ("searched for", absent.searched)):
        samples = made(scenes, sdfs, trials, ABSENT_TEST, threads=threads)
        counts = [str(sum(x.said["status"] == s for x in samples)) for s in ("lost", "weak", "ok")]
        sure = sum(x.confidence > 0.5 for x in samples)
        rows.append([how, str(len(samples)), *counts, str(sure)])
        say("  ".join(rows[-1]))
    return Table("Absent objects", ["way", "trials", "lost", "weak", "ok", "confidence above 0.5"], rows)
