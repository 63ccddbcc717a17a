# SPDX-License-Identifier: MIT
"""``sdftrack calibrate color``: a recording on disk in, files out, one-line errors."""

from __future__ import annotations

import json

import numpy as np
import pytest
from ball_scenes import COLOR, RADIUS_M, recorded
from fault_commands import wand

import sdftrack as st
from sdftrack.cli.app import run

FRAMES = 16
HELD_OUT_PX = 0.3
FILES = ["camera.json", "coverage.png", "path.png", "residuals.png", "result.json"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A recording in the k1 layout; the colour images are larger than the depth images and nothing registers them."""
    root = tmp_path_factory.mktemp("wand") / "recording"
    wand(root, FRAMES)
    return root


def test_a_recording_gives_a_camera_that_opens_it_registered(folder, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = f"calibrate color {folder} --ball-radius {RADIUS_M} --ball-color 225,60,30".split()
    assert run([*arguments, "--out", str(out)]) == 0
    assert "rms px" in capsys.readouterr().out
    assert sorted(p.name for p in out.iterdir()) == FILES
    values = json.loads((out / "camera.json").read_text())
    assert values["depth_scale_m"] == 0.0001
    assert values["color_size"] == [330, 250]
    result = json.loads((out / "result.json").read_text())
    assert result["pairs_kept"] >= FRAMES - 3
    assert result["settings"]["ball_radius_m"] == RADIUS_M

    for part in ("depth", "rgb"):
        (out / part).symlink_to(folder / part)
    seq = st.open_sequence(out)
    assert seq[0].color.shape == (250, 330, 3)
    scene, _ = recorded(noise=0.001, seed=0)
    p = scene.centers_cam[:FRAMES]
    off = seq.camera.project_to_color(p) - scene.camera.project_to_color(p)
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < HELD_OUT_PX


def test_a_known_colour_camera_and_its_lens_stay_in_the_file(folder, tmp_path, capsys):
    out, known = tmp_path / "out", tmp_path / "color.json"
    lens = st.Camera(COLOR.fx, COLOR.fy, COLOR.cx, COLOR.cy, 330, 250, (1e-5, 0.0, 0.0, 0.0))
    lens.save(known)
    arguments = f"calibrate color {folder} --ball-radius {RADIUS_M} --color-camera {known}".split()
    arguments += ["--ball-color", "225,60,30", "--time-offset", "--fps", "7.5", "--quiet", "--out", str(out)]
    assert run(arguments) == 0
    assert capsys.readouterr().out == ""
    result = json.loads((out / "result.json").read_text())
    assert abs(result["time_offset_s"]) < 0.003
    (out / "depth").symlink_to(folder / "depth")
    seq = st.open_sequence(out)
    assert seq.camera.color == lens
    assert np.allclose(seq.camera.T_color_depth, result["T_color_depth"])
