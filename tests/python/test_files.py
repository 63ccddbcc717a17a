# SPDX-License-Identifier: MIT
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
