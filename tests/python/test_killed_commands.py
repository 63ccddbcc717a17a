# SPDX-License-Identifier: MIT
"""kill -9 in the middle of every command that writes: what has its name is whole, and the next run is a whole one."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from fault_commands import COMMANDS, check_readable, final_files, inputs
from fault_runs import kill, ran

pytestmark = pytest.mark.slow
PARTS = (0.4, 1.0)  # of the changes of the folder; the last one leaves everything but that undone


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return inputs(tmp_path_factory.getbasetemp())


@pytest.mark.parametrize("name", COMMANDS)
def test_a_killed_command_leaves_whole_files_and_hinders_no_other(
    made: Path, tmp_path: Path, name: str
) -> None:
    command = COMMANDS[name]
    whole, place = tmp_path / "whole", tmp_path / "killed"
    whole.mkdir()
    place.mkdir()
    undisturbed = ran(command.arguments(made, whole), whole)
    assert (undisturbed.code, undisturbed.told) == (0, "")
    left: list[tuple[str, bytes]] = []
    for part in PARTS:
        at = max(1, round(part * undisturbed.changes))
        killed = ran(command.arguments(made, place, "--overwrite"), place, kill, at)
        assert killed.code == -signal.SIGKILL
        for path, file in final_files(place).items():
            check_readable(file, command.grows)
            left.append((path, file.read_bytes()))
    again = ran(command.arguments(made, place, "--overwrite"), place)
    assert (again.code, again.told) == (0, "")
    wanted, found = final_files(whole), final_files(place)
    assert found.keys() == wanted.keys()
    for file in found.values():
        check_readable(file)
    if not command.name:  # in a folder of the user, they could be of a run that is writing
        assert not [path for path in place.rglob("*") if path.name.startswith(".")]
    # Some files hold times; the bytes of the others are known.
    same = {path for path in wanted if wanted[path].read_bytes() == found[path].read_bytes()}
    assert same or name == "live"
    cut = [path for path, data in left if path in same and data != wanted[path].read_bytes()]
    assert (
        cut == [] or command.improves or command.grows
    )  # a shorter recording, which check_readable has read
