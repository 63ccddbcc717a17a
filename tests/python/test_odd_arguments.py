# SPDX-License-Identifier: MIT
"""Arguments and files that fuzzing found to end in the wrong exception, in a hang, or in a message without an end."""

import functools

import numpy as np
import pytest
from refusals import assert_refused, refused

import sdftrack as st
from sdftrack import _core, metrics
from sdftrack.io import report_file as trajectories

CAMERA = st.Camera(30.0, 30.5, 15.5, 11.5, 32, 24)
POINTS = np.random.default_rng(0).normal(size=(30, 3))
LARGE, FRAME = np.zeros(70_000), st.Frame(np.ones((24, 32), np.float32))
DEPTH, COLOR = np.ones((24, 32), np.float32), np.zeros((24, 32, 3), np.uint8)
IMAGE, MASK = np.zeros((8, 9, 3), np.uint8), np.eye(8, 9, dtype=bool)
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 1e-320]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
NO_CAMERA = r"camera: expected st\.Camera"


def _poses(**changes):
    T = np.eye(4)
    for name, value in changes.items():
        T["xyz".index(name), 3] = value
    return T


def _ball(voxels=14):
    return st.SDF.sphere(0.05, voxels=voxels)


def _removed(x, y):
    noise = [0.001, 0.0, 0.0]
    return _core.remove_plane(DEPTH, CAMERA._core, None, x, y, 0.01, "rigid", noise, False, False, 1)


def _moved(delta):
    frame = st.Frame(np.full((24, 32), 0.37, np.float32))
    energy = st.Energy(st.SDF.box([0.12, 0.09, 0.06], voxels=14), CAMERA, frame, _poses(z=0.4))
    return energy.moved(energy.start, delta)


def _evolved(steps):
    phi = np.asarray(_ball().values)
    return st.levelset.evolve(phi, phi, steps, 0.01, threads=1)


def _still():
    return st.motion.Trajectory(np.arange(60) / 30, np.tile(np.eye(4), (60, 1, 1)))


def each(call, values, error, words):
    """Rows of a call with each of the values."""
    return [(functools.partial(call, value), error, words) for value in values]


@refused(
    (lambda: metrics.chamfer(np.full((3, 3), np.nan), POINTS), ValueError, "points: expected"),
    *each(lambda c: metrics.mspd(np.eye(4), np.eye(4), POINTS, c), (None, 3.0, [], b"x"), TypeError, NO_CAMERA),
    (lambda: st.motion.sparc(np.ones((1, 9)), 5e-324), ValueError, "expected"),
    (lambda: st.motion.tremor_of(_still(), 0, 1, noise_m=1e300), ValueError, "expected"),
    *each(lambda w: st.motion.savitzky_golay(_still(), w), (1e308, np.inf), ValueError, "expected"),
    *each(lambda s: CAMERA.scaled(s), (1e300, np.inf, 1e9), ValueError, "s: expected"),
    (lambda: _ball(np.inf), ValueError, "expected"),
    (lambda: st.SDF.box(np.full(70_000, 0.1)), ValueError, "size: expected three numbers"),
    (lambda: st.SDF(np.ones((2, 2, 2), np.float32), 0.1, LARGE), ValueError, "expected"),
    (lambda: st.SDF.from_mesh((CORNERS, FACES), 16), ValueError, "voxels"),  # thinner than any voxel
    (lambda: st.geometry.pose(LARGE), ValueError, "expected"),
    (lambda: st.Symmetry(np.zeros((0, 4, 4)), [(np.full(70_000, 0.1), np.zeros(3))]), ValueError, "expected"),
    (lambda: st.Symmetry.from_bop({"symmetries_discrete": [[10**400] * 16]}), ValueError, "expected"),
    (lambda: st.levelset.evidence(FRAME, CAMERA, np.eye(4), ((9, 9, 9), 0.01, LARGE)), ValueError, "expected"),
    *each(lambda n: st.synth.sequence(_ball(), n),
          (1e30, np.inf, np.nan, 10**400, 0), ValueError, "n: expected a number of frames from 1 to"),
    *each(lambda n: _evolved(n), (2**31, 2**63, 10**400), ValueError, "steps: expected a whole number"),
    (lambda: _moved(np.zeros((2, 6))), ValueError, "delta: expected one number per unknown"),
    (lambda: st.contour.draw_outline(IMAGE[:0], MASK), TypeError, "image: expected"),
    (lambda: st.contour.draw_outline(IMAGE, MASK.T), TypeError, "mask: expected bool"),
    (lambda: _removed(2, 65536), ValueError, "expected"),
    (lambda: _removed(2, -1), ValueError, "expected"),
)  # fmt: skip
def test_it_is_refused_in_one_short_line(call, error, words):
    assert len(assert_refused(call, error, words)) < 400


@pytest.mark.parametrize("x", [np.nan, np.inf])
def test_adds_of_a_pose_that_is_not_finite_is_not_finite(x):
    assert not np.isfinite(metrics.adds(_poses(x=x), np.eye(4), POINTS))
    stack = np.stack([np.eye(4), _poses(x=x)])
    errors = metrics.adds(stack, np.eye(4), POINTS)
    assert errors[0] == pytest.approx(0, abs=1e-7)
    assert not np.isfinite(errors[1])


@pytest.mark.parametrize("x", [1e16, 1e30, 1e200])
def test_adds_of_a_pose_beyond_float32_is_its_distance(x):
    assert metrics.adds(_poses(x=x), np.eye(4), POINTS) == pytest.approx(x)


def test_a_tiny_scale_of_depth_is_a_number():
    frame = st.Frame(np.full((4, 4), 60000, np.uint16), depth_scale=1e-310, check_units=False)
    assert np.isfinite(frame.depth).all()


@pytest.mark.parametrize("q", ["nan 0 0 1", "0 0 0 0", "1e308 1e308 0 1"])
def test_a_pose_that_is_no_rotation_is_named_by_file_and_line(tmp_path, q):
    path = tmp_path / "a.txt"
    path.write_text(f"# remark\n0 0 0 0 0 0 0 1\n1 0 0 0 {q}\n")
    with pytest.raises(ValueError, match=r"a\.txt, line 3: "):
        trajectories.read_tum(path)


def test_many_points_at_one_place_are_a_model_too():
    """A tree of them was never finished."""
    same = np.broadcast_to(np.array([0.1, 0.2, 0.3]), (70_000, 3))
    assert metrics.adds(np.eye(4), _poses(x=0.5), same) == pytest.approx(0.5)


def test_a_tolerance_beyond_the_image_is_that_of_the_image():
    one, other = np.zeros((4, 6), int), np.zeros((4, 6), int)
    one[:, 0], other[:, 5] = 1, 1
    assert metrics.boundary_recall(one, other, 2**24) == metrics.boundary_recall(one, other, 6) == 1


def test_an_outline_is_drawn_into_an_image_of_any_layout():
    plain = st.contour.draw_outline(IMAGE, MASK)
    for odd in (np.asfortranarray(IMAGE), IMAGE[::-1], np.repeat(IMAGE, 2, axis=1)[:, ::2]):
        np.testing.assert_array_equal(st.contour.draw_outline(odd, np.asfortranarray(MASK)), plain)
