# SPDX-License-Identifier: MIT
"""How long `sdftrack motion` takes for ten minutes at 30 Hz: 18,000 poses with covariances, 100 repetitions, one core.

    python tests/bench/motion_report.py [--seconds 600] [--runs 3]

Prints the whole command as a new process, then its parts in this one: imports, reading, smoothing, measures, files.
Changing these numbers breaks comparisons.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
RATE_HZ, PERIOD_S = 30, 6.0
SD = (1e-3, 1e-3, 1.5e-3, 4e-3, 4e-3, 6e-3)  # m, rad
UP = "0,-1,0"


def exercise(seconds: float, path: Path) -> None:
    """A cup that is carried away, held and brought back every six seconds; two images in a hundred are weak."""
    import numpy as np
    from scipy.spatial.transform import Rotation

    from sdftrack import motion

    rng = np.random.default_rng(7)
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    away = np.zeros(len(t))
    for start in np.arange(1.0, seconds - PERIOD_S + 1, PERIOD_S):
        move_s, reach = rng.uniform(0.9, 1.2), rng.uniform(0.9, 1.1)
        for begin, sign in ((start, reach), (start + move_s + 0.8, -reach)):
            u = np.clip((t - begin) / move_s, 0, 1)
            away += sign * u**3 * (10 - 15 * u + 6 * u**2)
    x = np.column_stack([0.3 * away, -0.1 * np.sin(np.pi * np.clip(away, 0, 1)), 0.8 - 0.1 * away])
    errors = rng.normal(size=(len(t), 6)) * SD
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, :3, 3] = x + errors[:, :3]
    turned = Rotation.from_rotvec(np.outer(0.3 * away, [0, 0, 1.0]))
    poses[:, :3, :3] = (Rotation.from_rotvec(errors[:, 3:]) * turned).as_matrix()
    status = np.where(rng.random(len(t)) < 0.02, "weak", "ok").tolist()
    covariances = np.tile(np.diag(np.square(SD)), (len(t), 1, 1))
    motion.save(path, motion.Trajectory(t, poses, covariances, status, "cup"))


def parts(path: Path, out: Path) -> dict[str, float]:
    """Seconds of each step, in this process."""
    marks = {"": time.perf_counter()}

    def done(name: str) -> None:
        marks[name] = time.perf_counter()

    from sdftrack import motion
    from sdftrack.motion import report

    done("imports")
    (trajectory,) = motion.load(path)
    done("reading")
    smoothed = motion.smooth(trajectory)
    done("smoother")
    analysis = motion.analyze(smoothed, up=[float(v) for v in UP.split(",")])
    done("repetitions and measures")
    report.measures_json({"one": [analysis]})
    report.measures_csv({"one": [analysis]})
    report.smoothed_csv({"one": [analysis]})
    done("tables")
    page = report.report_html({"one": [analysis]})
    done("page")
    (out / "page.html").write_text(page)
    print(f"{analysis.count[0]} repetitions, {len(trajectory)} poses, page of {len(page) / 1e3:.0f} kB")
    times = list(marks.values())
    return {name: b - a for name, a, b in zip(list(marks)[1:], times[:-1], times[1:], strict=True)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "cup.csv", Path(folder) / "out"
        # In a process of its own: what it imports would be missing among the imports below.
        code = (
            f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); from motion_report import *; "
        )
        code += f"exercise({args.seconds}, Path({str(path)!r}))"
        subprocess.run([sys.executable, "-c", code], check=True)
        command = [
            sys.executable,
            "-m",
            "sdftrack",
            "motion",
            str(path),
            "--up",
            UP,
            "--out",
            str(out),
            "--quiet",
        ]
        seconds = []
        for _ in range(args.runs):
            begin = time.perf_counter()
            subprocess.run([*command, "--overwrite"], check=True)
            seconds.append(time.perf_counter() - begin)
        print(f"{platform.processor() or platform.machine()}, one core, Python {platform.python_version()}")
        told = ", ".join(f"{s:.1f}" for s in sorted(seconds))
        print(f"whole command: median {sorted(seconds)[len(seconds) // 2]:.1f} s of {told}")
        for name, s in parts(path, out).items():
            print(f"  {name:26s} {s:6.2f} s")


if __name__ == "__main__":
    os.environ.update(dict.fromkeys(THREADS, "1"))  # before numpy is imported
    main()
