# SPDX-License-Identifier: MIT
"""kill -9, Ctrl-C and full disks in the middle of every command that writes: what has its name is whole."""

import resource
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from fault_commands import COMMANDS, check_readable, final_files, inputs
from fault_runs import Ran, interrupt, kill, ran

from sdftrack.cli.app import run

pytestmark = pytest.mark.slow
PARTS = (0.4, 1.0)  # of the changes of the folder; the last one leaves everything but that undone
USUAL_END = {"live", "record"}  # which run until Ctrl-C
CHANGES = (2, 9)  # of the folder; at the latter one, frames or results are being written
KILOBYTES = (8, 24)  # of the disk; commands that write no more than that are not full then
LONGEST_FILE = 2000  # bytes


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
    mine = place / "out" / "mine.txt"
    if not command.name:
        mine.parent.mkdir(exist_ok=True)
        mine.write_text("keep")
    again = ran(command.arguments(made, place, "--overwrite"), place)
    assert (again.code, again.told) == (0, "")
    wanted, found = final_files(whole), final_files(place)
    if not command.name:
        assert found.pop("out/mine.txt").read_text() == "keep"
    assert found.keys() == wanted.keys()
    for file in found.values():
        check_readable(file)
    if not command.name:  # in a folder of the user, they could be of a run that is writing
        assert not [path for path in place.rglob("*") if path.name.startswith(".")]
    # Some files hold times; the bytes of the others are known.
    same = {path for path in wanted if wanted[path].read_bytes() == found[path].read_bytes()}
    assert same or name == "live"
    cut = [path for path, data in left if path in same and data != wanted[path].read_bytes()]
    # a shorter recording, which check_readable has read
    assert cut == [] or command.improves or command.grows


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


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A folder that can be a disk of its own."""
    place = tmp_path / "disk"
    place.mkdir()
    yield place
    while subprocess.run(["umount", place], capture_output=True).returncode == 0:
        pass


def mount(*words: str | Path) -> None:
    try:
        done = subprocess.run(["mount", *map(str, words)], capture_output=True, text=True)
    except FileNotFoundError:
        pytest.skip("there is no program mount")
    if done.returncode:
        pytest.skip(f"nothing may be mounted here: {done.stderr.strip()}")


def check_failed(found: Ran, place: Path) -> None:
    assert found.code == 1, found.told
    assert found.told.count("\n") == 1, found.told
    assert found.told.startswith("sdftrack: error: "), found.told
    assert "report it" not in found.told, found.told
    for file in final_files(place).values():
        check_readable(file)


@pytest.mark.parametrize("options", [*(f"size={kilobytes}k" for kilobytes in KILOBYTES), "ro,size=64k"])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_disk_that_is_full_or_cannot_be_written_to_is_one_line(
    made: Path, disk: Path, name: str, options: str
) -> None:
    mount("-t", "tmpfs", "-o", options, "none", disk)
    found = ran(COMMANDS[name].arguments(made, disk), disk)
    read_only = options.startswith("ro")
    if found.code == 0 and not read_only:
        pytest.skip(f"writes no more than {options}")
    check_failed(found, disk)
    assert ("read-only" if read_only else "no space left") in found.told.lower(), found.told
    assert not read_only or str(disk) in found.told, found.told


def shorten_files(_: int) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (LONGEST_FILE, LONGEST_FILE))


@pytest.mark.parametrize("name", COMMANDS)
def test_files_that_may_not_be_long_are_one_line(made: Path, tmp_path: Path, name: str) -> None:
    """As on file systems with quotas; needs no rights, unlike a disk."""
    place = tmp_path / "place"
    place.mkdir()
    found = ran(COMMANDS[name].arguments(made, place), place, shorten_files)
    if found.code == 0:
        assert max(path.stat().st_size for path in final_files(place).values()) <= LONGEST_FILE
        pytest.skip("writes no longer files")
    check_failed(found, place)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_in_the_way_of_the_folder_is_one_line(made: Path, tmp_path: Path, name: str) -> None:
    place = tmp_path / "place"
    place.write_text("a file\n")
    found = ran(COMMANDS[name].arguments(made, place), place)
    assert found.code in (1, 2), found.told
    assert found.told.count("\n") == 1, found.told
    assert str(place) in found.told, found.told
    assert place.read_text() == "a file\n"


@pytest.mark.parametrize("name", COMMANDS)
def test_a_folder_with_a_file_of_the_user_is_refused_before_the_work(
    made: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command = COMMANDS[name]
    mine = tmp_path / (command.name or "out/mine.txt")
    mine.parent.mkdir(exist_ok=True)
    mine.write_text("mine")
    capsys.readouterr()
    assert run(command.arguments(made, tmp_path)) in (1, 2)
    error = capsys.readouterr().err
    assert error.count("\n") == 1, error
    assert "--overwrite" in error
    assert final_files(tmp_path) == {str(mine.relative_to(tmp_path)): mine}
    assert mine.read_text() == "mine"
