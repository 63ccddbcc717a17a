# SPDX-License-Identifier: MIT
"""Progress in a pipe: rate, remaining time and a note, now and then and at the end."""

import pytest

from sdftrack.cli import progress as module
from sdftrack.cli.progress import progress


@pytest.fixture
def clock(monkeypatch):
    """A clock that a test sets."""
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    return now


def test_lines_have_rate_remaining_time_and_note(clock, capsys):
    lost = [0]
    for n in progress(range(30), 30, "cup", False, lambda: f"{lost[0]} lost"):
        clock[0] += 0.5
        lost[0] = n // 10
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "cup: 11/30, 2.0/s, 10 s left, 1 lost",
        "cup: 22/30, 2.0/s, 4 s left, 2 lost",
        "cup: 30/30, 2.0/s, 15.0 s, 2 lost",
    ]
