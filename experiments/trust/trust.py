# SPDX-License-Identifier: MIT
"""What status, confidence and covariance are worth, measured: the tables of docs/trust.md.

python -m sdftrack.eval.trust coverage --data DATA   # how often the 95 % ellipsoid holds the truth
python -m sdftrack.eval.trust recorded --data DATA   # the same against recorded sequences' references
python -m sdftrack.eval.trust sensor --data DATA     # noise over distance, and its reach between pixels
python -m sdftrack.eval.trust auc --data DATA        # right poses against wrong ones, by confidence
python -m sdftrack.eval.trust absent --data DATA     # an object that is not there
python -m sdftrack.eval.trust fit --data DATA        # the weights of cpp/tracking/trust.cpp
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Callable
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np

from experiments.trust import absent
from experiments.trust import confidence
from experiments.trust import coverage
from sdftrack.evaluation.tracked_scene import load_sdf
from sdftrack.evaluation.pose_errors import parse_settings
from experiments.tracking.synthetic import MESHES
from sdftrack.reproduce.scenes.truth import default_camera, motion, render_truth

__all__ = ["main"]

# Changing these numbers breaks comparisons with docs/trust.md.
STEP_M, STEP_RAD, TRUTH_FRAMES = 0.005, np.deg2rad(1.5), 300
SCENES, TRAIN_SEED, TEST_SEED = 75, 1, 2
TRAIN, TEST = ("lm_cat", "lm_can", "lm_driller", "spot"), ("lm_ape", "lm_duck", "lm_glue", "bunny")
LOOKALIKES = 100
VOXELS = 200
ABSENT_TRIALS, ABSENT_TRAIN, ABSENT_TEST, ABSENT_TRAIN_SEED = 50, 120, 0, 7
# A pose that is right though disturbed is nothing that a tracker returns; a false find is worse than a missed one.
WEIGHT_RIGHT_DISTURBED, WEIGHT_ABSENT = 0.15, 2.0


def occluders() -> tuple[Any, ...]:
    """Nothing (twice), a hand in front, fingers around it, and a hand over half of it."""
    from sdftrack import synth

    return (None, None, synth.Hand(0.3), synth.Grip(0.3), synth.Hand(0.5))


def volume(data: Path, name: str, cache: Path | None) -> tuple[Any, Any]:
    """(mesh, SDF of 200 voxels) of DATA/meshes."""
    import sdftrack as st

    mesh = st.Mesh.load(data / "meshes" / f"{name}.ply")
    return mesh, load_sdf(mesh, name, VOXELS, cache)


def run_coverage(a: argparse.Namespace, say: Callable[[str], None]) -> str:
    """Table of the synthetic coverage."""
    camera, rows = default_camera(), {}
    options = {"threads": a.threads, **parse_settings(a.set)}
    for name in MESHES:
        mesh, sdf = volume(a.data, name, a.cache)
        centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
        truths = [
            render_truth(
                mesh, motion(TRUTH_FRAMES, STEP_M, STEP_RAD, seed, centre), camera, a.threads, a.cache
            )
            for seed in range(a.seeds)
        ]
        for sigma in (0.001, 0.00316):
            key = f"{name} {1e3 * sigma:.2f} mm"
            rows[key] = coverage.synthetic_coverage(sdf, truths, sigma, options, a.frames)
            say(coverage.format_coverage({key: rows[key]}).split("\n")[1])
    return coverage.format_coverage(rows)


def run_recorded(a: argparse.Namespace, say: Callable[[str], None]) -> str:
    """Table of the recorded coverage."""
    options = {"threads": a.threads, **parse_settings(a.set)}
    return coverage.format_coverage(coverage.run_recorded(a.data, options))


def run_sensor(a: argparse.Namespace, say: Callable[[str], None]) -> str:
    """Tables of the sensors' noise."""
    from experiments.trust.sensor import run_sensor

    return run_sensor(a.data, a.threads)


def _synthetic(
    a: argparse.Namespace, names: Seq[str], seed: int, say: Callable[[str], None]
) -> list[confidence.Sample]:
    out = []
    for name in names:
        mesh, sdf = volume(a.data, name, a.cache)
        out += confidence.synthetic(name, mesh, sdf, a.scenes, seed, occluders(), a.threads)
        say(f"{name}: {len(out)} poses so far")
    return out


def run_auc(a: argparse.Namespace, say: Callable[[str], None]) -> str:
    """Areas under ROC, by the kind of wrong pose."""
    import sdftrack as st

    groups = {"synthetic": _synthetic(a, TEST, TEST_SEED, say)}
    with st.open_sequence(a.data / "k1") as seq:
        sdf = st.SDF.from_mesh(next(iter(seq.models.values())))
        groups["k1"] = confidence.recorded(seq, sdf, 0, 20, 10, threads=a.threads)
    with st.open_sequence(a.data / "ycbv10") as seq:
        groups["ycbv10 brick"] = confidence.recorded(
            seq, st.SDF.from_mesh(seq.models[3]), 0, 10, 10, only=[2], threads=a.threads
        )
    if a.json is not None:
        rows = {g: [[s.kind, s.right, s.confidence] for s in many] for g, many in groups.items()}
        a.json.write_text(json.dumps(rows))
    return "\n".join(confidence.format_areas(name, many) for name, many in groups.items())


def run_absent(a: argparse.Namespace, say: Callable[[str], None]) -> str:
    """Counts of the statuses that absent objects end with."""
    sdfs = {name: volume(a.data, name, a.cache)[1] for name in absent.MODELS}
    scenes = list(absent.osd_scenes(a.data / "osd"))
    lines = []
    for how, trials in (("put at random", absent.placed), ("searched for", absent.searched)):
        samples = trials(scenes, sdfs, a.trials, ABSENT_TEST, threads=a.threads)
        count = {s: sum(x.said["status"] == s for x in samples) for s in ("lost", "weak", "ok")}
        sure = sum(x.confidence > 0.5 for x in samples)
        lines.append(f"{how}: {len(samples)} trials, {count}, confidence above 0.5: {sure}")
        say(lines[-1])
    return "\n".join(lines)


def run_fit(a: argparse.Namespace, say: Callable[[str], None]) -> str:
    """The weights, in the order of `Weights` in cpp/tracking/trust.cpp."""
    samples = _synthetic(a, TRAIN, TRAIN_SEED, say)
    sdfs = {name: volume(a.data, name, a.cache)[1] for name in absent.MODELS}
    scenes = list(absent.osd_scenes(a.data / "osd"))
    samples += absent.placed(scenes, sdfs, ABSENT_TRAIN, ABSENT_TRAIN_SEED, credulous=True, threads=a.threads)
    samples += confidence.lookalikes(LOOKALIKES, TRAIN_SEED, a.threads)
    if a.json is not None:
        rows = [[s.kind, s.right, *confidence.features(s.said).tolist()] for s in samples if s.said]
        a.json.write_text(json.dumps(rows))
    known = [s for s in samples if "agree" in s.said]
    right = np.array([s.right for s in known])
    kinds = np.array([s.kind for s in known])
    weight = np.where(right & (kinds == "disturbed"), WEIGHT_RIGHT_DISTURBED, 1.0)
    weight[kinds == "absent"] = WEIGHT_ABSENT
    x = np.array([confidence.features(s.said) for s in known])
    slopes, constant = confidence.fit_weights(x, right, weight)
    named = [f"{name} {w:.2f}" for name, w in zip(confidence.FEATURES, slopes, strict=True)]
    return f"{len(known)} poses, {right.sum()} right: constant {constant:.2f}, " + ", ".join(named)


COMMANDS: dict[str, Callable[[argparse.Namespace, Callable[[str], None]], str]] = {
    "coverage": run_coverage,
    "recorded": run_recorded,
    "sensor": run_sensor,
    "auc": run_auc,
    "absent": run_absent,
    "fit": run_fit,
}


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m sdftrack.eval.trust", description=(__doc__ or "").split("\n")[0]
    )
    p.add_argument("what", choices=list(COMMANDS))
    p.add_argument("--data", type=Path, required=True, help="folder with meshes/, k1/, ycbv10/, osd/")
    p.add_argument("--cache", type=Path, help="folder that keeps volumes and noise-free images between runs")
    p.add_argument("--seeds", type=int, default=3, help="coverage: sequences of each mesh")
    p.add_argument("--frames", type=int, default=100, help="coverage: frames of each sequence")
    p.add_argument("--scenes", type=int, default=SCENES, help="auc, fit: scenes of each mesh")
    p.add_argument("--trials", type=int, default=ABSENT_TRIALS, help="absent: trials of each way")
    p.add_argument("--threads", type=int, default=1)
    p.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE", help="coverage, recorded")
    p.add_argument("--json", type=Path, help="auc: every pose's kind, whether it is right, its confidence")
    return p


def main(arguments: Seq[str] | None = None) -> int:
    """Run one protocol and print its table."""
    a = _parser().parse_args(arguments)
    warnings.simplefilter("ignore")

    def say(text: str) -> None:
        print(f"# {text}", file=sys.stderr, flush=True)

    print(COMMANDS[a.what](a, say))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
