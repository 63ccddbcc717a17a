# SPDX-License-Identifier: MIT
import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from sdftrack._internal import files


def _fail(file):
    file.write(b"half")
    raise OSError(28, "No space left on device")


def test_a_failed_write_leaves_what_was_there(tmp_path):
    path = tmp_path / "a.bin"
    files.write_whole(path, b"old")
    with pytest.raises(OSError, match="space"):
        files.write_whole(path, _fail)
    assert path.read_bytes() == b"old"
    files.write_whole(path, lambda file: file.write(b"new"))
    assert path.read_bytes() == b"new"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


def test_a_failed_folder_leaves_nothing(tmp_path):
    def fill(folder):
        (folder / "part").write_text("x")
        raise ValueError("stop")

    with pytest.raises(ValueError, match="stop"), files.replacing_folder(tmp_path / "f") as folder:
        fill(folder)
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="make it first"):
        files.write_text(tmp_path / "absent" / "a.txt", "x")


def test_numbers_that_json_lacks_are_not_written(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        files.write_json(tmp_path / "a.json", {"x": float("nan")})
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="this system has no mask of permissions")
def test_files_and_folders_have_the_permissions_of_new_ones_and_no_thread_sees_another_mask(
    tmp_path, monkeypatch
):
    before = os.umask(0o027)
    try:
        with monkeypatch.context() as patched:
            patched.setattr(os, "umask", lambda _: pytest.fail("the mask of the whole process was changed"))
            files.write_text(tmp_path / "a.txt", "x")
            with files.replacing_folder(tmp_path / "f"):
                pass
    finally:
        os.umask(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o640
    assert (tmp_path / "f").stat().st_mode & 0o777 == 0o750


def test_threads_that_write_one_file_leave_one_of_their_versions(tmp_path):
    path = tmp_path / "a.txt"
    texts = [str(k) * 10_000 for k in range(8)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda text: files.write_text(path, text), texts))
    assert path.read_text() in texts
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
