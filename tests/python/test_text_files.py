# SPDX-License-Identifier: MIT
"""JSON, TOML and text files with contents that no writer makes: one line that names the file."""

import json

import numpy as np
import pytest

import sdftrack as st
from sdftrack._internal.text_files import read_json, read_text, read_toml
from sdftrack.io import datasets
from sdftrack.io.frames import write_depth_units
from sdftrack.reconstruction import ReconstructorOptions

DEEP = 100_000
LONG = "1" + "0" * 400  # more than a float holds
TOO_LONG = "1" * 5000  # more than Python converts


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", "[" * DEEP, "nested too deeply"),
        ("a.json", '{"a":' * DEEP, "nested too deeply"),
        ("a.json", f"[{TOO_LONG}]", "Exceeds the limit"),
        ("a.json", "{", "not a JSON file"),
        ("a.toml", "a = " + "[" * DEEP, "nested too deeply"),
        ("a.toml", f"a = {TOO_LONG}", "Exceeds the limit"),
        ("a.toml", "a = ", "not a TOML file"),
        ("a.toml", b"\xff\xfe", "expected text, got a binary file"),
        ("a.json", b"\xff\xfe", "expected text, got a binary file"),
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
    assert read_text(tmp_path / "a", "utf-8-sig") == "ä"


CAMERA = {"fx": 60, "fy": 60, "cx": 31, "cy": 23, "width": 64, "height": 48}
OF_OPEN3D = {"width": 64, "height": 48, "intrinsic_matrix": [60, 0, 0, 0, 60, 0, 31, 23, 1]}


@pytest.mark.parametrize(
    "content",
    [
        "[]", "3", "null", "[" * DEEP,
        *(json.dumps({**CAMERA, name: value}) for name in ("fx", "width") for value in ("a", None, [[]], {})),
        json.dumps({**CAMERA, "distortion": "a"}), json.dumps({**CAMERA, "distortion": {"k1": 1}}),
        json.dumps(CAMERA).replace("60", LONG), json.dumps(CAMERA).replace("64", LONG),
        json.dumps({"K_depth": [], "image_size": [64, 48]}), json.dumps({"K_depth": CAMERA, "image_size": 3}),
        json.dumps({**OF_OPEN3D, "intrinsic_matrix": {}}), json.dumps({**OF_OPEN3D, "intrinsic_matrix": None}),
    ],
)  # fmt: skip
def test_a_camera_file_of_other_contents_is_refused_by_name(tmp_path, content):
    path = tmp_path / "camera.json"
    path.write_text(content)
    with pytest.raises(ValueError, match=r"camera\.json: ") as told:
        st.Camera.load(path)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("name", ["intrinsic.json", "trajectory.log"])
@pytest.mark.parametrize(
    "content", [b"[]", b"[" * DEEP, b"\xff\xfe", b'{"depth_scale": [], "width": 3}', LONG.encode()]
)
def test_a_redwood_folder_of_other_contents_is_refused_by_name(tmp_path, name, content):
    (tmp_path / "depth").mkdir()
    write_depth_units(tmp_path / "depth" / "000000.png", np.full((48, 64), 800, np.uint16))
    (tmp_path / "intrinsic.json").write_text(json.dumps(OF_OPEN3D))
    assert len(datasets.open_sequence(tmp_path, layout="open3d")) == 1
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=name.replace(".", r"\.")):
        datasets.open_sequence(tmp_path, layout="open3d")


def _options_of(content, tmp_path):
    path = tmp_path / "options.toml"
    path.write_text(content)
    return path


@pytest.mark.parametrize(
    "content", ["a = " + "[" * DEEP, f"threads = {LONG}", f"threads = {TOO_LONG}", "tracker = 3"]
)
def test_an_options_file_of_other_contents_is_refused(tmp_path, content):
    with pytest.raises((ValueError, TypeError)) as told:
        st.TrackerOptions.from_file(_options_of(content, tmp_path))
    with pytest.raises((ValueError, TypeError)):
        ReconstructorOptions.from_file(_options_of("[reconstruct]\n" + content, tmp_path))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("suffix", [".json", ".toml"])
@pytest.mark.parametrize("content", [b"[" * DEEP, b"a = " + b"[" * DEEP, b"[]", b"\xff", b"3"])
def test_a_sensor_file_of_other_contents_is_refused_by_name(tmp_path, suffix, content):
    path = tmp_path / f"sensor{suffix}"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=rf"sensor\{suffix}"):
        st.SensorModel.of(str(path))


def test_numbers_of_hundreds_of_digits_are_infinite():
    with pytest.raises(ValueError, match="fx: expected a finite number"):
        st.Camera(int(LONG), 60, 31, 23, 64, 48)
    with pytest.raises(ValueError, match="voxel_size"):
        st.SDF(np.ones((2, 2, 2), np.float32), int(LONG), (0, 0, 0))
