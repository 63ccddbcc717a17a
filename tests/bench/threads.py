# SPDX-License-Identifier: MIT
"""What the default number of threads costs and gains: ``python tests/bench/threads.py MESHES [--busy 2]``.

Every case is run with `threads=0` and `threads=1` in turn within one process, so that both meet the same state of the
machine; `--busy N` starts N processes that do nothing but compute. Printed are the median and the 99th percentile of
the times with the default threads, and both as multiples of those on one thread.
"""

from __future__ import annotations

import argparse
import multiprocessing
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import sdftrack as st

sys.path.append(str(Path(__file__).resolve().parents[2]))  # for experiments, which is not installed
from experiments.synth.region_picture import region_picture

CAMERA = st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
# Changing these numbers breaks comparisons.
TRACKED, SEGMENTED, STARTED, REBUILT, COMMANDS = 400, 100, 40, 60, 5
Case = Callable[[int], Callable[[int], object]]  # threads -> round -> anything


def compute() -> None:
    while True:
        sum(range(100_000))


def tracked(mesh: st.Mesh) -> Case:
    shape = st.SDF.from_mesh(mesh, voxels=200)
    seq = st.synth.sequence(mesh, 40, None, 0.001, seed=1, camera=CAMERA, color=False)
    frames, T = [seq[i] for i in range(40)], seq.ground_truth[0][0]

    def case(threads: int) -> Callable[[int], object]:
        tracker = st.Tracker(shape, CAMERA, threads=threads, mode="depth")
        tracker.start(frames[0], poses=T)
        there_and_back = [*range(1, 40), *range(38, 0, -1)]
        return lambda i: tracker.track(frames[there_and_back[i % len(there_and_back)]])

    return case


def started(mesh: st.Mesh) -> Case:
    shape = st.SDF.from_mesh(mesh, voxels=200)
    seq = st.synth.sequence(mesh, 1, None, 0.001, seed=1, camera=CAMERA, color=False)
    frame, mask = seq[0], seq.masks(0)[0]

    def case(threads: int) -> Callable[[int], object]:
        tracker = st.Tracker(shape, CAMERA, threads=threads, mode="depth")
        return lambda i: tracker.start(frame, masks=mask)

    return case


def rebuilt(mesh: st.Mesh) -> Case:
    path = st.synth.orbit(distance_m=0.7, turns=1.0, elevation_rad=0.5)
    seq = st.synth.sequence(mesh, REBUILT + 1, path, 0.001, clutter="wall", seed=1, camera=CAMERA)
    frames, mask = [seq[i] for i in range(REBUILT + 1)], seq.masks(0)[0]

    def case(threads: int) -> Callable[[int], object]:
        star = st.Reconstructor(CAMERA, threads=threads)
        star.start(frames[0], mask=mask)
        return lambda i: star.track(frames[1 + i])

    return case


def segmented(_: st.Mesh) -> Case:
    image = region_picture(480, 640)[0]
    return lambda threads: lambda i: st.superpixels.slic(image, 1200, threads=threads)


def command(mesh: st.Mesh) -> Case:
    kept = tempfile.TemporaryDirectory()
    folder = Path(kept.name)
    seq = st.synth.sequence(mesh, 60, None, 0.001, seed=1, camera=CAMERA, color=False)
    st.save_sequence(folder / "seq", seq, layout="bop")
    mesh.save(folder / "model.ply")

    def case(threads: int) -> Callable[[int], object]:
        line = [sys.executable, "-m", "sdftrack", "track", str(folder / "seq"), "--model", str(folder / "model.ply"),
                "--init", "gt", "--no-video", "--quiet", "--overwrite", "--threads", str(threads),
                "--out", str(folder / f"out{threads}")]  # fmt: skip
        return lambda i, _kept=kept: subprocess.run(line, check=True)  # the folder lives as long as this does

    return case


CASES: dict[str, tuple[Callable[[st.Mesh], Case], int]] = {
    "a tracked frame, depth": (tracked, TRACKED),
    "superpixels 640x480": (segmented, SEGMENTED),
    "start from a mask": (started, STARTED),
    "reconstruction frame": (rebuilt, REBUILT),
    "sdftrack track, 60 frames": (command, COMMANDS),
}


def times(case: Case, rounds: int) -> dict[int, np.ndarray]:
    """Seconds of each round, by the number of threads asked for."""
    runs = {threads: case(threads) for threads in (0, 1)}
    seconds: dict[int, list[float]] = {0: [], 1: []}
    for i in range(rounds):
        for threads in (0, 1) if i % 2 else (1, 0):
            begin = time.perf_counter()
            runs[threads](i)
            seconds[threads].append(time.perf_counter() - begin)
    warm = min(3, rounds - 2)
    return {threads: 1e3 * np.array(s[warm:]) for threads, s in seconds.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", type=Path, help="folder with lm_driller.ply")
    parser.add_argument("--busy", type=int, default=0, help="processes that compute meanwhile")
    parser.add_argument("--only", default="", help="part of a case's name")
    given = parser.parse_args()
    mesh = st.Mesh.load(given.meshes / "lm_driller.ply")
    others = [multiprocessing.Process(target=compute, daemon=True) for _ in range(given.busy)]
    print(f"{given.busy} busy processes; threads=0 is {st.info()['threads']} threads; ms")
    print(f"{'':28}{'median':>9}{'p99':>9}{'median / 1 thread':>20}{'p99 / 1 thread':>17}")
    for name, (make, rounds) in CASES.items():
        if given.only not in name:
            continue
        case = make(mesh)
        for process in others:
            if not process.is_alive():
                process.start()
        took = times(case, rounds)
        at = {threads: np.percentile(ms, (50, 99)) for threads, ms in took.items()}
        ratio = at[0] / at[1]
        print(f"{name:28}{at[0][0]:9.3f}{at[0][1]:9.3f}{ratio[0]:20.2f}{ratio[1]:17.2f}", flush=True)
    for process in others:
        process.terminate()


if __name__ == "__main__":
    main()
