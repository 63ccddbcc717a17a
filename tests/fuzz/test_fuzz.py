# SPDX-License-Identifier: MIT
"""A short run of all targets, the cases that once failed, and the harness itself."""

import inspect
import os
import random
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import fuzz_arrays
import fuzz_batches
import fuzz_files
import fuzz_objects
import numpy as np
import pytest
from fuzz_batches import run_batches
from fuzz_datasets import read
from fuzz_targets import Target, outcome_of, unclear
from fuzz_values import Call, Fixed, valid_value
from run import TARGETS, plan, table

import sdftrack as st
from sdftrack.io import frames
from sdftrack.io import report_file as trajectories

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
    read = lambda: READERS[path.parent.name](again)  # noqa: E731
    outcome, message = outcome_of(target, lambda _: fuzz_files.bounded(read, again, path.stat().st_size), 0)
    assert outcome in ("accepted", "refused"), message


@pytest.mark.parametrize("group", CALLS)
@pytest.mark.filterwarnings("ignore")
def test_valid_arguments_are_accepted(group: str) -> None:
    """Otherwise a target would only see that everything is refused."""
    for call in CALLS[group]().values():
        call.valid()


# -- each argument in turn is of another kind: the refusal is one line that names it


WRONG = {
    "object": object(), "text": "x", "complex": 1j, "texts": np.array([["a", "b"]]), "NaN": float("nan"),
    "negative": -1, "zero": 0, "fraction": 2.5, "huge": 10**400, "None": None, "shape": np.zeros((7, 9, 2, 3)),
}  # fmt: skip
# What is accepted as a value like others, or refused in words that do not name the argument: no more than there were.
LEFT = {
    "fuzz_arrays._geometry": 73, "fuzz_arrays._mesh": 29, "fuzz_arrays._sdf": 108, "fuzz_arrays._levelset": 18,
    "fuzz_arrays._superpixels": 18, "fuzz_arrays._metrics": 123, "fuzz_arrays._motion": 110,
    "fuzz_objects._trackers": 32, "fuzz_objects._reconstructors": 11, "fuzz_objects._contours": 51,
    "fuzz_objects._lwpr": 4, "fuzz_objects._primitives": 14, "fuzz_objects._planes": 89, "fuzz_objects._energies": 3,
}  # fmt: skip


def refusals(call: Call) -> Iterator[tuple[str, str, str]]:
    """(argument, what it was, what is wrong with the answer) of every argument that may vary."""
    names = list(inspect.signature(call.function).parameters)
    given = {**dict(zip(names, call.args, strict=False)), **call.kwargs}
    valid = {name: valid_value(random.Random(0), value) for name, value in given.items()}
    for name in (name for name, value in given.items() if not isinstance(value, Fixed)):
        for kind, wrong in WRONG.items():
            changed = {**valid, name: wrong}
            try:
                call.function(
                    *(changed[n] for n in names[: len(call.args)]), **{n: changed[n] for n in call.kwargs}
                )
            except (ValueError, TypeError) as error:
                fault = unclear(error) or ("" if name in str(error) else f"not named: {error}")
            except Exception as error:
                fault = repr(error)
            else:
                fault = "accepted"
            yield name, kind, fault


@pytest.mark.parametrize("group", CALLS)
@pytest.mark.filterwarnings("ignore")
def test_an_argument_of_another_kind_is_refused_by_its_name(group: str) -> None:
    answers = [(name, *answer) for name, call in CALLS[group]().items() for answer in refusals(call)]
    left = [answer for answer in answers if answer[-1]]
    assert len(left) <= LEFT[group], left


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
