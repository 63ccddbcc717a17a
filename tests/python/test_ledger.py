# SPDX-License-Identifier: MIT
"""No room of the repository grows unsaid (tests/ledger.py)."""

import shutil
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS))

import ledger  # noqa: E402


def test_no_room_is_above_its_number(capsys):
    if shutil.which("git") is None or not (ledger.ROOT / ".git").exists():
        pytest.skip("no repository of git here")
    now, allowed = ledger.counted(), ledger.most()
    with capsys.disabled():
        print("", *(f"{room}: {n} of {allowed['lines'].get(room, '-')}" for room, n in now["lines"].items()
                    if room in ledger.ROOMS), sep="\n")  # fmt: skip
    assert ledger.above(now, allowed) == []
