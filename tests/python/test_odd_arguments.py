# SPDX-License-Identifier: MIT
"""Arguments and files that fuzzing found to end in the wrong exception, in a hang, or in a message without an end."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack import _core, metrics
from sdftrack.io import trajectories
from sdftrack.motion import contacts

CAMERA = st.Camera(30.0, 30.5, 15.5, 11.5, 32, 24)
POINTS = np.random.default_rng(0).normal(size=(30, 3))
TIMES = np.arange(5) / 10


def _poses(**changes):
    T = np.eye(4)
    for name, value in changes.items():
        T["xyz".index(name), 3] = value
    return T


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


def test_chamfer_of_points_that_are_not_finite_is_refused():
    with pytest.raises(ValueError, match="points: expected"):
        metrics.chamfer(np.full((3, 3), np.nan), POINTS)


@pytest.mark.parametrize(
    "call",
    [
        lambda: contacts(np.zeros((1, 5)), TIMES[::-1]),
        lambda: contacts(np.zeros((1, 5)), np.full(5, 0.5)),
        lambda: contacts(np.zeros((1, 5)), [0, np.nan, 1, 2, 3]),
        lambda: contacts(np.zeros((1, 5)), TIMES, min_s=np.inf),
        lambda: contacts(np.zeros((0, 5)), TIMES),
    ],
)
def test_contacts_of_times_that_do_not_increase_are_refused(call):
    with pytest.raises(ValueError, match=r"(times_s|min_s): expected"):
        call()


def test_a_contact_longer_than_the_recording_is_asked_for_in_no_time():
    whole = contacts(np.zeros((1, 5)), TIMES, min_s=1e300)
    assert whole.share == 1
    assert contacts(np.array([[1.0, 1, 0, 1, 1]]), TIMES, min_s=1e300).share in (0, 1)


@pytest.mark.parametrize("s", [1e300, np.inf, 1e9])
def test_a_scale_of_too_many_pixels_is_refused(s):
    with pytest.raises(ValueError, match="s: expected"):
        CAMERA.scaled(s)


@pytest.mark.parametrize("margin", [2**63, -1, 2.5, None])
def test_a_margin_that_is_no_number_of_voxels_is_refused(margin):
    with pytest.raises((ValueError, TypeError), match="margin_voxels: expected a whole number from 0"):
        st.SDF.sphere(0.03, voxels=12).cropped(margin)


def test_a_tiny_scale_of_depth_is_a_number():
    frame = st.Frame(np.full((4, 4), 60000, np.uint16), depth_scale=1e-310, check_units=False)
    assert np.isfinite(frame.depth).all()


def test_messages_about_large_arrays_are_one_short_line():
    large, frame = np.zeros(70_000), st.Frame(np.ones((24, 32), np.float32))
    for call in (
        lambda: st.geometry.pose(large),
        lambda: st.geometry.pose(large.tolist()),
        lambda: st.levelset.evidence(frame, CAMERA, np.eye(4), ((9, 9, 9), 0.01, large)),
        lambda: st.SDF(np.ones((2, 2, 2), np.float32), 0.1, large),
    ):
        with pytest.raises(ValueError, match="expected") as told:
            call()
        assert len(str(told.value)) < 300
        assert "\n" not in str(told.value)


def test_an_increment_of_another_shape_is_refused():
    box = st.SDF.box([0.12, 0.09, 0.06], voxels=14)
    T = _poses(z=0.4)
    energy = st.Energy(box, CAMERA, st.Frame(np.full((24, 32), 0.37, np.float32)), T)
    with pytest.raises(ValueError, match="delta: expected one number per unknown"):
        energy.moved(energy.start, np.zeros((2, 6)))
    with pytest.raises(TypeError, match="delta: expected an array of numbers"):
        energy.moved(energy.start, "x")


def test_an_outline_of_other_arrays_is_refused():
    image, mask = np.zeros((8, 9, 3), np.uint8), np.eye(8, 9, dtype=bool)
    for wrong in (image.astype(complex), image[..., 0], image[:0]):
        with pytest.raises(TypeError, match="image: expected"):
            st.contour.draw_outline(wrong, mask)
    with pytest.raises(TypeError, match="mask: expected bool"):
        st.contour.draw_outline(image, mask.T)
    for odd in (mask.astype(float), "x", mask[0]):
        with pytest.raises(TypeError, match="mask: expected"):
            st.contour.signed_distances(odd)


@pytest.mark.parametrize("q", ["nan 0 0 1", "0 0 0 0", "1e308 1e308 0 1"])
def test_a_pose_that_is_no_rotation_is_named_by_file_and_line(tmp_path, q):
    path = tmp_path / "a.txt"
    path.write_text(f"# remark\n0 0 0 0 0 0 0 1\n1 0 0 0 {q}\n")
    with pytest.raises(ValueError, match=r"a\.txt, line 3: "):
        trajectories.read_tum(path)


def test_a_mesh_with_a_wrong_index_is_named(tmp_path):
    path = tmp_path / "a.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n"
    )
    with pytest.raises(ValueError, match=r"a\.ply"):
        st.Mesh.load(path)


def test_many_points_at_one_place_are_a_model_too():
    """A tree of them was never finished."""
    same = np.broadcast_to(np.array([0.1, 0.2, 0.3]), (70_000, 3))
    assert metrics.adds(np.eye(4), _poses(x=0.5), same) == pytest.approx(0.5)


@pytest.mark.parametrize("tolerance", [np.inf, 2.5, -1, "2"])
def test_a_tolerance_that_is_no_number_of_pixels_is_refused(tolerance):
    labels = np.arange(16).reshape(4, 4)
    with pytest.raises((TypeError, ValueError), match="tolerance: expected a whole number"):
        metrics.boundary_recall(labels, labels, tolerance)


def test_a_tolerance_beyond_the_image_is_that_of_the_image():
    one, other = np.zeros((4, 6), int), np.zeros((4, 6), int)
    one[:, 0], other[:, 5] = 1, 1
    assert metrics.boundary_recall(one, other, 2**24) == metrics.boundary_recall(one, other, 6) == 1


@pytest.mark.parametrize("camera", [None, 3.0, [], b"x"])
def test_a_camera_that_is_none_is_refused(camera):
    depth = np.ones((24, 32))
    with pytest.raises(TypeError, match=r"camera: expected st\.Camera"):
        metrics.vsd(depth, depth, depth, camera, 0.02)
    with pytest.raises(TypeError, match=r"camera: expected st\.Camera"):
        metrics.mspd(np.eye(4), np.eye(4), POINTS, camera)


@pytest.mark.parametrize("rate_hz", [1e300, np.inf, 0.0, np.nan])
def test_a_rate_beyond_all_sensors_is_refused(rate_hz):
    with pytest.raises(ValueError, match="rate_hz: expected samples per second"):
        st.motion.log_dimensionless_jerk(POINTS[None], rate_hz)


@pytest.mark.parametrize("text", [None, 1j, b"box:0,0,0,1,1,1"])
def test_a_target_that_is_no_text_is_refused(text):
    with pytest.raises(TypeError, match="target: expected text"):
        st.motion.parse_target(text)


@pytest.mark.parametrize("voxels", [2**64, 10**400, -(2**63)])
def test_a_number_of_voxels_of_hundreds_of_digits_is_refused(voxels):
    with pytest.raises(ValueError, match="voxels: expected 16 to") as told:
        st.Reconstructor(CAMERA, voxels=voxels)
    assert len(str(told.value)) < 300


@pytest.mark.parametrize("index", [np.inf, 2.5, "x", 2**40])
def test_an_index_of_a_frame_is_a_whole_number(index):
    with pytest.raises((TypeError, ValueError), match="index: expected a whole number"):
        st.Frame(np.ones((4, 4), np.float32), index=index)


def test_lengths_of_another_shape_are_refused_in_one_line():
    for wrong in (np.full(70_000, 0.1), np.full((3, 1), 0.1)):
        with pytest.raises(ValueError, match="size: expected three numbers") as told:
            st.SDF.box(wrong)
        assert "\n" not in str(told.value)


def test_a_mesh_thinner_than_any_voxel_is_refused():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 1e-320]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    with pytest.raises(ValueError, match="voxels"):
        st.SDF.from_mesh((corners, faces), 16)


@pytest.mark.parametrize(
    "call",
    [
        lambda: _core.colors_at(DEPTH, COLOR, ALIGNED, [1, 1, 2**24, 9]),
        lambda: _core.colors_at(DEPTH, COLOR, ALIGNED, [-1, 1, 9, 9]),
        lambda: _lines(20, -1),
        lambda: _lines(0, 8),
        lambda: _smoothed(np.array([0, 1, -(2**31)], np.int32)),
        lambda: _smoothed(np.array([0, 1, 2**31 - 1], np.int32)),
        lambda: _smoothed(np.array([0, 1, 2], np.int32), width=0),
    ],
)
def test_the_core_refuses_places_outside_of_an_image(call):
    with pytest.raises(ValueError, match="expected"):
        call()


DEPTH, COLOR = np.ones((24, 32), np.float32), np.zeros((24, 32, 3), np.uint8)
ALIGNED = _core.ColorMap.aligned(32, 24)


def _lines(points, reach):
    ball, counts = st.SDF.sphere(0.05, voxels=14), np.ones(4096, np.float32)
    shape = (np.asarray(ball.values), ball.voxel_size, list(ball.origin))
    return _core.outline_lines(
        shape, CAMERA._core, DEPTH, COLOR, ALIGNED, (counts, counts), _poses(z=0.5), points, reach
    )


def _smoothed(at, width=32):
    ones = np.ones(len(at), np.float32)
    return _core.smooth_foreground(at, ones, 0.5 * ones, width, 30.0, 0.001)


@pytest.mark.parametrize(
    "call",
    [
        lambda: _core.color_counts(
            *_shape(), CAMERA._core, DEPTH, None, COLOR, ALIGNED, _poses(z=0.5), 0.02, 0
        ),
        lambda: _removed(2, 65536),
        lambda: _removed(32, 3),
        lambda: _removed(2, -1),
    ],
)
def test_the_core_refuses_a_start_outside_of_the_image_and_a_budget_of_none(call):
    with pytest.raises(ValueError, match="expected"):
        call()


def _shape():
    ball = st.SDF.sphere(0.05, voxels=14)
    return np.asarray(ball.values), ball.voxel_size, list(ball.origin)


def _removed(x, y):
    noise = [0.001, 0.0, 0.0]
    return _core.remove_plane(DEPTH, CAMERA._core, None, x, y, 0.01, "rigid", noise, False, False, 1)


def test_an_open_mesh_in_a_volume_of_more_than_32767_voxels_a_side():
    """Places in a block were counted in 16 bits."""
    mesh = st.SDF.sphere(0.05, voxels=14).to_mesh()
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)[:-8]
    narrow = _core.open_mesh_to_sdf(vertices, faces, [12, 13, 40], 0.01, [-0.05, -0.05, -0.05], 6.0, 1)[0]
    wide = _core.open_mesh_to_sdf(vertices, faces, [12, 13, 40_000], 0.01, [-0.05, -0.05, -0.05], 6.0, 1)[0]
    assert np.array_equal(wide[:, :, :10] < 0, narrow[:, :, :10] < 0)
    assert not (wide[:, :, 20:] < 0).any()


@pytest.mark.parametrize(
    "call",
    [
        lambda: CAMERA.cropped(2, 3, 10, 10**400),
        lambda: CAMERA.cropped(10**400, 3, 10, 10.5),
        lambda: st.SDF.sphere(0.1, voxels=np.inf),
        lambda: st.SDF.sphere(0.1, voxels=10**400),
        lambda: metrics.average_recall(mspd_errors=np.ones((2, 3)), width=10**400),
        lambda: st.motion.sparc(np.ones((1, 9)), 30.0, cutoff_hz=np.nan),
        lambda: st.motion.sparc(np.ones((1, 9)), 30.0, padding=10**6),
        lambda: st.motion.sparc(np.ones((1, 9)), 5e-324),
        lambda: st.motion.tremor_of(_still(), 0, 1, noise_m=1e300),
        lambda: st.Symmetry(np.zeros((0, 4, 4)), [(np.full(70_000, 0.1), np.zeros(3))]),
        lambda: st.Symmetry.from_bop({"symmetries_discrete": [[10**400] * 16]}),
    ],
)
def test_numbers_beyond_all_measures_are_refused_in_one_line(call):
    with pytest.raises(ValueError, match="expected") as told:
        call()
    assert "\n" not in str(told.value)
    assert len(str(told.value)) < 400


def _still():
    return st.motion.Trajectory(np.arange(60) / 30, np.tile(np.eye(4), (60, 1, 1)))


def test_an_outline_is_drawn_into_an_image_of_any_layout():
    image, mask = np.zeros((8, 9, 3), np.uint8), np.eye(8, 9, dtype=bool)
    plain = st.contour.draw_outline(image, mask)
    for odd in (np.asfortranarray(image), image[::-1], np.repeat(image, 2, axis=1)[:, ::2]):
        np.testing.assert_array_equal(st.contour.draw_outline(odd, np.asfortranarray(mask)), plain)


@pytest.mark.parametrize("steps", [2**31, 2**63, 10**400])
def test_a_number_of_steps_beyond_the_cores_integers_is_refused(steps):
    phi = np.asarray(st.SDF.sphere(0.05, voxels=14).values)
    with pytest.raises(ValueError, match="steps: expected a whole number"):
        st.levelset.evolve(phi, phi, steps, 0.01, threads=1)


@pytest.mark.parametrize("window_s", [1e308, np.inf])
def test_a_window_longer_than_the_recording_leaves_gaps_or_is_refused(window_s):
    with pytest.raises(ValueError, match="expected"):
        st.motion.savitzky_golay(_still(), window_s)


def test_a_window_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="window_s: expected"):
        st.motion.savitzky_golay(_still(), np.nan)
