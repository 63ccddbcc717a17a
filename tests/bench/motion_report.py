# SPDX-License-Identifier: MIT
"""``sdftrack motion`` for ten minutes at 30 Hz: ``python tests/bench/motion_report.py [--minutes 10]``.

Printed are the seconds of the whole command, imports included, and of the smoother and the measures alone. Target on
one core: 10 s for the command. Exit code 1 if missed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from harness import machine

from sdftrack import motion

TARGET_S = 10.0


def poses(times_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """An object that is carried 0.3 m away and back every six seconds, with 0.2 mm of noise."""
    phase = (times_s % 6) / 6
    u = np.clip(np.minimum(phase * 4, (0.75 - phase) * 4), 0, 1)
    T = np.tile(np.eye(4), (len(times_s), 1, 1))
    T[:, 0, 3] = 0.3 * u**3 * (10 - 15 * u + 6 * u**2)
    T[:, 2, 3] = 0.8
    T[:, :3, 3] += 2e-4 * rng.standard_normal((len(times_s), 3))
    return T


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    minutes = parser.parse_args().minutes
    print(machine())
    times = np.arange(int(minutes * 1800)) / 30
    covariance = np.diag([4e-8] * 3 + [4e-6] * 3)
    trajectory = motion.Trajectory(
        times, poses(times, np.random.default_rng(0)), np.tile(covariance, (len(times), 1, 1))
    )
    began = time.perf_counter()
    smoothed = motion.smooth(trajectory)
    smooth_s = time.perf_counter() - began
    found = motion.analyze(smoothed)
    measure_s = time.perf_counter() - began - smooth_s
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "exercise.csv"
        motion.save(path, [trajectory])
        began = time.perf_counter()
        command = [
            sys.executable,
            "-m",
            "sdftrack",
            "motion",
            str(path),
            "--out",
            str(Path(folder) / "out"),
            "-q",
        ]
        subprocess.run(command, check=True)
        whole_s = time.perf_counter() - began
    print(
        f"{len(times)} poses, {found.count[0]} repetitions: smoother {smooth_s:.1f} s, measures {measure_s:.1f} s"
    )
    print(f"sdftrack motion: {whole_s:.1f} s (target {TARGET_S:g} s)")
    return int(whole_s > TARGET_S)


if __name__ == "__main__":
    sys.exit(main())
