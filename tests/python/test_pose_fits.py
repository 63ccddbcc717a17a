# SPDX-License-Identifier: MIT
"""Many objects of one frame, each fitted on its own."""

import numpy as np
from tracking_scene import CAMERA, POSE, box_mesh, depth_of

import sdftrack as st
from experiments.trust.coverage import error_vector
from sdftrack import geometry, metrics

BOX = st.SDF.from_mesh(box_mesh(), voxels=60)
BALL = st.SDF.sphere(0.03, voxels=40)
POSE_ATOL = 1e-5  # m and rad, between the devices


def moved(T, v=(0.004, -0.003, 0.005), w=(0.03, -0.02, 0.02)):
    return geometry.pose(w, v) @ T


def balls(rows, columns, noise_m=0.0005):
    """Balls in a grid before a wall, their poses, and starts a few millimetres off."""
    poses = [
        geometry.pose([0, 0, 0], [0.075 * (x - (columns - 1) / 2), 0.075 * (y - (rows - 1) / 2), 0.9])
        for y in range(rows)
        for x in range(columns)
    ]
    depth = sum(BALL.render(CAMERA, T)[0] for T in poses)
    rng = np.random.default_rng(1)
    noisy = np.where(depth > 0, depth + rng.normal(0, noise_m, depth.shape), 1.5).astype(np.float32)
    starts = [T @ geometry.pose([0, 0, 0], rng.uniform(-0.004, 0.004, 3)) for T in poses]
    return st.Frame(noisy), poses, starts


def test_the_covariance_says_how_far_off_the_pose_may_be():
    z2 = []
    for seed in range(12):
        frame = st.Frame(depth_of(seed=seed))
        (fit,) = st.fit_poses(BOX, CAMERA, frame, moved(POSE), device="cpu", scale_m=0.001)
        e = error_vector(fit.pose, POSE)
        z2.append(e @ np.linalg.solve(fit.covariance, e) / 6)
    assert 0.1 < np.mean(z2) < 10  # the voxels of an edge are rounded: no reading errs by that


def test_each_of_many_is_as_if_alone():
    frame, _, starts = balls(3, 4)
    together = st.fit_poses(BALL, CAMERA, frame, starts, device="cpu")
    for start, fit in zip(starts, together, strict=True):
        (alone,) = st.fit_poses(BALL, CAMERA, frame, start, device="cpu", threads=1)
        np.testing.assert_array_equal(alone.pose, fit.pose)
        np.testing.assert_array_equal(alone.covariance, fit.covariance)
        assert alone.cost == fit.cost


def test_an_object_that_the_frame_does_not_show_keeps_its_pose():
    away = geometry.pose([0, 0, 0], [5, 0, 0.6])
    seen, unseen = st.fit_poses(BOX, CAMERA, st.Frame(depth_of()), [moved(POSE), away], device="cpu")
    assert seen.pixels > 1000
    assert unseen.pixels == 0
    assert unseen.stop == "no_data"
    np.testing.assert_allclose(unseen.pose, away, atol=1e-12)
    assert np.isfinite(unseen.covariance).all()


def test_a_pose_of_single_precision_is_taken_as_the_nearest_rigid_one():
    frame = st.Frame(depth_of())
    (exact,) = st.fit_poses(BOX, CAMERA, frame, moved(POSE), device="cpu")
    (rounded,) = st.fit_poses(BOX, CAMERA, frame, moved(POSE).astype(np.float32), device="cpu")
    R = rounded.pose[:3, :3]
    assert np.abs(R.T @ R - np.eye(3)).max() < 1e-12
    assert max(metrics.pose_error(rounded.pose, exact.pose)) < POSE_ATOL
