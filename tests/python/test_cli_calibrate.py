# SPDX-License-Identifier: MIT
"""``sdftrack calibrate intrinsics`` and ``color``: a recording in, a camera and what it is worth out."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
from ball_scenes import COLOR, RADIUS_M, recorded
from fault_commands import wand
from refusals import error_line

import sdftrack as st
from reference.calibration import ray_of
from sdftrack.calibration.intrinsics_residuals import Misfit, misfit, points_of
from sdftrack.calibration.plots import plot_residuals
from sdftrack.cli.app import run
from sdftrack.io.frames import write_mask

FRAMES = 60
TRUTH = st.Camera(290.0, 286.0, 158.0, 121.5, 320, 240)
GUESS = "305,301,164,127"  # 5 % and 6 px off
FILES = ["camera.json", "coverage.png", "estimates.png", "residuals.png", "result.json"]
# The mesh is of a volume of 100 voxels and becomes one of 60: edges are cut by about 1 mm, and the lens takes it up.
FOCAL_SHARE, CENTER_PX = 0.005, 1.5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A box of three different edges, swept through the image gently enough to be tracked with a lens that is off."""
    root = tmp_path_factory.mktemp("box") / "scene"
    mesh = st.SDF.box((0.20, 0.16, 0.12), voxels=100).to_mesh()
    path = st.synth.sweep(near_m=0.5, far_m=0.9, reach_x=0.3, reach_y=0.22)
    seq = st.synth.sequence(mesh, FRAMES, path, 0.001, seed=3, camera=TRUTH, color=False)
    st.save_sequence(root, seq)
    return root


@pytest.fixture(scope="module")
def model(folder):
    (path,) = folder.rglob("*.ply")
    return path


@pytest.fixture(scope="module")
def command(folder, model):
    return ["calibrate", "intrinsics", str(folder), "--model", str(model)]


@pytest.mark.slow
def test_a_recording_gives_a_camera_with_intervals_and_plots(command, tmp_path, capsys):
    out = tmp_path / "out"
    assert run([*command, "--init", "gt", "--guess", GUESS, "--voxels", "60", "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert sorted(p.name for p in out.iterdir()) == FILES
    found = st.Camera.load(out / "camera.json")
    assert found.shape == TRUTH.shape
    assert abs(found.fx / TRUTH.fx - 1) < FOCAL_SHARE
    assert abs(found.fy / TRUTH.fy - 1) < FOCAL_SHARE
    assert abs(found.cx - TRUTH.cx) < CENTER_PX
    assert abs(found.cy - TRUTH.cy) < CENTER_PX

    result = json.loads((out / "result.json").read_text())
    assert result["values"] == [found.fx, found.fy, found.cx, found.cy]
    assert len(result["im_ids"]) == len(result["frames"]) > 0.8 * FRAMES
    assert result["settings"]["first_guess"] == {"fx": 305.0, "fy": 301.0, "cx": 164.0, "cy": 127.0}
    before, after = (result["residuals"][name] for name in ("first_guess", "calibrated"))
    assert after["median_m"] < 0.9 * before["median_m"]
    for text in ("fx", "fy", "cx", "cy", "95 %", "frames used", "residual mm", f"{found.fx:.6g}"):
        assert text in printed.out, text
    for sentence in result["observability"]["advice"]:
        assert sentence in printed.out
    assert f"frames: {FRAMES}/{FRAMES}" in printed.err


def test_another_camera_file_a_mask_and_other_unknowns_are_taken(command, folder, tmp_path, capsys):
    known, mask, out = tmp_path / "known.json", tmp_path / "mask.png", tmp_path / "out"
    st.Camera(300.0, 286.0, 158.0, 121.5, 320, 240).save(known)
    write_mask(mask, st.open_sequence(folder)[5].depth > 0)
    arguments = ["--camera", str(known), "--init", str(mask), "--free", "fx,skew", "--per-frame"]
    part = ["--start", "5", "--stop", "30", "--voxels", "60", "--max-pixels", "400", "--quiet"]
    assert run([*command, *part, *arguments, "--out", str(out)]) == 0
    assert capsys.readouterr().out == ""
    result = json.loads((out / "result.json").read_text())
    assert result["free"] == ["fx", "skew"]
    assert result["joint"] is False
    assert set(result["extra"]) == {"skew"}
    assert result["camera"]["cx"] == 158.0
    assert result["im_ids"] == [5 + i for i in result["frames"]]
    assert result["settings"]["frames"] == [5, 30, 1]


def test_an_object_that_is_nowhere_is_an_error_that_speaks_of_init(model, tmp_path, capsys):
    wall = [st.Frame(np.full(TRUTH.shape, 2.5, np.float32)) for _ in range(6)]
    st.save_sequence(tmp_path / "wall", st.Sequence(wall, TRUTH))
    command = ["calibrate", "intrinsics", str(tmp_path / "wall"), "--model", str(model), "--unit", "mm", "-q"]
    assert run([*command, "--voxels", "60", "--out", str(tmp_path / "out")]) == 1
    message = error_line(capsys)
    assert "found it in 0 of 6" in message
    assert "with --init" in message
    assert "initial_pose" not in message


# --- the residuals behind the third picture
def test_points_of_a_skewed_lens_are_those_of_the_twin():
    camera = dataclasses.replace(TRUTH, distortion=(0.1, -0.06, 0.0, 0.0))
    depth = np.full(camera.shape, 0.8, np.float32)
    points = points_of(depth, camera, {"skew": 4.0, "depth_scale": 1.02, "depth_offset": 0.003})
    values = np.array([camera.fx, camera.fy, camera.cx, camera.cy, 4.0, 0.1, -0.06])
    for u, v in ((10, 20), (160, 120), (300, 35)):
        expected = (1.02 * depth[v, u] + 0.003) * ray_of(values, u, v)
        assert points[v, u] == pytest.approx(expected, abs=1e-6)  # depth is float32
    assert not points_of(np.zeros(camera.shape, np.float32), camera, {"depth_offset": 0.01}).any()


def test_a_cell_has_the_median_size_of_its_readings_and_is_blank_with_few():
    pixels = np.concatenate([np.tile([5, 5], (99, 1)), np.tile([319, 239], (10, 1))])
    outside_m = np.concatenate([np.linspace(-0.002, 0.002, 99), np.full(10, 0.01)])
    seen = misfit([(pixels[:60], outside_m[:60]), (pixels[60:], outside_m[60:])], TRUTH)
    assert seen.frames == 2
    assert seen.cells_m[0, 0] == pytest.approx(0.001, rel=0.05)  # the median of |x|, x even in -2..2 mm
    assert np.isnan(seen.cells_m[5, 7])  # ten readings
    assert np.isfinite(seen.cells_m).sum() == 1
    assert seen.to_dict()["cells_m"][5][7] is None


def test_nothing_seen_with_the_first_guess_is_a_picture_all_the_same():
    nothing = misfit([], TRUTH)
    assert nothing.frames == 0
    assert nothing.to_dict()["median_m"] is None
    some = Misfit(0.001, np.full((6, 8), 0.001), 3)
    fig = plot_residuals(nothing, some, SimpleNamespace(camera=TRUTH))
    assert "not found" in fig.axes[0].get_title()
    assert "median 1.00 mm" in fig.axes[1].get_title()


WAND_FRAMES = 16
HELD_OUT_PX = 0.3
COLOR_FILES = ["camera.json", "coverage.png", "path.png", "residuals.png", "result.json"]


@pytest.fixture(scope="module")
def wand_folder(tmp_path_factory):
    """A recording in the k1 layout; the colour images are larger than the depth images and nothing registers them."""
    root = tmp_path_factory.mktemp("wand") / "recording"
    wand(root, WAND_FRAMES)
    return root


def test_a_recording_gives_a_camera_that_opens_it_registered(wand_folder, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = f"calibrate color {wand_folder} --ball-radius {RADIUS_M} --ball-color 225,60,30".split()
    assert run([*arguments, "--out", str(out)]) == 0
    assert "rms px" in capsys.readouterr().out
    assert sorted(p.name for p in out.iterdir()) == COLOR_FILES
    values = json.loads((out / "camera.json").read_text())
    assert values["depth_scale_m"] == 0.0001
    assert values["color_size"] == [330, 250]
    result = json.loads((out / "result.json").read_text())
    assert result["pairs_kept"] >= WAND_FRAMES - 3
    assert result["settings"]["ball_radius_m"] == RADIUS_M

    for part in ("depth", "rgb"):
        (out / part).symlink_to(wand_folder / part)
    seq = st.open_sequence(out)
    assert seq[0].color.shape == (250, 330, 3)
    scene, _ = recorded(noise=0.001, seed=0)
    p = scene.centers_cam[:WAND_FRAMES]
    off = seq.camera.project_to_color(p) - scene.camera.project_to_color(p)
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < HELD_OUT_PX


def test_a_known_colour_camera_and_its_lens_stay_in_the_file(wand_folder, tmp_path, capsys):
    out, known = tmp_path / "out", tmp_path / "color.json"
    lens = st.Camera(COLOR.fx, COLOR.fy, COLOR.cx, COLOR.cy, 330, 250, (1e-5, 0.0, 0.0, 0.0))
    lens.save(known)
    arguments = f"calibrate color {wand_folder} --ball-radius {RADIUS_M} --color-camera {known}".split()
    arguments += ["--ball-color", "225,60,30", "--time-offset", "--fps", "7.5", "--quiet", "--out", str(out)]
    assert run(arguments) == 0
    assert capsys.readouterr().out == ""
    result = json.loads((out / "result.json").read_text())
    assert abs(result["time_offset_s"]) < 0.003
    (out / "depth").symlink_to(wand_folder / "depth")
    seq = st.open_sequence(out)
    assert seq.camera.color == lens
    assert np.allclose(seq.camera.T_color_depth, result["T_color_depth"])
