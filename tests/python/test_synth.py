# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from tracking_scene import box_mesh

import sdftrack as st

SURFACE_TOLERANCE_M = 1e-5  # float32 depth at 0.8 m resolves 6e-8 m, rays 1e-7
STEP_TOLERANCE = 1e-9  # bisection in double arithmetic
SMALL = st.Camera(131.25, 131.25, 79.5, 59.5, 160, 120)
HALF = np.array([0.05, 0.07, 0.09])
BOX = box_mesh(2 * HALF)
CORNERS, FACES = BOX.vertices, BOX.faces
OFF_CENTRE = st.Mesh(CORNERS + np.array([0.3, -0.1, 0.2]), FACES)


def _points_on_object(seq: st.Sequence, i: int, k: int = 0) -> np.ndarray:
    points = seq.camera.depth.back_project(seq[i].depth)[seq.masks(i)[k]]
    return st.geometry.transform_points(st.geometry.inverse(seq.ground_truth[i][k]), points)


@pytest.mark.parametrize("trajectory", ["random", "orbit", "static"])
def test_depth_lies_on_the_object_at_its_true_pose(trajectory):
    seq = st.synth.sequence(BOX, 4, trajectory, camera=SMALL, clutter="table", seed=2)
    for i in range(4):
        p = _points_on_object(seq, i)
        assert len(p) > 200
        off = np.abs(p) - HALF  # on a box the largest of the three is 0
        assert np.abs(off.max(axis=1)).max() < SURFACE_TOLERANCE_M
        # And the object is seen wherever it should be: to its outline, but for corners thinner than a pixel.
        px = SMALL.project(st.geometry.transform_points(seq.ground_truth[i][0], CORNERS))
        v, u = np.nonzero(seq.masks(i)[0])
        assert np.abs(px.min(axis=0) - [u.min(), v.min()]).max() < 1.5
        assert np.abs(px.max(axis=0) - [u.max(), v.max()]).max() < 1.5


def test_the_same_arguments_give_the_same_images_in_any_order():
    make = lambda seed: st.synth.sequence(  # noqa: E731
        BOX, 3, noise="kinect", occluder=0.2, clutter=True, camera=SMALL, seed=seed
    )
    a, b, other = make(5), make(5), make(6)
    forward = [a[i] for i in range(3)]
    backward = [b[i] for i in (2, 1, 0)][::-1]
    assert forward == backward
    assert forward[0] != other[0]
    assert not np.array_equal(a.ground_truth[0][0], other.ground_truth[0][0])


@pytest.mark.parametrize(("step_m", "step_deg"), [(0.005, 1.5), (0.018, 6.0), (0.0, 0.0)])
def test_every_step_has_the_wanted_length(step_m, step_deg):
    path = st.synth.random_walk(step_m=step_m, step_rad=np.radians(step_deg))
    seq = st.synth.sequence(OFF_CENTRE, 300, path, camera=SMALL, seed=1)
    T = np.array([seq.ground_truth[i][0] for i in range(300)])
    centre = T[:, :3, :3] @ [0.3, -0.1, 0.2] + T[:, :3, 3]
    steps = np.linalg.norm(np.diff(centre, axis=0), axis=1)
    np.testing.assert_allclose(steps, step_m, atol=STEP_TOLERANCE)
    _, radians = st.metrics.pose_error(T[1:], T[:-1])
    np.testing.assert_allclose(radians, np.radians(step_deg), atol=STEP_TOLERANCE)
    assert (np.abs(centre - [0, 0, 0.8]) <= np.array(path.spread_m) + STEP_TOLERANCE).all()
    if step_m:
        moved = np.diff(centre, axis=0) / step_m
        assert (moved[1:] * moved[:-1]).sum(axis=1).min() > 0  # no sharp corner
        directions = T[:, 2, :3]  # the camera's axis in the object's frame
        assert np.linalg.norm(directions.mean(axis=0)) < 0.6  # many views, not one side


def _noise(kind, n=4):
    noisy = st.synth.sequence(BOX, n, "static", kind, camera=SMALL, clutter="wall", seed=4)
    clean = st.synth.sequence(BOX, n, "static", camera=SMALL, clutter="wall", seed=4)
    return np.array([f.depth for f in noisy]), np.array([f.depth for f in clean])


def test_gaussian_noise_has_its_sigma_and_no_bias():
    noisy, clean = _noise(0.003)
    error = (noisy - clean)[clean > 0]
    # 77,000 samples: the mean to 3 / sqrt(77000) sigma, the deviation to 3 / sqrt(2 * 77000).
    assert abs(error.mean()) < 0.003 * 3 / np.sqrt(error.size)
    assert abs(error.std() / 0.003 - 1) < 3 / np.sqrt(2 * error.size)
    assert (noisy[clean == 0] == 0).all()
    frames = (noisy - clean)[:, 40:80, 20:60].reshape(4, -1)
    assert np.abs(np.corrcoef(frames) - np.eye(4)).max() < 0.1  # fresh in every frame


def test_kinect_noise_grows_with_depth_and_comes_in_steps():
    kinect = st.synth.Kinect(lateral_px=0)
    noisy, clean = _noise(kinect)
    far = (clean > 1.25) & (noisy > 0)
    assert np.std((noisy - clean)[far]) == pytest.approx(
        np.hypot(kinect.sigma_m(1.3), 1.3**2 / (8 * kinect.baseline_m_px) / np.sqrt(12)), rel=0.1
    )
    eighths = 8 * kinect.baseline_m_px / noisy[noisy > 0]
    np.testing.assert_allclose(eighths, np.rint(eighths), atol=1e-3)
    assert kinect.sigma_m(2.0) > 2 * kinect.sigma_m(0.8)


def test_kinect_loses_edges_and_grazing_surfaces():
    noisy, clean = _noise("kinect")
    lost = (noisy == 0) & (clean > 0)
    step = np.abs(np.diff(clean[0], axis=1))[:, :] > 0.1
    beside = np.zeros(clean[0].shape, bool)
    beside[:, 1:] |= step
    beside[:, :-1] |= step
    assert lost[:, beside].mean() == pytest.approx(0.5, abs=0.15)
    assert lost[:, ~beside].mean() < 0.05
    ramp = np.full((50, 50), 1.0, np.float32)
    rng = np.random.default_rng(0)
    assert (st.synth.Kinect()(ramp, np.full_like(ramp, np.cos(np.radians(85))), rng) == 0).all()
    assert (st.synth.Kinect()(ramp, np.full_like(ramp, np.cos(np.radians(60))), rng) > 0).all()


def test_stereo_noise_is_one_of_disparity_shared_over_a_window():
    stereo = st.synth.Stereo(bias_px=0.0, dropped=0.0)
    wall, front = np.full((120, 160), 1.5, np.float32), np.ones((120, 160), np.float32)
    errors = [stereo(wall, front, np.random.default_rng(k)) - wall for k in range(20)]
    assert np.std(errors) == pytest.approx(stereo.sigma_m(1.5), rel=0.05)
    middle = np.array(errors)[:, 20:100, 20:100]
    beside = np.mean(middle[:, :, 1:] * middle[:, :, :-1]) / np.mean(middle**2)
    apart = np.mean(middle[:, :, 9:] * middle[:, :, :-9]) / np.mean(middle**2)
    assert beside == pytest.approx(6 / 7, abs=0.03)
    assert abs(apart) < 0.05
    biased = st.synth.Stereo(dropped=0.0)(wall, front, np.random.default_rng(0))
    assert np.median(biased) - 1.5 == pytest.approx(-0.1 * 1.5**2 / stereo.baseline_m_px, rel=0.2)


def test_stereo_has_a_shadow_beside_what_is_near_and_loses_patches_and_grazing_surfaces():
    depth = np.full((60, 200), 2.0, np.float32)
    depth[:, 80:120] = 0.5
    stereo = st.synth.Stereo(subpixel_px=0.0, bias_px=0.0, dropped=0.0)
    rng = np.random.default_rng(0)
    seen = stereo(depth, np.ones_like(depth), rng) > 0
    width = round(stereo.baseline_m_px * (1 / 0.5 - 1 / 2.0))
    assert not seen[:, 80 - width + 1 : 80].any()
    assert seen[:, : 80 - width - 1].all()
    assert seen[:, 80:].all()
    few = st.synth.Stereo(dropped=0.1)(depth, np.ones_like(depth), rng)
    assert (few[:, 120:] == 0).mean() == pytest.approx(0.1, abs=0.05)
    assert (stereo(depth, np.full_like(depth, np.cos(np.radians(85))), rng) == 0).all()
    crease = (1 + 0.005 * np.abs(np.arange(100) - 50)).astype(np.float32)[None].repeat(40, axis=0)
    rounded = stereo(crease, np.ones_like(crease), rng)
    assert rounded[20, 50] > crease[20, 50] + 0.004  # the tip of the edge is averaged away


@pytest.mark.parametrize("fraction", [0.15, 0.3, 0.6])
def test_a_hand_hides_the_wanted_fraction(fraction):
    bare = st.synth.sequence(BOX, 3, camera=SMALL, seed=8)
    seq = st.synth.sequence(BOX, 3, occluder=fraction, camera=SMALL, seed=8)
    for i in range(3):
        before, after = bare.masks(i)[0], seq.masks(i)[0]
        assert not (after & ~before).any()
        assert 1 - after.sum() / before.sum() == pytest.approx(fraction, abs=0.03)
        hidden = before & ~after
        assert (seq[i].depth[hidden] < bare[i].depth[hidden]).all()
        p = _points_on_object(seq, i)
        assert np.abs((np.abs(p) - HALF).max(axis=1)).max() < SURFACE_TOLERANCE_M


def test_colours_belong_to_the_surface():
    plain = st.synth.sequence(BOX, 2, "static", camera=SMALL, seed=1)
    inside = plain.masks(0)[0]
    a, b = (plain[i].color[inside].astype(float) for i in (0, 1))
    assert np.abs(a - b).max() < 20  # grain alone differs
    assert plain[0].color[inside].std(axis=0).max() > 5  # a texture, not one colour
    red = st.Mesh(CORNERS, FACES, np.tile(np.uint8([200, 20, 10]), (8, 1)))
    color = st.synth.sequence(red, 1, "static", camera=SMALL, seed=1)[0].color[inside].astype(float)
    assert (color[:, 0] > 100).all()
    assert (color[:, 1:] < 40).all()
    assert st.synth.sequence(red, 1, camera=SMALL, color=False)[0].color is None


def test_several_objects_have_their_own_paths_and_models():
    seq = st.synth.sequence([BOX, BOX, OFF_CENTRE], 2, camera=SMALL, seed=2)
    assert seq.objects == [1, 1, 2]
    assert list(seq.models) == [1, 2]
    assert seq.models[2] is OFF_CENTRE
    assert set(seq.ground_truth[0]) == {0, 1, 2}
    masks = seq.masks(0)
    assert all(m.sum() > 100 for m in masks.values())
    for k in (0, 1):
        p = _points_on_object(seq, 0, k)
        assert np.abs((np.abs(p) - HALF).max(axis=1)).max() < SURFACE_TOLERANCE_M
    poses = np.tile(st.geometry.pose(t_m=[0, 0, 0.8]), (2, 2, 1, 1))
    poses[:, 1, 0, 3] = 0.2
    given = st.synth.sequence([BOX, BOX], 2, poses, camera=SMALL)
    assert given.ground_truth[1][1][0, 3] == 0.2
