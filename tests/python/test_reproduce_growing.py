# SPDX-License-Identifier: MIT
"""The figures on reconstruction, in small."""

from __future__ import annotations

import json

import numpy as np
import pytest

import sdftrack as st
from experiments.figures import main
from experiments.thesis import fig_4_16
from experiments.thesis.fig_4_14 import SIGMAS_VOXELS, aligned_error
from experiments.thesis.measures.seen_part import sampled
from experiments.thesis.speed_4_6 import evidence
from sdftrack import geometry
from sdftrack.synth.duck import duck_mesh

SMALL = st.Camera(262.0, 262.0, 159.5, 119.5, 320, 240)


def made(figure, tmp_path, frames):
    assert main([figure, "--frames", str(frames), "--out", str(tmp_path)]) == 0
    out = tmp_path / figure
    assert {p.name for p in out.iterdir()} == {"figure.png", "table.txt", "result.json"}
    return json.loads((out / "result.json").read_text())


@pytest.mark.slow
def test_figure_4_13b_in_small_keeps_what_is_printed(tmp_path, capfd):
    levels = made("4.13b", tmp_path, 3)["levels"]
    assert [r["way"] for r in levels] == ["from a ball", "as printed", "known model"] * 2
    assert all(r["kept"] and r["not_ok"] == 0 for r in levels)
    assert "3 mm, 6 deg" in capfd.readouterr().out


@pytest.mark.slow
def test_figure_4_14_in_small_has_a_row_for_each_reach(tmp_path):
    levels = made("4.14", tmp_path, 2)["levels"]
    assert [r["sigma_d"] for r in levels] == [*(f"{s:g} voxels" for s in SIGMAS_VOXELS), "ours"]
    for row in levels:
        assert row["looks"] == [0, 1]
        assert 2 < row["surface_mm"][0] < 20  # a ball in place of what has not been seen
        assert row["max_mm"] < 3


@pytest.mark.slow
@pytest.mark.parametrize("there", [False, True])
def test_figure_4_16_in_small_says_when_the_whole_scene_is_left_out(tmp_path, capfd, monkeypatch, there):
    from experiments.thesis.measures import whole_scene

    def path(seq, n, step):
        if not there:
            raise ImportError("no Open3D")
        return geometry.inverse(np.array([seq.ground_truth[i][0] for i in range(n)]))

    monkeypatch.setattr(whole_scene, "camera_path", path)
    levels = made("4.16", tmp_path, 4)["levels"]
    pairs = ["object - whole scene", "object - truth", "whole scene - truth"]
    assert [r["paths"] for r in levels] == (pairs if there else pairs[1:2])
    assert all(r["rms_mm"] < 3 for r in levels)
    assert levels[0]["not_ok"] == 0
    assert ("pip install open3d" in capfd.readouterr().out) == (not there)
    assert ("left out" in (tmp_path / "4.16" / "table.txt").read_text()) == (not there)


def test_the_whole_scene_is_followed_where_open3d_is_there():
    pytest.importorskip("open3d")
    from experiments.thesis.measures.whole_scene import camera_path

    mesh = duck_mesh()
    poses = fig_4_16.carried(mesh, 4)
    both = [mesh, fig_4_16.around(mesh)]
    seq = st.synth.sequence(both, 4, np.stack([poses, poses], 1), 0.001, camera=SMALL)
    found = geometry.inverse(poses[0]) @ camera_path(seq, 4)
    metres, radians = st.metrics.pose_error(geometry.inverse(found), poses)
    assert metres.max() < 0.015  # its model is young
    assert radians.max() < np.deg2rad(1.0)


def test_paths_are_compared_after_their_centres_are_laid_upon_each_other():
    path = geometry.inverse(fig_4_16.carried(duck_mesh(), 40))
    moved = geometry.pose([0.2, -0.4, 1.0], [0.3, 0.1, -0.2]) @ path
    np.testing.assert_allclose(fig_4_16.aligned(moved, path), path, atol=1e-9)


def test_nothing_about_the_object_touches_it():
    mesh = duck_mesh()
    rest = fig_4_16.around(mesh).vertices
    beside = rest[rest[:, 2] > mesh.bounds[0, 2] + 1e-6]
    far = np.linalg.norm(beside[:, None, :2] - mesh.vertices[None, ::20, :2], axis=2).min()
    assert far > 0.02


@pytest.mark.slow
def test_section_4_6_in_small_times_every_part(tmp_path, capfd):
    levels = made("4.6", tmp_path, 3)["levels"]
    parts = {r["part"]: r for r in levels}
    assert parts["tracking"]["first_ms"] is None  # there is no shape to track by
    assert all(r["later_ms"] > 0 for r in levels)
    for way in ("", ", as printed"):
        *some, whole = [r["later_ms"] for r in levels if r["part"].endswith("as printed") == bool(way)]
        assert len(some) == 3
        assert sum(some) < 1.2 * whole
        assert whole == parts[f"all{way}"]["later_ms"]
    assert "Hz" in capfd.readouterr().out


def test_alignment_finds_the_motion_between_two_like_shapes():
    shape = st.SDF.box((0.10, 0.07, 0.05), voxels=80)
    points, _ = sampled(shape.to_mesh(), 4000)
    moved = geometry.pose([0.02, -0.01, 0.03], [0.002, 0.001, -0.002])
    error, T = aligned_error(shape, geometry.transform_points(geometry.inverse(moved), points), np.eye(4))
    assert error < 1e-4
    np.testing.assert_allclose(T, moved, atol=2e-4)
    larger = st.SDF.sphere(0.052, voxels=80)
    ball, _ = sampled(st.SDF.sphere(0.05, voxels=80).to_mesh(), 4000)
    assert aligned_error(larger, ball, np.eye(4))[0] == pytest.approx(0.002, abs=1e-4)


def test_both_forms_of_the_evidence_agree_far_from_the_reading():
    d = np.array([-20.0, -5.0, 5.0, 20.0])
    np.testing.assert_allclose(evidence(d, 8.0, 1.0), evidence(d, 8.0, None), atol=1e-6)
    assert evidence(np.array([-1e-3]), 8.0, None)[0] < 0.001  # the printed one is sure at once
    assert evidence(np.array([-1e-3]), 8.0, 1.0)[0] == pytest.approx(0.5, abs=1e-3)
