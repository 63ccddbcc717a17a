# SPDX-License-Identifier: MIT
"""Numbers that no sensor gives: the smallest and the largest floats.

Each comes to a result or to an error that names the argument; none ends the process or takes for ever.
"""

import numpy as np
import pytest
from tracking_scene import CAMERA, POSE, SIZE_M, depth_of

import sdftrack as st
from sdftrack import _core
from sdftrack._internal import saved_file
from sdftrack.contour import lwpr_data

BOX = st.SDF.box(SIZE_M, voxels=48)
TINY = 1e-310  # has no inverse


def cube(low_x, n=16):
    """A cube of 0.1 m of many triangles, with a face at x = 0 but for its middle, at x = low_x."""
    u, v = np.meshgrid(*2 * [np.linspace(0, 0.1, n + 1)], indexing="ij")
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    outwards = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    vertices, faces = [], []
    for axis in range(3):
        for w in (0.0, 0.1):
            side = np.roll(np.stack([np.full_like(u, w), u, v], axis=-1), axis, axis=-1)
            faces.append((outwards if w else outwards[:, ::-1]) + len(faces) * at.size)
            vertices.append(side.reshape(-1, 3))
    points = np.concatenate(vertices)
    points[np.abs(points - [0, 0.05, 0.05]).max(axis=1) < 1e-9, 0] = low_x
    return points, np.concatenate(faces).astype(np.int32)


# Meshes and volumes
def test_a_mesh_with_a_coordinate_of_next_to_nothing_is_seen_and_has_a_volume_as_one_with_0():
    T = st.geometry.pose([0, 1.2, 0], [0, 0, 0.5])
    one, other = (st.Mesh(*cube(x)).raycast(CAMERA, T)[0] for x in (TINY, 0.0))
    volumes = [st.SDF.from_mesh(cube(x), voxels=24).values for x in (TINY, 0.0)]
    assert np.count_nonzero(one) > 1000
    np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(*volumes)


@pytest.mark.parametrize("voxel_m", [1e-12, 1e-6, 1.0, 1e6, 1e12])
def test_a_distance_field_scales_with_its_voxels(voxel_m):
    ball = st.SDF.sphere(0.05, voxels=24)
    values = (ball.values * (voxel_m / ball.voxel_size)).astype(np.float32)
    found = st.levelset.redistance(values, voxel_m) / voxel_m
    expected = st.levelset.redistance((ball.values / ball.voxel_size).astype(np.float32), 1.0)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("depth_m", [1e12, 1.8e13, 1e14, 1e16, 1e100, 1e300])
def test_a_volume_at_any_distance_is_rendered(depth_m):
    on_a_pixel = st.Camera(260, 260, 160, 120, 320, 240)
    seen = BOX.render(on_a_pixel, st.geometry.pose(t_m=[0, 0, depth_m]))[0]
    assert np.count_nonzero(seen) <= 1
    assert seen.max() == 0 or seen.max() == pytest.approx(depth_m, rel=1e-6)


# Readings and poses
@pytest.mark.parametrize("tiny_m", [3e-7, 9e-9, 1e-12, 1e-30, 1e-44])
@pytest.mark.parametrize("focal_px", [110, 260, 1668])
def test_a_first_reading_of_next_to_nothing_does_not_hide_the_object(focal_px, tiny_m):
    camera = st.Camera(focal_px, focal_px, 159.5, 119.5, 320, 240)
    T = np.array(POSE)
    T[2, 3] *= focal_px / CAMERA.fx
    depth = depth_of(T, camera=camera, wall_m=0.0)
    depth[0, 0] = tiny_m
    found = st.Tracker(BOX, camera).start(st.Frame(depth))
    assert found.status[0] in ("ok", "weak")  # half turns of a box look alike
    assert np.linalg.norm(found.poses[0][:3, 3] - T[:3, 3]) < 0.01
    tracker = st.Tracker(BOX, camera)
    tracker.start(st.Frame(depth), poses=[T])
    alone = np.zeros_like(depth)
    alone[0, 0] = tiny_m
    for _ in range(3):
        assert tracker.track(st.Frame(alone)).status[0] == "lost"


@pytest.mark.parametrize("far", [1e100, 1e155, 1e200, -1e160, 1e300, 1e308])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_finite_pose_out_of_all_sight_is_lost(axis, far):
    frame = st.Frame(depth_of())
    T = st.geometry.pose(t_m=[0.1, 0.1, 0.5])
    T[axis, 3] = far
    begun = st.Tracker(BOX, CAMERA, recover=False)
    assert begun.start(frame, poses=[T]).status[0] == "lost"
    moved = st.Tracker(BOX, CAMERA, recover=False)
    moved.start(frame, poses=[POSE])
    moved.set_pose(0, T)
    assert moved.track(frame).status[0] == "lost"
    assert moved.track(frame).status[0] == "lost"


def odd_volumes(seed, count):
    """Volumes that are no distance fields: huge values among the others, slopes and sizes of any order."""
    random = np.random.default_rng(seed)
    box = st.SDF.box(SIZE_M, voxels=24)
    for n in range(count):
        values, scale = box.values.copy(), 10.0 ** random.uniform(-9, 9)
        if n % 4 == 0:
            some = random.random(values.shape) < 0.02
            sizes = random.normal(size=some.sum()) * 10.0 ** random.uniform(-5, 38)
            values[some] = np.clip(sizes, -3e38, 3e38)
        elif n % 4 == 1:
            values *= np.float32(10.0 ** random.uniform(-30, 35))
        elif n % 4 == 2:
            values = np.copysign(np.float32(10.0 ** random.uniform(-40, 38)), values)
        size = scale if n % 4 == 3 else 1.0
        yield st.SDF(values.astype(np.float32), size * box.voxel_size, size * box.origin)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_ok_and_weak_say_finite_numbers_whatever_the_volume(seed):
    random = np.random.default_rng(seed)
    for n, shape in enumerate(odd_volumes(seed, 24)):
        depth = depth_of()
        if n % 3 == 0:
            some = random.random(depth.shape) < 0.1
            depth[some] = 10.0 ** random.uniform(-40, 38)
        tracker = st.Tracker(shape, CAMERA)
        places = [{"poses": [POSE]}, {"masks": depth < 1}, {}][n % 3]
        try:
            results = [tracker.start(st.Frame(depth), **places)]
        except ValueError as error:
            if "expected the object" not in str(error):  # a mask of something of another size
                raise
            continue
        results += [tracker.track(st.Frame(depth)) for _ in range(2)]
        for result in results:
            if result.status[0] in ("ok", "weak"):
                assert np.isfinite(result.poses).all()
                assert np.isfinite(result.covariances).all()
                assert np.isfinite(result.confidence).all()


def lwpr_file_with(path, options, n_in, field):
    """A model file, both checksums right, that holds one output with one field of these numbers."""
    core = _core.LwprModel(n_in, 1, options, [1.0] * n_in, [1.0]).to_bytes()
    words = np.frombuffer(core[:-8], np.uint64)
    numbers = words[3:].view(np.float64)[:-3]  # up to the one output, which has no field
    numbers = np.concatenate([numbers, [1.0, 1.0, 0.0], field])
    words = np.concatenate([words[:2], np.array([len(numbers)], np.uint64), numbers.view(np.uint64)])
    total, most = 0xCBF29CE484222325, (1 << 64) - 1
    for word in words.tolist():
        total = (total ^ word) * 0x100000001B3 & most
        total ^= total >> 32
    model = st.LWPR(n_in, 1, diagonal=options.diagonal)
    state = {**model.__getstate__(), "core": words.tobytes() + total.to_bytes(8, "little")}
    saved_file.write(path, lwpr_data.KIND, lwpr_data.content_of(state))


@pytest.mark.parametrize(
    ("n_in", "projections", "trusted"),
    [(100_000, 6000, 6000), (100_000, 5369, 0), (50, 40, 51), (50, 1.5, 1), (50, np.nan, 0), (50, 2, 1.5)],
)
def test_a_model_file_that_promises_more_than_it_holds_is_refused(tmp_path, n_in, projections, trusted):
    options = _core.LwprOptions(diagonal=True)
    head = np.zeros(12)
    head[4:6] = projections, trusted
    lwpr_file_with(tmp_path / "m.lwpr", options, n_in, np.concatenate([np.ones(2 * n_in), head]))
    with pytest.raises(ValueError, match="inconsistent fields"):
        st.LWPR.load(tmp_path / "m.lwpr")


def test_a_field_that_the_model_does_not_have_is_refused():
    core = _core.LwprModel(2, 1, _core.LwprOptions(), [1.0, 1.0], [1.0])
    for output in (7, -1, 2**31 - 1):
        with pytest.raises(ValueError, match=r"output: expected 0\.\.0"):
            core.fields(output)
