# SPDX-License-Identifier: MIT
"""Brightness of coloured surfaces: coloured volumes, and turns that the shape does not show."""

import numpy as np
import pytest
from reconstruction_scene import begun

import sdftrack as st
from experiments.tracking.photometric import follow
from sdftrack.synth.objects import can_mesh, turning_can

RADIUS_M, VOXELS = 0.04, 48


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
