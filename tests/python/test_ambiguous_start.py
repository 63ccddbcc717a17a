# SPDX-License-Identifier: MIT
"""A start that several poses explain stays doubted until frames tell them apart, or the symmetry is declared."""

import numpy as np
import pytest
from tracking_scene import CAMERA, NOISE_M, WALL_M

import sdftrack as st
from sdftrack import geometry

SIZE = (0.08, 0.08, 0.08)
POSE = geometry.pose([0.5, -0.6, 0.2], [0.01, 0.02, 0.5])


def cube():
    return st.SDF.box(SIZE, voxels=60)


def frames(sdf, poses, noise_m=NOISE_M):
    """The shape before a wall."""
    rng = np.random.default_rng(0)
    for T in poses:
        depth = sdf.render(CAMERA, T)[0]
        seen = depth + rng.normal(0, noise_m, depth.shape)
        yield st.Frame(np.where(depth > 0, seen, WALL_M).astype(np.float32))


def turning(count, step=(0.01, 0.02, 0.0)):
    out = []
    for i in range(count):
        T = POSE.copy()
        T[:3, :3] = geometry.pose([i * s for s in step], [0, 0, 0])[:3, :3] @ POSE[:3, :3]
        out.append(T)
    return out


def followed(sdf, poses, start=None, **options):
    """Results with their true poses; from the mask in the first image, or another start."""
    tracker = st.Tracker(sdf, CAMERA, threads=1, **options)
    for i, (frame, T) in enumerate(zip(frames(sdf, poses), poses, strict=True)):
        begun = start or {"masks": sdf.silhouette(CAMERA, T)}
        yield (tracker.track(frame) if i else tracker.start(frame, **begun)), T


def test_the_turns_of_a_cube_stay_ambiguous_while_it_is_followed():
    sdf = cube()
    points, alike = sdf.surface_samples(300)[0].astype(float), st.find_symmetries(sdf)
    for result, T in followed(sdf, turning(8)):
        assert str(result.status[0]) == "weak"
        assert "ambiguous" in result.reason[0]
        assert result.runner_up[0] > 0.95 or result.index  # of the search
        assert result.confidence[0] <= 0.5
        assert st.metrics.mssd(result.pose, T, points, alike) < 0.003


def test_a_pose_that_is_given_is_not_ambiguous():
    for result, _ in followed(cube(), turning(3), {"poses": POSE}):
        assert str(result.status[0]) == "ok"


def test_a_declared_symmetry_leaves_one_answer():
    sdf = cube()
    symmetry = st.find_symmetries(sdf)
    assert len(symmetry.discrete) == 23
    last = None
    for result, _ in followed(sdf, turning(6), symmetry=symmetry):
        assert str(result.status[0]) == "ok"
        np.testing.assert_allclose(result.pose, symmetry.canonical(result.pose, near=last), atol=1e-9)
        last = result.pose


@pytest.mark.parametrize("shape", ["cube", "can"])
def test_results_of_a_declared_symmetry_do_not_jump_when_the_object_is_found_anew(shape):
    sdf = cube() if shape == "cube" else st.SDF.cylinder(0.04, 0.12, voxels=60)
    symmetry = st.find_symmetries(sdf)
    assert bool(symmetry.continuous) == (shape == "can")
    turns = (
        [geometry.pose(0.7 * np.asarray(symmetry.continuous[0][0]))]
        if shape == "can"
        else symmetry.discrete[:6]
    )
    tracker = st.Tracker(sdf, CAMERA, threads=1, symmetry=symmetry)
    (frame,) = frames(sdf, [POSE])
    begun = tracker.start(frame, poses=POSE).pose
    for S in turns:
        # As a search might have found it.
        tracker._core.replace_shapes([sdf._core_args], np.ascontiguousarray(POSE @ S)[None])
        told = tracker.track(frame).pose
        assert st.metrics.pose_error(told, begun)[1] < np.deg2rad(1.0)


def test_the_other_side_tells_turns_apart():
    """A cube with a block on one face, which the first frames do not show."""
    cube_mesh = st.SDF.box(SIZE, voxels=70).to_mesh()
    block = st.SDF.box((0.03, 0.03, 0.03), voxels=40).to_mesh()
    shifted = block.vertices + np.array([0.02, 0.008, 0.05])
    vertices = np.concatenate([cube_mesh.vertices, shifted])
    faces = np.concatenate([cube_mesh.faces, block.faces + len(cube_mesh.vertices)])
    sdf = st.SDF.from_mesh(st.Mesh(vertices, faces), voxels=80)
    hidden = geometry.pose([0.5, -0.6, 0.0], [0, 0, 0.5])  # the block is behind
    angles = np.linspace(0, 2.2, 60)
    poses = []
    for angle in angles:
        T = hidden.copy()
        T[:3, :3] = geometry.pose([0, angle, 0], [0, 0, 0])[:3, :3] @ hidden[:3, :3]
        poses.append(T)
    states = [(r.status[0], st.metrics.pose_error(r.pose, T)[1]) for r, T in followed(sdf, poses)]
    assert states[-1][0] == "ok"
    assert states[-1][1] < np.deg2rad(3)
    assert all(error < np.deg2rad(5) for status, error in states if status == "ok")


def test_colours_win_over_a_declared_symmetry():
    sdf = cube()
    colors = np.zeros((*sdf.values.shape, 4), np.uint8)
    colors[..., 0], colors[..., 3] = 200, 255
    painted = st.SDF(sdf.values, sdf.voxel_size, sdf.origin, colors)
    symmetry = st.find_symmetries(sdf)
    (frame,) = frames(sdf, [POSE])
    turned = POSE @ symmetry.discrete[0]
    depth = st.Tracker(painted, CAMERA, mode="depth", threads=1, symmetry=symmetry)
    rgbd = st.Tracker(painted, CAMERA, threads=1, symmetry=symmetry)
    for tracker, stays in ((depth, True), (rgbd, False)):
        begun = tracker.start(frame, poses=POSE).pose
        tracker._core.replace_shapes([sdf._core_args], np.ascontiguousarray(turned)[None])
        near = st.metrics.pose_error(tracker.track(frame).pose, begun)[1] < np.deg2rad(1.0)
        assert near == stays
