# SPDX-License-Identifier: MIT
"""The results of every class of run keep their bits (tests/gate)."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

GATE = Path(__file__).resolve().parents[1] / "gate"
sys.path.insert(0, str(GATE))

import compare  # noqa: E402
import hashes  # noqa: E402
from digest import digest  # noqa: E402

KEPT = json.loads(hashes.KEPT.read_text())


@pytest.mark.slow
@pytest.mark.parametrize("run", sorted(KEPT["hashes"]))
def test_a_run_gives_the_bits_that_it_gave(run):
    if why := hashes.elsewhere(KEPT):
        pytest.skip(f"the recorded hashes do not apply here: {why}")
    if run not in hashes.runs():
        pytest.skip("recorded data absent (set SDFTRACK_DATA to their folder)")
    assert hashes.differences(KEPT["hashes"], {run: hashes.runs()[run]()}) == []


def test_every_run_has_its_hashes():
    assert set(hashes.runs()) <= set(KEPT["hashes"])


def test_what_differs_between_two_commits_is_named_by_run_and_output(capsys):
    a = {"depth": {"poses": "1", "steps": "2"}, "new": {compare.FAILED: "no such name"}, "same": {"x": "3"}}
    b = {"depth": {"poses": "1", "steps": "4"}, "new": {"poses": "5"}, "same": {"x": "3"}}
    assert compare.report(a, b) == 1
    said = capsys.readouterr().out
    assert "depth: DIFFERS in 1 of 2 outputs: steps" in said
    assert "new: not in A: no such name" in said
    assert "same" not in said
    assert compare.report({"new": {"poses": "5"}}, {"new": {compare.FAILED: "no such name"}}) == 1


def test_one_bit_makes_another_hash():
    values = np.linspace(0, 1, 7)
    changed = values.copy()
    changed[3] = np.nextafter(changed[3], 1)
    assert digest(values) != digest(changed)
    assert digest(values) == digest(values.copy())
    assert digest([values, "ok"]) != digest([values, "weak"])
    assert digest(np.float64("nan")) == digest(-np.float64("nan"))
