# SPDX-License-Identifier: MIT
"""The corner of a room: exact planes, poses that see all three, noise that repeats, bad input."""

import numpy as np
import pytest

import sdftrack as st
from experiments.synth.room import corner, corner_poses, render_corner

CAMERA = st.Camera(131.25, 131.25, 79.5, 59.5, 160, 120)
FLOAT_M = 1e-6  # depth and rays are float32: half a unit in the last place at 4 m is 2.4e-7


def test_every_reading_lies_on_the_plane_that_it_is_said_to_lie_on():
    seq = corner(5, camera=CAMERA, seed=3)
    for i, frame in enumerate(seq):
        T = seq.ground_truth[i][0]
        depth, cosine, which = render_corner(CAMERA, T)
        np.testing.assert_array_equal(frame.depth, depth)
        p = st.geometry.transform_points(st.geometry.inverse(T), CAMERA.back_project(depth).reshape(-1, 3))
        p, seen = p.reshape(*CAMERA.shape, 3), depth > 0
        off = np.take_along_axis(p, np.maximum(which, 0)[..., None].astype(np.intp), axis=-1)[..., 0]
        assert np.abs(off[seen]).max() < FLOAT_M
        assert p[seen].min() > -FLOAT_M  # nothing is seen through a wall
        assert (cosine[seen] > 0).all()


def test_each_of_the_three_planes_has_a_tenth_of_every_picture():
    for T in corner_poses(40, seed=1):
        which = render_corner(CAMERA, T)[2]
        assert np.bincount(which[which >= 0], minlength=3).min() > 0.1 * which.size


def test_a_true_lens_bends_the_picture_and_not_the_planes():
    lens = st.Camera(131.25, 131.25, 79.5, 59.5, 160, 120, distortion=(0.1, -0.05, 1e-3, 1e-3, 0.0))
    seq = corner(1, camera=lens)
    p = st.geometry.transform_points(
        st.geometry.inverse(seq.ground_truth[0][0]), lens.back_project(seq[0].depth).reshape(-1, 3)
    )
    assert np.abs(p).min(axis=1).max() < FLOAT_M


# The sum of deviations of three angles (thesis, Table 3.1: 2.1 to 7.8 degrees); 0.006 and 0.03 have been seen over 20
# poses. The criterion must be far finer than what it judges.
SUM_LIMIT_DEG = {0.001: 0.02, "kinect": 0.1}


@pytest.mark.parametrize("noise", [0.001, "kinect"])
def test_right_angles_are_right_under_noise(noise):
    seq = corner(4, noise, seed=2)
    for frame in seq:
        assert np.abs(st.metrics.plane_angles(frame, seq.camera) - 90).sum() < SUM_LIMIT_DEG[noise]


def test_the_planes_do_not_depend_on_the_focal_length_that_is_judged():
    """Inverse depth is linear in pixels whatever the focal length: other intrinsics, the same planes."""
    from sdftrack.imaging.plane import three_planes

    frame = corner(1, 0.001, seed=4)[0]
    planes = []
    for f in (525.0, 560.0):
        n, d = three_planes(frame, st.Camera(f, f, 319.5, 239.5, 640, 480), 0.01)
        g = -n / d[:, None]
        planes.append(np.sort(g * [1 / f, 1 / f, 1], axis=0))
    # Which readings are within the slab differs a little; 1e-6 is a micrometre across a pixel at 1 m.
    np.testing.assert_allclose(planes[0], planes[1], atol=1e-3)
    np.testing.assert_allclose(planes[0][:, :2], planes[1][:, :2], atol=3e-6)
