# SPDX-License-Identifier: MIT
"""Output folders: one run at a time, and what a killed run leaves does not hinder the next one."""

import gc
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from fault_commands import FRAMES, inputs
from tracking_fakes import CAMERA, frame, pose, result

import sdftrack as st
from sdftrack._internal import files
from sdftrack.cli.app import run
from sdftrack.io.out_folder import LOCK, FolderLock, lock_folder, one_run, prepare_folder, refuse_folder
from sdftrack.recorder import Recorder

pytest.importorskip("fcntl", reason="there are no locks on this system")

BUSY = r"out: expected a folder that no other run writes into, got .*, used by"

HOLD = """
import sys, time
from pathlib import Path
from sdftrack.io.out_folder import FolderLock
lock = FolderLock(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(60)
"""


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def holder(folder: Path) -> subprocess.Popen[str]:
    """A process that holds the folder until it is killed."""
    child = subprocess.Popen([sys.executable, "-c", HOLD, str(folder)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline() == "held\n"
    return child


def kill(child: subprocess.Popen[str]) -> None:
    child.send_signal(signal.SIGKILL)
    child.communicate()


# -- the lock
def test_a_held_folder_is_refused_by_whoever_comes_second(tmp_path: Path) -> None:
    child = holder(tmp_path)
    for use in (refuse_folder, prepare_folder, lambda folder, over: Recorder(folder, CAMERA, overwrite=over)):
        for overwrite in (False, True):
            with pytest.raises(FileExistsError, match=rf"{BUSY} process {child.pid} on .*; wait for its end"):
                use(tmp_path, overwrite)
    kill(child)
    assert names_in(tmp_path) == {LOCK}  # which does not count
    prepare_folder(tmp_path, overwrite=False)
    assert names_in(tmp_path) == set()


def test_a_folder_is_held_once_however_many_want_it_at_once(tmp_path: Path) -> None:
    """The file is removed and made again all the time, between being opened and being locked by others."""
    inside, most, taken = 0, 0, 0
    guard = threading.Lock()

    def want() -> None:
        nonlocal inside, most, taken
        for _ in range(300):
            try:
                lock = FolderLock(tmp_path)
            except FileExistsError:
                continue
            with guard:
                inside += 1
                taken += 1
                most = max(most, inside)
            time.sleep(0)
            with guard:
                inside -= 1
            lock.release()

    threads = [threading.Thread(target=want) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == 1
    assert taken > 0
    assert names_in(tmp_path) == set()


def test_a_command_may_prepare_its_folder_several_times_and_holds_it_to_its_end(tmp_path: Path) -> None:
    with one_run():
        prepare_folder(tmp_path, overwrite=False)
        with Recorder(tmp_path, CAMERA) as recorder:
            recorder.add(frame(0), result([pose()], None, 0))
        prepare_folder(tmp_path, overwrite=True)
        assert lock_folder(tmp_path) is None
        with pytest.raises(FileExistsError, match=r"used by this process; close the recorder of it first"):
            FolderLock(tmp_path)
    FolderLock(tmp_path).release()
    assert LOCK not in names_in(tmp_path)


def test_a_folder_is_free_after_a_command_in_whatever_way_it_ends(tmp_path: Path) -> None:
    out = ["config", "--out", str(tmp_path), "--quiet"]
    assert [run(out), run(out), run([*out, "--overwrite"])] == [0, 1, 0]
    assert names_in(tmp_path) == {"config.toml"}


# -- recorders
def test_a_lock_that_nobody_has_any_more_holds_nothing(tmp_path: Path) -> None:
    lock = FolderLock(tmp_path)
    del lock
    gc.collect()
    with Recorder(tmp_path, CAMERA) as recorder:
        recorder.add(frame(0), result([pose()], None, 0))
    assert LOCK not in names_in(tmp_path)


def test_a_recorder_with_wrong_arguments_holds_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="invalid literal"):
        Recorder(tmp_path / "out", CAMERA, scene_id="one")  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_what_a_killed_run_left_does_not_count_and_is_removed(tmp_path: Path) -> None:
    parts = {".overlay.mp4.part", ".poses.csv.part", f"{files.PART_PREFIX}report.ab12.json"}
    for name in (LOCK, *parts):
        (tmp_path / name).write_text("x")
    refuse_folder(tmp_path, overwrite=False)
    assert names_in(tmp_path) == parts  # only looked at
    prepare_folder(tmp_path, overwrite=False)
    assert names_in(tmp_path) == set()


def test_leftovers_beside_other_files_stay_where_the_folder_is_refused(tmp_path: Path) -> None:
    before = {".overlay.mp4.part", "notes.txt"}
    for name in before:
        (tmp_path / name).write_text("x")
    for use in (refuse_folder, prepare_folder):
        with pytest.raises(FileExistsError, match="with files in it"):
            use(tmp_path, False)
    assert names_in(tmp_path) == before


def test_two_saved_sequences_of_one_name_are_one_of_them(tmp_path: Path) -> None:
    def second() -> None:
        with files.replacing_folder(tmp_path / "seq") as folder:
            (folder / "late.txt").write_text("x")
            with files.replacing_folder(tmp_path / "seq") as other:
                (other / "first.txt").write_text("x")

    with pytest.raises(
        FileExistsError, match=r"seq: expected a new or empty folder, which another process has"
    ):
        second()
    assert names_in(tmp_path) == {"seq"}
    assert names_in(tmp_path / "seq") == {"first.txt"}


# -- real runs
@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return inputs(tmp_path_factory.getbasetemp()) / "seq"


def test_a_recording_that_is_written_cannot_be_continued_by_another_run(
    sequence: Path, tmp_path: Path
) -> None:
    words = ["convert", str(sequence), "--to", "tum", "--out", str(tmp_path), "-q"]
    (tmp_path / ".frames.jsonl").write_text("{}\n")
    child = holder(tmp_path)
    for more in (["--resume"], ["--overwrite"]):
        told = subprocess.run(
            [sys.executable, "-m", "sdftrack", *words, *more], stderr=subprocess.PIPE, text=True
        )
        assert told.returncode == 1
        assert re.search(rf"{BUSY} process {child.pid}", told.stderr)
    kill(child)
    assert run([*words, "--overwrite"]) == 0
    assert len(st.open_sequence(tmp_path)) == FRAMES
    assert LOCK not in names_in(tmp_path)


def test_a_program_that_a_killed_run_has_started_does_not_hold_the_folder(tmp_path: Path) -> None:
    started = "import subprocess; print(subprocess.Popen(['sleep', '60'], close_fds=False).pid, flush=True)"
    child = subprocess.Popen(
        [sys.executable, "-c", HOLD.replace("time.sleep(60)", f"{started}; time.sleep(60)"), str(tmp_path)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    held, sleeper = child.stdout.readline(), int(child.stdout.readline())
    child.send_signal(signal.SIGKILL)
    child.wait()
    try:
        assert held == "held\n"
        os.kill(sleeper, 0)  # it is there
        FolderLock(tmp_path).release()
    finally:
        os.kill(sleeper, signal.SIGKILL)
        child.stdout.close()
