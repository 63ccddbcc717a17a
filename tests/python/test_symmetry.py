# SPDX-License-Identifier: MIT
"""Symmetries: found in a distance field, read from BOP's file, and what poses are equal by them."""

import json

import numpy as np
import pytest

import sdftrack as st
from sdftrack.geometry import pose, transform_points
from sdftrack.io.writers import save_sequence
from sdftrack.sdf import SDF

VOXELS = 50
CAN = st.Symmetry(continuous=(([0, 0, 2.0], [0.01, 0, 0]),))
HALF = st.Symmetry(np.diag([-1.0, -1, 1, 1])[None])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sdf", "discrete", "continuous"),
    [
        (SDF.box((0.1, 0.08, 0.06), voxels=VOXELS), 3, 0),
        (SDF.box((0.08, 0.08, 0.1), voxels=VOXELS), 7, 0),
        (SDF.box((0.08, 0.08, 0.08), voxels=VOXELS), 23, 0), (SDF.cylinder(0.03, 0.1, voxels=VOXELS), 1, 1),
        (SDF.cone(0.03, 0.1, voxels=VOXELS), 0, 1), (SDF.sphere(0.05, voxels=VOXELS), 0, 2),
        (SDF.ellipsoid((0.05, 0.04, 0.03), voxels=VOXELS), 3, 0),
    ],
    ids=["box", "square box", "cube", "cylinder", "cone", "ball", "ellipsoid"],
)  # fmt: skip
def test_the_symmetries_of_a_solid_are_found_in_its_distances_wherever_it_lies(sdf, discrete, continuous):
    T = pose([0.4, -0.3, 0.8], [0.02, 0.01, -0.03])
    for shape in (sdf, sdf.transformed(T)):
        found = st.find_symmetries(shape)
        assert (len(found.discrete), len(found.continuous)) == (discrete, continuous)
        for S in found.motions(5):
            off = np.abs(shape(transform_points(S, shape.surface_samples(60)[0].astype(np.float64))))
            assert np.quantile(off, 0.95) < 1.5 * shape.voxel_size


def test_a_shape_without_symmetry_has_none(data_dir):
    path = data_dir / "meshes" / "bunny.ply"
    if not path.is_file():
        pytest.skip(f"no {path}")
    assert not st.find_symmetries(SDF.from_mesh(path, voxels=100))
    arm = SDF.box((0.03, 0.06, 0.04), voxels=VOXELS).transformed(pose(t_m=[0.03, 0.02, 0.013]))
    assert not st.find_symmetries(st.union(SDF.box((0.1, 0.03, 0.03), voxels=VOXELS), arm))


def test_a_canonical_pose_is_the_equal_one_nearest_to_the_wanted_rotation():
    rng = np.random.default_rng(0)
    for _ in range(5):
        T = pose(rng.normal(size=3), rng.normal(size=3))
        turn = pose([0, 0, rng.uniform(-3, 3)])
        turn[:3, 3] = np.array([0.01, 0, 0]) - turn[:3, :3] @ [0.01, 0, 0]
        np.testing.assert_allclose(CAN.canonical(T @ turn, near=T), T, atol=1e-12)
        np.testing.assert_allclose(CAN.canonical(T @ turn), CAN.canonical(T), atol=1e-9)
        np.testing.assert_allclose(HALF.canonical(T @ HALF.discrete[0], near=T), T, atol=1e-12)
        both = st.Symmetry(np.diag([1.0, -1, -1, 1])[None], (([0, 0, 1.0], [0, 0, 0]),))
        moved = T @ np.diag([1.0, -1, -1, 1]) @ pose([0, 0, 0.7])
        np.testing.assert_allclose(both.canonical(moved, near=T), T, atol=1e-9)


def test_the_file_of_bop_is_read_in_millimetres(tmp_path):
    info = {
        "symmetries_discrete": [[-1, 0, 0, 2, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]],
        "symmetries_continuous": [{"axis": [0, 0, 1], "offset": [10, 0, 0]}],
    }
    S = st.Symmetry.from_bop(info)
    assert S.discrete[0, 0, 3] == pytest.approx(0.002)
    np.testing.assert_allclose(S.continuous[0][1], [0.01, 0, 0])
    assert st.Symmetry.from_bop(S.to_dict()).to_dict() == S.to_dict()
    camera = st.Camera(60, 60, 39.5, 29.5, 80, 60)
    box = SDF.box((0.1, 0.08, 0.06), voxels=30).to_mesh()
    seq = st.synth.sequence(box, 1, pose(t_m=[0, 0, 0.6])[None], camera=camera)
    save_sequence(tmp_path / "s", seq, layout="bop")
    (tmp_path / "s/models").mkdir(exist_ok=True)
    (tmp_path / "s/models/models_info.json").write_text(json.dumps({"1": info, "2": {}}))
    with st.open_sequence(tmp_path / "s") as opened:
        assert list(opened.symmetries) == [1]
        assert opened[:1].symmetries[1].to_dict() == S.to_dict()


def test_a_continuous_symmetry_in_steps_goes_round_once():
    motions = CAN.motions()
    assert len(motions) == 315
    radius = 0.04
    ring = motions @ np.array([0.01 + radius, 0, 0, 1])
    steps = np.linalg.norm(np.diff(np.concatenate([ring, ring[:1]]), axis=0), axis=1)
    assert steps.max() <= 0.01 * 2 * radius  # 1 % of the diameter
    assert len(st.Symmetry().motions()) == 1
    assert not st.Symmetry()
