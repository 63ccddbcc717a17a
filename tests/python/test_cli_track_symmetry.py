# SPDX-License-Identifier: MIT
"""``sdftrack track``: symmetries, the outline in the colour image, and the exit code where nothing is found."""

import json

import numpy as np
import pytest

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.geometry import pose
from sdftrack.sdf import SDF

CAMERA = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
HALF = np.diag([-1.0, -1.0, 1.0, 1.0])
FRAMES = 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A red box before a wall as a BOP scene, a first pose turned by half a circle, and the wall alone."""
    path = tmp_path_factory.mktemp("box")
    box = SDF.box((0.12, 0.09, 0.06), voxels=60).to_mesh()
    red = st.Mesh(box.vertices, box.faces, np.tile([200, 30, 30], (len(box.vertices), 1)).astype(np.uint8))
    red.save(path / "box.ply")
    T = np.array([pose([0.5, 0.3, 0.1 + 0.02 * i], [0.003 * i, 0, 0.5]) for i in range(FRAMES)])
    seq = st.synth.sequence(red, FRAMES, T, noise=0.001, camera=CAMERA, clutter="wall", seed=5)
    st.save_sequence(path / "scene", seq, layout="bop")
    (path / "turned.json").write_text(json.dumps({"T_cam_obj": [(T[0] @ HALF).tolist()]}))
    wall = st.Frame(np.full(CAMERA.shape, 1.2, np.float32))
    st.save_sequence(path / "wall", st.Sequence([wall] * FRAMES, CAMERA), layout="bop")
    return path


def track(folder, out, *more, scene="scene"):
    start = ["track", str(folder / scene), "--model", str(folder / "box.ply"), "--out", str(out)]
    return run([*start, "--no-video", "--voxels", "60", *more])


def degrees(text):
    return float(next(line for line in text.splitlines() if line.startswith("box")).split()[-1])


def test_errors_of_a_pose_that_looks_alike_are_counted_up_to_the_symmetry(folder, tmp_path, capsys):
    turned = str(folder / "turned.json")
    assert track(folder, tmp_path / "none", "--init", turned) == 0
    assert degrees(capsys.readouterr().out) > 170
    assert "symmetries" not in report(tmp_path / "none")["settings"]
    assert track(folder, tmp_path / "auto", "--init", turned, "--symmetry", "auto") == 0
    assert degrees(capsys.readouterr().out) < 3
    (said,) = report(tmp_path / "auto")["settings"]["symmetries"]
    assert len(said["symmetries_discrete"]) == 3
    info = folder / "models_info.json"
    info.write_text(json.dumps({"1": {"symmetries_discrete": [HALF.ravel().tolist()]}}))
    assert track(folder, tmp_path / "file", "--init", turned, "--symmetry", str(info)) == 0
    assert degrees(capsys.readouterr().out) < 3
    assert run(["evaluate", str(tmp_path / "auto"), str(folder / "scene")]) == 0
    (score,) = json.loads((tmp_path / "auto/evaluation/result.json").read_text())["objects"]
    assert "with its symmetries" in capsys.readouterr().out
    assert score["mssd_mm"]["max"] < 5 < score["add_mm"]["mean"]
    assert score["adds_mm"]["max"] < 5


def test_an_object_that_is_lost_in_all_frames_gives_exit_code_3_and_the_next_step(folder, tmp_path, capsys):
    turned = str(folder / "turned.json")
    assert track(folder, tmp_path / "out", "--init", turned, scene="wall") == 3
    out, err = capsys.readouterr()
    assert f"box lost, images 0 to {FRAMES - 1}: " in out
    assert f"box is lost in all {FRAMES} frames" in err
    assert "next: --mode rgb, if the object is black, shiny or transparent; or check the poses' unit" in err
    assert (tmp_path / "out/report.json").is_file()


def report(out):
    return json.loads((out / "report.json").read_text())


def test_by_colour_alone_every_frame_is_weak_and_near(folder, tmp_path):
    assert track(folder, tmp_path / "rgb", "--mode", "rgb", "-q") == 0
    assert report(tmp_path / "rgb")["settings"]["mode"] == "rgb"
    with st.open_sequence(folder / "scene") as seq:
        lines = np.loadtxt(tmp_path / "rgb/trajectory_0.txt", ndmin=2)
        assert len(lines) == FRAMES
        for i, line in enumerate(lines):
            assert np.linalg.norm(line[1:3] - seq.ground_truth[i][0][:2, 3]) < 0.002


@pytest.mark.parametrize("more", [(), ("--outline",), ("--no-outline",)])
def test_the_outline_is_read_where_it_is_asked_for(folder, tmp_path, more):
    assert track(folder, tmp_path / "out", "-q", *more) == 0
    assert report(tmp_path / "out")["settings"]["tracker"]["outline"] is ("--no-outline" not in more)
