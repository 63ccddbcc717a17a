# SPDX-License-Identifier: MIT
"""Whether the tracker knows what it does not know: correlated errors, a wrong shape, a wrong place."""

import numpy as np
import pytest

import sdftrack as st
from experiments.trust import confidence
from sdftrack import _core, geometry, synth

# The factor's sd at 70 x 70 white pixels is about 1 / sqrt(24 windows, overlapping by half), 0.15; three of them.
WHITE_ATOL = 0.45
SCALE_M, FLOOR = 0.002, 0.1


def block_noise(side, size=70, seed=0):
    """(pixels of a disc, noise of 1 sigma that squares of side x side pixels share)."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[:size, :size]
    disc = (u - size / 2) ** 2 + (v - size / 2) ** 2 < (size / 2) ** 2
    blocks = -(-size // side)
    noise = np.kron(rng.standard_normal((blocks, blocks)), np.ones((side, side)))[:size, :size]
    return u[disc].astype(np.float32), v[disc].astype(np.float32), noise[disc].astype(np.float32)


@pytest.mark.parametrize("side", [1, 2, 4])
def test_the_correlation_area_is_the_size_of_the_blocks_that_share_an_error(side):
    areas = []
    for seed in range(20):
        u, v, noise = block_noise(side, seed=seed)
        areas.append(_core.correlation_area(u, v, SCALE_M * noise, SCALE_M, FLOOR))
    # Half-overlapping windows of 10 pixels see of a block of 4 what does not cross their border: 0.8 of it.
    assert 0.7 * side**2 < np.mean(areas) < side**2 + WHITE_ATOL
    assert areas[0] == pytest.approx(side**2, rel=3 * WHITE_ATOL / np.sqrt(2))


# --- status and confidence
CAMERA = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
BOX_M = [0.12, 0.09, 0.06]
RIGHT, WRONG = 0.8, 0.5  # confidence above, below
CLEARLY = 0.3  # of the right pose over the same pose disturbed


@pytest.fixture(scope="module")
def box():
    return st.SDF.box(BOX_M, voxels=80)


def scene(shape, seed=0, clutter="table", noise="kinect", occluder=None):
    """(frame, T_cam_obj) of a shape among other things."""
    seq = synth.sequence(
        shape, 1, None, noise, occluder, seed, camera=CAMERA, clutter=clutter, color=False, threads=1
    )
    return seq[0], np.asarray(seq.ground_truth[0][0])


def moved(T, metres, degrees, seed=0):
    rng = np.random.default_rng(seed)
    d, w = rng.normal(size=3), rng.normal(size=3)
    out = geometry.pose(np.radians(degrees) * w / np.linalg.norm(w)) @ T
    out[:3, 3] = T[:3, 3] + metres * d / np.linalg.norm(d)
    return out


@pytest.mark.parametrize("clutter", ["wall", "table", "objects"])
@pytest.mark.parametrize("noise", [0.001, "kinect"])
def test_a_cube_that_fits_two_faces_of_a_longer_box_is_not_called_ok(box, clutter, noise):
    cube = st.SDF.box([0.1, 0.1, 0.1], voxels=80)
    # the first view shows one face alone, in which the cube may slide: ok, not believed
    for seed in range(3):
        frame, T = scene(box, seed, clutter, noise)
        right = st.Tracker(box, CAMERA, threads=1, recover=False).start(frame, poses=[T])
        assert right.ok
        assert right.confidence[0] > RIGHT
        start = moved(T, 0.01, 6, seed)
        start[2, 3] += 0.005
        wrong = st.Tracker(cube, CAMERA, threads=1, recover=False).start(frame, poses=[start])
        assert wrong.confidence[0] < WRONG
        if seed:
            assert not wrong.ok
            assert wrong.reason[0]


@pytest.mark.parametrize(("metres", "degrees"), [(0.03, 0), (0, 25), (0.025, 15), (0.05, 40)])
def test_a_disturbed_pose_judged_as_it_is_is_not_believed(box, metres, degrees):
    tracker = st.Tracker(box, CAMERA, threads=1)
    wrong = []
    for seed in range(5):
        frame, T = scene(box, seed)
        right = confidence.judged(tracker, frame, T)["confidence"]
        assert right > RIGHT
        wrong.append(confidence.judged(tracker, frame, moved(T, metres, degrees, seed)).get("confidence", 0))
        assert wrong[-1] < right - CLEARLY
    assert np.median(wrong) < WRONG  # a box hardly changes its looks under some turns


def test_an_object_that_is_not_there_is_not_found_in_a_table(box):
    absent = st.SDF.ellipsoid([0.06, 0.045, 0.03], voxels=60)
    believed = 0
    for seed in range(12):
        frame, _ = scene(box, seed, "objects")
        rng = np.random.default_rng(seed)
        v, u = np.nonzero((frame.depth > 0) & (frame.depth < 1.5))
        k = rng.integers(len(v))
        ray = np.array([(u[k] - CAMERA.cx) / CAMERA.fx, (v[k] - CAMERA.cy) / CAMERA.fy, 1.0])
        T = geometry.pose(rng.normal(size=3), (float(frame.depth[v[k], u[k]]) + 0.03) * ray)
        result = st.Tracker(absent, CAMERA, threads=1, recover=False).start(frame, poses=[T])
        believed += result.ok or result.confidence[0] > WRONG
    assert believed == 0
