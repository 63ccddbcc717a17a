# SPDX-License-Identifier: MIT
"""A short run of all targets, the cases that once failed, and the harness itself."""

from __future__ import annotations

import os
import time
from multiprocessing.connection import Connection
from pathlib import Path

import fuzz_arrays
import fuzz_batches
import fuzz_files
import fuzz_objects
import pytest
from fuzz_batches import run_batches
from fuzz_datasets import read
from fuzz_targets import Target, outcome_of
from run import TARGETS, plan, table

import sdftrack as st
from sdftrack.io import frames, trajectories

CORPUS = Path(__file__).resolve().parent / "corpus"  # READER/NAME, files that once failed
READERS = {
    "camera": st.Camera.load,
    "color": frames.read_color,
    "depth": frames.read_depth_units,
    "log": trajectories.read_log,
    "mesh": st.Mesh.load,
    "motion": st.motion.load,
    "options": st.TrackerOptions.from_file,
    "sdf": st.SDF.load,
    "sequence": read,
    "tum": trajectories.read_tum,
}
SHORT_RUN = 9_000  # cases; a long one: python tests/fuzz/run.py --cases 1000000
CALLS = {
    f"{module.__name__}.{group}": getattr(module, group)
    for module, groups in (
        (fuzz_arrays, ("_geometry", "_mesh", "_sdf", "_levelset", "_superpixels", "_metrics", "_motion")),
        (
            fuzz_objects,
            ("_trackers", "_reconstructors", "_contours", "_lwpr", "_primitives", "_planes", "_energies"),
        ),
    )
    for group in groups
}


@pytest.mark.slow
def test_every_target_refuses_or_accepts_what_it_is_given() -> None:
    scores = run_batches(plan(list(TARGETS), SHORT_RUN, seed=0), jobs=2)
    print(table(list(scores.values())))
    assert sum(score.cases for score in scores.values()) >= 8_900
    found = [
        f"{score.target}:{f.seed} {f.kind} {f.message}" for score in scores.values() for f in score.findings
    ]
    assert found == []


@pytest.mark.parametrize("path", sorted(p for p in CORPUS.rglob("*") if p.is_file()), ids=lambda p: p.name)
@pytest.mark.filterwarnings("ignore")
def test_a_file_that_once_failed_is_refused_by_name_or_read(path: Path, tmp_path: Path) -> None:
    again = tmp_path / path.name
    again.write_bytes(path.read_bytes())
    target = Target("corpus", lambda _: lambda _: None)
    case = lambda _: fuzz_files.bounded(  # noqa: E731
        lambda: READERS[path.parent.name](again), again, path.stat().st_size, None
    )
    outcome, message = outcome_of(target, case, 0)
    assert outcome in ("accepted", "refused"), message


@pytest.mark.parametrize("group", CALLS)
@pytest.mark.filterwarnings("ignore")
def test_valid_arguments_are_accepted(group: str) -> None:
    """Otherwise a target would only see that everything is refused."""
    for call in CALLS[group]().values():
        call.valid()


# -- the harness


def dies_and_hangs(name: str, first: int, count: int, folder: Path, told: Connection) -> None:
    told.send(None)
    for seed in range(first, first + count):
        if seed == 3:
            os.abort()
        if seed == 6:
            time.sleep(60)
        told.send(("accepted", "", 0.1))


def test_a_process_that_dies_or_hangs_is_a_finding_and_the_others_cases_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(fuzz_batches, "work", dies_and_hangs)
    monkeypatch.setattr(fuzz_batches, "HANG_S", 1.0)
    score = run_batches([("a", 0, 10)], jobs=1)["a"]
    assert [(f.seed, f.kind) for f in score.findings] == [(3, "crash"), (6, "hang")]
    assert score.counts == {"accepted": 8, "crash": 1, "hang": 1}
    assert score.cases == 10
