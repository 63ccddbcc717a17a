# SPDX-License-Identifier: MIT
"""Bad input from the command line: the line names the file and what to type instead."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tracking_scene import CAMERA, POSE, box_mesh, frame_of

import sdftrack as st
from sdftrack import geometry
from sdftrack.cli.app import as_options, options_of, parser, run

FRAMES, COUNT = 3, 400
OPTIONS = options_of(parser(), ["calibrate", "color", "SEQ"])


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """Three images of a still box as a BOP scene, without a model of its own."""
    root = tmp_path_factory.mktemp("scene") / "000001"
    frames = [frame_of(seed=i) for i in range(FRAMES)]
    st.save_sequence(root, st.Sequence(frames, CAMERA, np.stack([POSE] * FRAMES)), layout="bop")
    return root


def told(scene, tmp_path, capsys, *arguments, code=1):
    out = tmp_path / "out"
    common = ["track", str(scene), "--out", str(out), "--no-video", "--voxels", "60"]
    assert run([*common, *arguments]) == code
    text = capsys.readouterr()
    if code in (1, 2):  # 3: all went well, and nothing was found
        assert text.err.count("\n") == 1
        assert not out.exists()
    return text.err if code in (1, 2) else text.out


ALL = slice(None)


def save(tmp_path, factor=1.0, faces=ALL):
    path = tmp_path / "box.ply"
    mesh = box_mesh()
    st.Mesh(factor * mesh.vertices, mesh.faces[faces]).save(path)
    return str(path)


def test_a_unit_that_makes_a_speck_is_refused(scene, tmp_path, capsys):
    assert "0.00012 m" in told(scene, tmp_path, capsys, "--model", save(tmp_path), "--unit", "mm")


def test_an_open_model_is_refused_with_the_option_that_closes_it(scene, tmp_path, capsys):
    model = save(tmp_path, faces=slice(0, -1))
    assert "--holes close" in told(scene, tmp_path, capsys, "--model", model)
    assert "box" in told(scene, tmp_path, capsys, "--model", model, "--holes", "close", code=0)


def test_a_thin_model_names_the_voxels_to_ask_for(scene, tmp_path, capsys):
    path = tmp_path / "plate.ply"
    box_mesh((0.2, 0.2, 0.003)).save(path)
    line = told(scene, tmp_path, capsys, "--model", str(path))
    assert "--voxels " in line
    advised = line.split("--voxels ")[1].split()[0]
    told(scene, tmp_path, capsys, "--model", str(path), "--voxels", advised, code=3)  # not what is there


def test_a_plate_too_thin_for_any_volume_is_not_told_to_use_more_voxels(scene, tmp_path, capsys):
    path = tmp_path / "foil.ply"
    box_mesh((0.2, 0.2, 0.0003)).save(path)
    assert "thicken" in told(scene, tmp_path, capsys, "--model", str(path))


def test_a_lost_object_is_told_with_its_images_and_the_reason(scene, tmp_path, capsys):
    path = tmp_path / "poses.json"
    path.write_text(json.dumps({"T_cam_obj": [geometry.pose(t_m=(0, 0, 0.2)).tolist()]}))
    other = save(tmp_path, factor=2.0)  # twice the size of what is in the images, or it would be found again
    text = told(scene, tmp_path, capsys, "--model", other, "--init", str(path), code=3)
    assert f"box lost, images 0 to {FRAMES - 1}: " in text


def ball(scale=1.0):
    v = np.random.default_rng(0).normal(size=(COUNT, 3))
    return scale * (0.05 * v / np.linalg.norm(v, axis=1, keepdims=True) + [0, 0, 1])


@pytest.mark.parametrize("separator", [",", ", ", ";", "\t"])
def test_coordinates_may_be_parted_by_commas(tmp_path, separator):
    path = tmp_path / "cloud.xyz"
    path.write_text("# x y z\n" + "\n".join(separator.join(f"{c:.6f}" for c in p) for p in ball()))
    assert run(["fit", str(path), "--kind", "sphere", "--out", str(tmp_path / "out"), "-q"]) == 0


def test_a_cloud_in_millimetres_is_refused_unless_the_unit_is_said(tmp_path, capsys):
    path = tmp_path / "cloud.npy"
    np.save(path, ball(1e3))
    out = str(tmp_path / "out")
    assert run(["fit", str(path), "--kind", "sphere", "--out", out]) == 1
    assert "are they in mm? pass --unit mm" in capsys.readouterr().err
    assert run(["fit", str(path), "--kind", "sphere", "--unit", "mm", "--out", out]) == 0
    assert "radius 50.0" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("python", "shell"),
    [
        ("pass unit='mm'", "pass --unit mm"),
        ("or colour is late (time_offset=True)", "or colour is late (--time-offset)"),
        ("ball_color: grey; paint the ball, or pass mask_fn=", "--ball-color: grey; paint the ball"),
        ("move the ball, or pass color_camera=", "move the ball, or pass --color-camera"),
        ("pass ball_color=(r, g, b) or mask_fn=", "pass --ball-color r,g,b"),
        ("leave them out (points[np.isfinite(points).all(axis=1)])", "leave them out"),
        ("holds files; pass overwrite=True", "holds files; pass --overwrite"),
        ("fx=500 is far", "fx=500 is far"),
    ],
)  # fmt: skip
def test_advice_is_in_options_and_what_has_none_is_left_out(python, shell):
    assert as_options(python, OPTIONS) == shell
