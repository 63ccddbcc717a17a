# SPDX-License-Identifier: MIT
"""Brightness of coloured surfaces: the energy, coloured volumes, and turns that the shape does not show."""

import numpy as np
import pytest
from reconstruction_scene import begun
from tracking_scene import increment

import sdftrack as st
from experiments.tracking.photometric import follow
from reference.photometric import brightness_at, photometric_cost, ray_hit, surface_normal
from sdftrack import _core
from sdftrack.synth.objects import can_mesh, turning_can
from sdftrack.tracking.core_conversion import rgb_seen

RADIUS_M, VOXELS = 0.04, 48
K = (500.0, 495.0, 159.5, 119.5)
SIGMA = 0.03


def pattern(p):
    """A smooth colour (0..255) of object points."""
    x, y, z = np.moveaxis(np.asarray(p), -1, 0) / 0.006
    return np.stack(
        [128 + 80 * np.sin(x + 0.3 * z), 120 + 70 * np.cos(y - 0.5 * x), 110 + 60 * np.sin(z + y)], -1
    )


def painted(sdf):
    """The volume with the pattern on all voxels."""
    z, y, x = np.indices(sdf.values.shape)
    points = sdf.origin + sdf.voxel_size * np.stack([x, y, z], -1)
    rgba = np.full((*sdf.values.shape, 4), 255, np.uint8)
    rgba[..., :3] = np.rint(pattern(points))
    return st.SDF(sdf.values, sdf.voxel_size, sdf.origin, rgba)


BALL = painted(st.SDF.sphere(RADIUS_M, voxels=VOXELS))


def pose(seed=0, size=0.0):
    """T_obj_cam of a ball 0.35 m in front, moved by a small increment."""
    base = np.eye(4)
    base[:3, 3] = [0.004, -0.003, -0.35]
    rng = np.random.default_rng(seed)
    return increment(size * rng.normal(size=6) * [1, 1, 1, 20, 20, 20]) @ base


def pixels(T_obj_cam, count=400, gain=1.0, offset=0.0, noise=0.0, light=(0, 0, 0)):
    """Pixels of the ball, with readings and brightness as they are seen at a pose."""
    rng = np.random.default_rng(3)
    u = rng.uniform(100, 220, 4 * count).astype(np.float32)
    v = rng.uniform(60, 180, 4 * count).astype(np.float32)
    rays = np.column_stack([(u - K[2]) / K[0], (v - K[3]) / K[1], np.ones(len(u))])
    along, t = rays @ T_obj_cam[:3, :3].T, T_obj_cam[:3, 3]
    a, b, c = (along**2).sum(1), along @ t, t @ t - RADIUS_M**2
    d2 = b * b - a * c
    keep = np.flatnonzero(d2 > 0.3 * d2.max())[:count]
    depth = ((-b - np.sqrt(np.maximum(d2, 0))) / a)[keep]
    p = t + depth[:, None] * along[keep]
    grey = pattern(p) @ [0.299, 0.587, 0.114] / 255
    normals = p @ T_obj_cam[:3, :3] / RADIUS_M  # camera frame
    grey = (gain + normals @ light) * grey + offset + noise * rng.normal(size=len(grey))
    return u[keep], v[keep], depth.astype(np.float32), grey.astype(np.float32)


def energy(T, seen, settled=None, sdf=BALL):
    shape = sdf.values, sdf.voxel_size, sdf.origin.tolist(), rgb_seen(sdf.colors)
    return _core.photometric(shape, list(K), T if settled is None else settled, T, *seen, SIGMA)


@pytest.mark.slow
def test_the_cost_is_that_of_the_twin():
    seen = pixels(pose(), gain=0.9, offset=0.05, noise=0.01)
    settled, T = pose(), pose(1, 3e-4)
    cost, _, _, tone, used = energy(T, seen, settled)
    model, normals = [], []
    field = BALL.values, BALL.voxel_size, BALL.origin
    for u, v, depth, _ in zip(*seen, strict=True):
        ray = np.array([(u - K[2]) / K[0], (v - K[3]) / K[1], 1])
        hit = ray_hit(*field, T, ray, float(depth))
        p = T[:3, :3] @ (hit * ray) + T[:3, 3]
        model.append(brightness_at(BALL.colors, BALL.voxel_size, BALL.origin, p))
        first = ray_hit(*field, settled, ray, float(depth))
        normals.append(surface_normal(*field, settled, first * ray))
    expected, best = photometric_cost(np.array(model), np.array(normals), seen[3].astype(float), SIGMA)
    assert used == len(model) == 400
    assert cost == pytest.approx(expected, rel=1e-3)
    np.testing.assert_allclose(tone, best, atol=2e-3)


@pytest.mark.parametrize("light", [(0, 0, 0), (0.15, -0.1, 0.1)], ids=["even", "from a side"])
def test_it_finds_all_three_turns_of_a_ball_whatever_the_exposure_and_the_light(light):
    truth = pose()
    seen = pixels(truth, gain=0.8, offset=0.1, noise=0.01, light=light)
    T = increment(np.r_[0, 0, 0, 0.02, -0.03, 0.025]) @ truth
    for _ in range(12):
        _, g, H, tone, _ = energy(T, seen)
        turn = np.linalg.solve(H[3:, 3:], -g[3:])  # the middle stays: depth holds it
        T = increment(np.r_[0, 0, 0, turn]) @ T
    left = T[:3, :3] @ truth[:3, :3].T
    assert np.degrees(np.arccos((np.trace(left) - 1) / 2)) < 0.2  # 0.05 voxel of 2.4 mm at the surface
    np.testing.assert_allclose(tone, [0.8, *light, 0.1], atol=0.04)


def test_unknown_colours_and_pixels_off_the_surface_say_nothing():
    rgba = BALL.colors.copy()
    rgba[..., 3] = 0
    blank = st.SDF(BALL.values, BALL.voxel_size, BALL.origin, rgba)
    seen = pixels(pose())
    cost, gradient, H, _, used = energy(pose(), seen, sdf=blank)
    assert (used, cost) == (0, 0)
    assert not gradient.any()
    assert not H.any()
    far = (*seen[:2], seen[2] - np.float32(0.02), seen[3])  # a hand in front
    assert energy(pose(), far)[-1] == 0


# -- coloured volumes
def test_a_volume_takes_the_colours_of_the_nearest_points_of_a_mesh():
    plain = st.SDF.sphere(RADIUS_M, voxels=40)
    mesh = plain.to_mesh()
    mesh = st.Mesh(mesh.vertices, mesh.faces, np.rint(pattern(mesh.vertices)).astype(np.uint8))
    sdf = plain.colored(mesh)
    assert plain.colors is None
    assert sdf.colors.shape == (*plain.values.shape, 4)
    z, y, x = np.nonzero(sdf.colors[..., 3])
    points = sdf.origin + sdf.voxel_size * np.column_stack([x, y, z])
    radius = np.linalg.norm(points, axis=1)
    assert np.abs(radius - RADIUS_M).max() < 3.1 * sdf.voxel_size
    assert len(points) > 0.95 * (np.abs(plain.values) < 2.9 * sdf.voxel_size).sum()
    expected = pattern(points * (RADIUS_M / radius)[:, None])
    # on flat faces the nearest point is up to a fifth of a voxel aside
    assert np.abs(sdf.colors[z, y, x, :3] - expected).max() < 10
    assert np.array_equal(plain.colored(mesh, threads=2).colors, sdf.colors)


def test_colours_are_saved_compared_and_kept_where_the_voxels_stay(tmp_path):
    import pickle

    BALL.save(tmp_path / "ball.npz")
    assert st.SDF.load(tmp_path / "ball.npz") == BALL == pickle.loads(pickle.dumps(BALL))
    assert st.SDF(BALL.values, BALL.voxel_size, BALL.origin) != BALL
    shift = np.eye(4)
    shift[:3, 3] = 0.01
    assert BALL.transformed(shift).colors is BALL.colors is BALL.redistanced().colors
    turn = np.diag([-1.0, -1, 1, 1])
    assert BALL.transformed(turn).colors is None
    assert "coloured" in repr(BALL)
    with pytest.raises(ValueError):
        BALL.colors[:] = 0


# -- a tracker
@pytest.fixture(scope="module")
def can():
    mesh = can_mesh(160, 90)
    sequence = st.synth.sequence(mesh, 30, turning_can(30), 0.001, clutter="wall", seed=1)
    return st.SDF.from_mesh(mesh, 80), mesh, sequence, [sequence[i] for i in range(30)]


def in_mm_and_degrees(row):
    return np.array(row.errors) * [1e3, 180 / np.pi]


def test_the_print_of_a_can_holds_its_turn_about_its_axis(can):
    plain, mesh, sequence, frames = can
    blind = follow(plain, sequence, frames)
    assert in_mm_and_degrees(blind)[-1, 1] > 30  # the can has turned by 58 degrees
    assert blind.turn_sd_deg[-1] > 90  # and the tracker says that it does not know
    for exposure in (False, True):
        seeing = follow(plain.colored(mesh), sequence, frames, exposure)
        assert in_mm_and_degrees(seeing).max() < 0.4  # measured 0.2 mm, 0.1 degrees
        assert seeing.turn_sd_deg[-1] < 3  # 1.7, for nothing is stated of the sensor
    off = follow(plain.colored(mesh), sequence, frames, photometric=False)
    assert in_mm_and_degrees(off)[-1, 1] > 30


def test_copies_of_one_shape_keep_colours_of_their_own(can):
    plain, mesh, sequence, frames = can
    other = st.Mesh(mesh.vertices, mesh.faces, mesh.colors[::-1].copy())
    truth = sequence.ground_truth[0][0]
    shapes = [plain, plain.colored(mesh), plain.colored(other), plain.colored(mesh)]
    alone = [st.Tracker(s, sequence.camera, mode="rgbd") for s in shapes]
    for tracker in alone:
        tracker.start(frames[0], poses=[truth])
    expected = [t.track(frames[1]).pose for t in alone]
    for k, shape in enumerate(shapes):
        before = shapes[:k] + shapes[k + 1 :]
        tracker = st.Tracker([shape, *before], sequence.camera, mode="rgbd", collision=None)
        for _ in before:
            tracker.remove(1)
        tracker.start(frames[0], poses=[truth])
        assert np.array_equal(tracker.track(frames[1]).pose, expected[k])
    assert np.array_equal(expected[1], expected[3])
    assert not np.array_equal(expected[1], expected[2])


def test_an_unknown_can_is_seen_to_turn_by_what_it_has_shown(can):
    _, _, sequence, _ = can
    errors = {}
    for photometric in (True, False):
        options = st.TrackerOptions(photometric=photometric)
        star, results = begun(30, sequence, voxels=96, tracker_options=options)
        to_truth = np.linalg.solve(results[0].pose, sequence.ground_truth[0][0])
        metres, radians = st.metrics.pose_error(results[-1].pose @ to_truth, sequence.ground_truth[29][0])
        errors[photometric] = np.degrees(radians)
        assert metres < 0.003
    assert errors[True] < 2
    assert errors[False] > 30
    assert star.shape.colors is not None
