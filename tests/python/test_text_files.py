# SPDX-License-Identifier: MIT
"""JSON, TOML and text files with contents that no writer makes: one line that names the file."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack._internal.text_files import read_json, read_text, read_toml

DEEP = 100_000
LONG = "1" + "0" * 400  # more than a float holds
TOO_LONG = "1" * 5000  # more than Python converts


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", "[" * DEEP, "nested too deeply"),
        ("a.json", f"[{TOO_LONG}]", "Exceeds the limit"),
        ("a.json", "{", "not a JSON file"),
        ("a.toml", "a = " + "[" * DEEP, "nested too deeply"),
        ("a.toml", f"a = {TOO_LONG}", "Exceeds the limit"),
        ("a.toml", "a = ", "not a TOML file"),
        ("a.toml", b"\xff\xfe\x00", "expected text, got a binary file"),
    ],
)
def test_what_is_no_json_or_toml_is_refused_by_name(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError, match=message) as told:
        (read_json if path.suffix == ".json" else read_toml)(path)
    assert str(told.value).startswith(str(path))
    assert "\n" not in str(told.value)


def test_text_is_read_in_its_encoding(tmp_path):
    (tmp_path / "a").write_bytes("\ufeffä".encode())
    assert read_text(tmp_path / "a") == "ä"


def test_numbers_of_hundreds_of_digits_are_infinite():
    with pytest.raises(ValueError, match="fx: expected a finite number"):
        st.Camera(int(LONG), 60, 31, 23, 64, 48)
    with pytest.raises(ValueError, match="voxel_size"):
        st.SDF(np.ones((2, 2, 2), np.float32), int(LONG), (0, 0, 0))
