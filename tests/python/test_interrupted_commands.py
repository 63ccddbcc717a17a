# SPDX-License-Identifier: MIT
"""Ctrl-C in the middle of every command that writes: exit code 130, one line, and no file that is cut."""

from __future__ import annotations

from pathlib import Path

import pytest
from fault_commands import COMMANDS, check_readable, final_files, inputs
from fault_runs import interrupt, ran

pytestmark = pytest.mark.slow
USUAL_END = {"live", "record"}  # which run until Ctrl-C
CHANGES = (2, 9)  # of the folder; at the latter one, frames or results are being written


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return inputs(tmp_path_factory.getbasetemp())


@pytest.mark.parametrize("at", CHANGES)
@pytest.mark.parametrize("name", COMMANDS)
def test_an_interrupted_command_says_so_in_one_line(made: Path, tmp_path: Path, name: str, at: int) -> None:
    place = tmp_path / "place"
    place.mkdir()
    found = ran(COMMANDS[name].arguments(made, place), place, interrupt, at)
    if found.changes < at:
        pytest.skip(f"changes the folder {found.changes} times")
    if not (name in USUAL_END and found.code == 0):
        assert found.code == 130, found.told
        assert found.told.count("\n") == 1, found.told
        assert found.told.startswith("sdftrack: error: interrupted"), found.told
    for file in final_files(place).values():
        check_readable(file, COMMANDS[name].grows)
