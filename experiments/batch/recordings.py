# SPDX-License-Identifier: MIT
"""A folder of many short recordings with a plan, and the tables of a batch over it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import sdftrack as st
from sdftrack.batch.journal import read_journal
from sdftrack.batch.task import RECORD

DIFFERENT = 20  # recordings; the others are copies of them under other names
FRAMES = 3
PLAN = """
[[job]]
command = "track"
sequences = "recordings/*"
model = "box.ply"
unit = "m"
voxels = 48
no_video = true
"""


def make_recordings(folder: Path, count: int) -> Path:
    """`count` recordings below `folder`; returns the plan."""
    mesh = st.synth.exercise_object("box")
    mesh.save(folder / "box.ply")
    camera = st.Camera(150.0, 150.0, 79.5, 59.5, 160, 120)
    for k in range(count):
        target = folder / "recordings" / f"run_{k:05d}"
        if k < DIFFERENT:
            st.save_sequence(target, st.synth.sequence(mesh, FRAMES, camera=camera, noise=0.001, seed=k))
        else:
            shutil.copytree(folder / "recordings" / f"run_{k % DIFFERENT:05d}", target, copy_function=os.link)
    plan = folder / "plan.toml"
    plan.write_text(PLAN, encoding="utf-8")
    return plan


def command(plan: Path, out: Path, *options: str) -> list[str]:
    """The command line of a batch."""
    return [sys.executable, "-m", "sdftrack", "batch", str(plan), "--out", str(out), *options]


def tables(out: Path) -> tuple[str, int, int]:
    """The summary as text, the number of results, and of entries of the journal that say so."""
    done = sum(row["status"] == "done" for row in read_journal(out).values())
    return (out / "summary.csv").read_text(encoding="utf-8"), len(list(out.glob(f"track/*/{RECORD}"))), done


def same_results(a: Path, b: Path) -> int:
    """Number of recordings whose poses differ between two batches, without the times in the last column."""
    different = 0
    for path in sorted(a.glob("track/*/poses.csv")):
        rows = [
            [line.rsplit(",", 1)[0] for line in p.read_text(encoding="utf-8").splitlines()]
            for p in (path, b / path.relative_to(a))
        ]
        different += rows[0] != rows[1]
    return different


def quiet(line: list[str]) -> subprocess.Popen[bytes]:
    """Start a program; what it tells is in its files."""
    return subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
