# SPDX-License-Identifier: MIT
"""A short run of all targets, the cases that once failed, and the harness itself."""

from __future__ import annotations

import json
import random
from pathlib import Path
from types import SimpleNamespace

import fuzz_arrays
import fuzz_batches
import fuzz_files
import fuzz_objects
import numpy as np
import pytest
from fuzz_batches import run_batches
from fuzz_datasets import read
from fuzz_targets import Target, Unclear, finite, outcome_of, rng_of
from fuzz_values import nasty_array
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


FOUND = SimpleNamespace(status=["weak"], poses=[np.nan], confidence=[1.0], covariances=[1.0])


def _outcome(error: BaseException | None) -> str:
    def case(rng: random.Random) -> None:
        finite(FOUND if error is FOUND else None)
        if error is not None:
            raise error

    return outcome_of(Target("a", lambda _: case), case, 0)[0]


def test_outcomes_are_told_apart() -> None:
    assert _outcome(None) == "accepted"
    assert _outcome(ValueError("x: expected 1, got 2")) == "refused"
    assert _outcome(OSError("x")) == "refused"
    assert _outcome(ValueError("")) == "unclear"
    assert _outcome(TypeError("one\ntwo")) == "unclear"
    assert _outcome(Unclear("two")) == "unclear"
    assert _outcome(FOUND) == "unclear"  # a pose that counts as found and is not finite
    assert _outcome(MemoryError()) == "error"
    assert _outcome(AttributeError("x")) == "error"


def test_a_case_is_the_same_for_the_same_seed_and_another_for_another() -> None:
    data = json.dumps({"a": [1, 2.5, {"b": None}]}).encode()
    made = [fuzz_files.mutated(rng_of("x", seed), data) for seed in range(200)]
    assert made == [fuzz_files.mutated(rng_of("x", seed), data) for seed in range(200)]
    assert len(set(made)) > 100
    arrays = [nasty_array(rng_of("x", seed), np.ones((3, 3))) for seed in range(200)]
    kinds = {(type(a).__name__, getattr(a, "dtype", None), getattr(a, "shape", None)) for a in arrays}
    assert len(kinds) > 15


def test_memory_beyond_what_a_file_may_take_is_a_finding(tmp_path: Path) -> None:
    if not fuzz_files._memory("VmRSS"):
        pytest.skip("memory is read from /proc/self/status")
    path = tmp_path / "case.bin"
    fuzz_files.bounded(lambda: bytes(50_000_000), path, 10, None)
    with pytest.raises(Unclear, match="MB taken by a file of 10 bytes"):
        fuzz_files.bounded(lambda: len(b"x" * 300_000_000), path, 10, None)
    with pytest.raises(Unclear, match="without the file's name"):
        fuzz_files.bounded(lambda: int("x"), path, 10, None)


CHILD = """
import os, sys, time
first, count, folder = int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
out = open(folder + "/outcomes", "w", buffering=1)
for seed in range(first, first + count):
    print('{"begun": %d}' % seed, file=out)
    if seed == 3:
        os.abort()
    if seed == 6:
        time.sleep(60)
    print('{"seed": %d, "outcome": "accepted", "seconds": 0.1, "message": ""}' % seed, file=out)
"""


def test_a_process_that_dies_or_hangs_is_a_finding_and_the_others_cases_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "child.py").write_text(CHILD)
    monkeypatch.setattr(fuzz_batches, "CHILD", tmp_path / "child.py")
    monkeypatch.setattr(fuzz_batches, "HANG_S", 0.5)
    score = run_batches([("a", 0, 10)], jobs=1)["a"]
    assert [(f.seed, f.kind) for f in score.findings] == [(3, "crash"), (6, "hang")]
    assert score.counts == {"accepted": 8, "crash": 1, "hang": 1}
    assert score.cases == 10
