# SPDX-License-Identifier: MIT
"""``scale="free"``: the scale of an object whose form is known, with its interval, from several starts."""

import json
import math

import numpy as np
import pytest
from tracking_scene import followed

import sdftrack as st
from experiments.trust.coverage import error_vector
from sdftrack.cli.app import run

CAMERA = st.Camera(300.0, 300.0, 159.5, 119.5, 320, 240)
FRAMES = 14
FORM = st.synth.duck_mesh()


@pytest.fixture(scope="module")
def model():
    return st.SDF.from_mesh(FORM, voxels=64)


def seen(scale, mesh=FORM, seed=3):
    large = st.Mesh(scale * mesh.vertices, mesh.faces)
    path = st.synth.random_walk(step_m=0.003, step_rad=0.03)
    return st.synth.sequence(
        large, FRAMES, path, noise=0.001, camera=CAMERA, clutter="objects", seed=seed, color=True
    )


def distance2(result, truth):
    d = error_vector(result.pose, truth)
    return d @ np.linalg.solve(result.covariance, d)


@pytest.mark.parametrize("start", ["pose", "mask"])
@pytest.mark.parametrize("scale", [0.85, 1.0, 1.15])
def test_the_scale_and_the_pose_are_found_and_the_interval_holds(model, scale, start):
    sequence = seen(scale)
    tracker = st.Tracker(model, CAMERA, threads=1, scale="free")
    places = {"poses": sequence.ground_truth[0][0]} if start == "pose" else {"masks": sequence.masks(0)[0]}
    results = followed(tracker, sequence, **places)
    (found,) = tracker.scales
    assert found.interval95[0] < scale < found.interval95[1]
    assert found.scale == pytest.approx(scale, rel=0.01)
    assert results[-1].ok
    for i, result in enumerate(results):
        assert not result.ok or distance2(result, sequence.ground_truth[i][0]) < 60  # 5 sd, six axes: 150
    assert st.metrics.pose_error(results[-1].pose, sequence.ground_truth[FRAMES - 1][0])[0] < 0.001
    assert tracker.shapes[0].voxel_size == pytest.approx(model.voxel_size * scale, rel=0.01)


@pytest.mark.parametrize("scale", [0.6, 2.5])
def test_a_mask_shows_any_scale(model, scale):
    sequence = seen(scale)
    tracker = st.Tracker(model, CAMERA, threads=1, scale="free")
    followed(tracker, sequence, masks=sequence.masks(0)[0])
    assert tracker.scales[0].scale == pytest.approx(scale, rel=0.015)


def test_what_does_not_show_the_scale_is_weak():
    """Of one face of a box in depth: any size fits."""
    box = st.SDF.box((0.2, 0.2, 0.2), voxels=48)
    rng = np.random.default_rng(0)
    depth = np.zeros(CAMERA.shape, np.float32)
    depth[100:140, 140:180] = 0.5 + rng.normal(0, 0.001, (40, 40))
    tracker = st.Tracker(box, CAMERA, threads=1, scale="free", mode="depth")
    result = tracker.start(st.Frame(depth), poses=st.geometry.pose([0, 0, 0], [0, 0, 0.6]))
    assert str(result.status[0]) != "ok"
    assert math.isinf(tracker.scales[0].sd)
    assert str(tracker.scales[0]) == "scale not known"


def test_a_declared_symmetry_grows_with_the_shape():
    can = st.SDF.cylinder(0.033, 0.1, voxels=48)
    moved = st.SDF(can.values, can.voxel_size, can.origin + np.array([0.05, 0.02, 0.0]))
    symmetry = st.Symmetry(continuous=(([0, 0, 1], [0.05, 0.02, 0.0]),))
    sequence = seen(1.2, moved.to_mesh())
    tracker = st.Tracker(moved, CAMERA, threads=1, scale="free", symmetry=symmetry, mode="depth")
    followed(tracker, sequence, masks=sequence.masks(0)[0])
    assert tracker.scales[0].scale == pytest.approx(1.2, rel=0.02)
    np.testing.assert_allclose(
        tracker._symmetries[0].continuous[0][1],
        np.array([0.05, 0.02, 0]) * tracker.shapes[0].voxel_size / moved.voxel_size,
        rtol=1e-6,
    )


def test_the_volume_is_enlarged_about_the_origin_of_its_frame(model):
    aside = st.SDF(model.values, model.voxel_size, model.origin + np.array([0.05, 0.02, 0.0]))
    sequence = seen(1.5, aside.to_mesh())
    tracker = st.Tracker(aside, CAMERA, threads=1, scale="free")
    tracker.start(sequence[0], masks=sequence.masks(0)[0])
    large = tracker.shapes[0]
    factor = large.voxel_size / aside.voxel_size
    assert factor == pytest.approx(1.5, rel=0.015)
    points = np.array([[0.06, 0.04, 0.03], [0.03, 0.02, 0.01]])
    np.testing.assert_allclose(large(factor * points), factor * aside(points), atol=1e-6)


def test_a_primitive_has_free_sizes_anyway():
    with pytest.raises(ValueError, match="a Primitive, whose sizes are free anyway"):
        st.Tracker(st.Primitive("cylinder"), CAMERA, scale="free")


def test_the_command_reports_the_scale(tmp_path, capsys):
    FORM.save(tmp_path / "duck.ply")
    st.save_sequence(tmp_path / "scene", seen(1.1), layout="bop")
    command = ["track", str(tmp_path / "scene"), "--model", str(tmp_path / "duck.ply"), "--voxels", "64"]
    out = tmp_path / "out"
    assert run([*command, "--no-video", "--scale", "free", "--out", str(out)]) == 0
    assert "scale 1.1" in capsys.readouterr().out
    report = json.loads((out / "report.json").read_text())
    (scale,) = report["scales"]
    assert scale["interval95"][0] < 1.1 < scale["interval95"][1]
    assert report["settings"]["scale"] == "free"
    assert run([*command, "--scale", "free", "--mode", "rgb", "--out", str(tmp_path / "no")]) == 2
    assert "--scale" in capsys.readouterr().err
    assert not (tmp_path / "no").exists()
