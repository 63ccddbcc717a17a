# SPDX-License-Identifier: MIT
"""A disk that fills, and one that cannot be written to: one line, exit code 1, and no file that is cut."""

from __future__ import annotations

import resource
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from fault_commands import COMMANDS, check_readable, final_files, inputs
from fault_runs import Ran, ran

pytestmark = pytest.mark.slow
KILOBYTES = (
    8,
    24,
)  # of the disk; every command writes more than the latter, but for those that are not full then
LONGEST_FILE = 2000  # bytes


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return inputs(tmp_path_factory.getbasetemp())


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


@pytest.mark.parametrize("kilobytes", KILOBYTES)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk_is_one_line(made: Path, disk: Path, name: str, kilobytes: int) -> None:
    mount("-t", "tmpfs", "-o", f"size={kilobytes}k", "none", disk)
    found = ran(COMMANDS[name].arguments(made, disk), disk)
    if found.code == 0:
        pytest.skip(f"writes no more than {kilobytes} kB")
    check_failed(found, disk)
    assert "no space left" in found.told.lower(), found.told


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
def test_a_disk_that_cannot_be_written_to_is_one_line(made: Path, disk: Path, name: str) -> None:
    mount("-t", "tmpfs", "-o", "ro,size=64k", "none", disk)
    found = ran(COMMANDS[name].arguments(made, disk), disk)
    check_failed(found, disk)
    assert str(disk) in found.told, found.told
    assert "read-only" in found.told.lower(), found.told


@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_in_the_way_of_the_folder_is_one_line(made: Path, tmp_path: Path, name: str) -> None:
    place = tmp_path / "place"
    place.write_text("a file\n")
    found = ran(COMMANDS[name].arguments(made, place), place)
    assert found.code in (1, 2), found.told
    assert found.told.count("\n") == 1, found.told
    assert str(place) in found.told, found.told
    assert place.read_text() == "a file\n"
