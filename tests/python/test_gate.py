# SPDX-License-Identifier: MIT
"""The results of every class of run keep their bits (tests/gate)."""

import json
import sys
from pathlib import Path

import pytest

GATE = Path(__file__).resolve().parents[1] / "gate"
sys.path.insert(0, str(GATE))

import hashes  # noqa: E402

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
