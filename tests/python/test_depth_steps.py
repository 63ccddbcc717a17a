# SPDX-License-Identifier: MIT
"""Measurements at a step of the depth image that lie between its two sides are no evidence against a pose."""

import cv2
import numpy as np
import pytest

import sdftrack as st

FRAMES = 30


def flying_pixels(depth, cosine, rng):
    """The mean over 5 px wherever depth changes by more than 30 mm there, and white noise of 1 mm."""
    kernel = np.ones((5, 5), np.uint8)
    step = cv2.dilate(depth, kernel) - cv2.erode(depth, kernel) > 0.03
    mixed = np.where(step, cv2.blur(depth, (5, 5)), depth)
    return np.where(depth > 0, mixed + rng.normal(0, 0.001, depth.shape), 0).astype(np.float32)


@pytest.fixture(scope="module")
def duck():
    return st.SDF.from_mesh(st.synth.duck_mesh(), voxels=100)


def statuses(shape, noise, scale=1.0):
    walk = st.synth.random_walk(step_m=0.004, step_rad=0.03)
    mesh = st.synth.duck_mesh()
    seen = st.Mesh(scale * np.asarray(mesh.vertices), mesh.faces)
    sequence = st.synth.sequence(seen, FRAMES, trajectory=walk, noise=noise, clutter="objects", seed=31)
    tracker = st.Tracker(shape, sequence.camera, threads=1)
    results = [tracker.start(sequence[0], poses=[sequence.ground_truth[0][0]])]
    results += [tracker.track(sequence[i]) for i in range(1, FRAMES)]
    off_m = [
        np.linalg.norm(r.pose[:3, 3] - sequence.ground_truth[i][0][:3, 3]) for i, r in enumerate(results)
    ]
    return [str(r.status[0]) for r in results], off_m


def test_flying_pixels_make_no_right_pose_weak(duck):
    status, off_m = statuses(duck, flying_pixels)
    assert max(off_m) < 0.001
    assert status.count("ok") >= 0.95 * FRAMES


def test_what_is_seen_past_a_model_that_is_too_large_still_counts(duck):
    """There, too, the measurements beside the silhouette are at a step, but on its far side."""
    status, _ = statuses(duck, flying_pixels, scale=0.85)
    assert status.count("ok") <= 1
