# SPDX-License-Identifier: MIT
"""What one frame says of an object's size and form: the core against its twins, and against the truth."""

import numpy as np
import pytest
from scipy.optimize import brentq
from test_outline_term import ALIGNED, lines_of, picture
from tracking_scene import CAMERA, POSE, SIZE_M, box_mesh

import sdftrack as st
from reference import energies, size, tracking
from sdftrack import _core, geometry

SMALL = st.Camera(fx=140, fy=140, cx=79.5, cy=59.5, width=160, height=120)
T_CAM_OBJ = geometry.pose([0.5, -0.4, 0.2], [0.01, -0.02, 0.4])
NOISE_M, SYSTEMATIC_M, PRIOR = 0.0005, 0.0002, 0.7
# Centres and semi-axes (m) of ellipsoids that together have no symmetry.
PARTS_M = [[(0, 0, 0), (0.05, 0.03, 0.025)], [(0.03, -0.02, -0.02), (0.02, 0.02, 0.02)],
           [(-0.035, -0.02, -0.01), (0.015, 0.025, 0.02)], [(-0.005, 0.01, -0.02), (0.012, 0.012, 0.02)]]  # fmt: skip


def knobbly(stretch, voxel=0.001):
    """The parts, stretched along x, y and z; the origin is not the middle of its box."""
    n = np.ceil(stretch * np.array([0.11, 0.11, 0.09]) / voxel).astype(int)
    origin = stretch * [0, -0.005, -0.005] - voxel * (n - 1) / 2
    parts = [
        _core.primitive_sdf("ellipsoid", stretch * r, n[::-1], voxel, origin - stretch * c)
        for c, r in PARTS_M
    ]
    return st.SDF(np.minimum.reduce(parts), voxel, origin)


def looked(model, seen, prior=PRIOR, at=T_CAM_OBJ):
    """Size and form of `seen` over `model`, which is a little beside it, by the core and by the twins."""
    T = at.copy()
    T[:3, 3] += [0.0003, -0.0002, 0.0005]
    shape = tracking.make_shape(model.values, model.voxel_size, model.origin)
    volume = (model.values, model.voxel_size, model.origin - shape.centre)
    T_obj_cam = tracking.centred(T, shape.centre)
    field = energies.SingleObject(*volume, T_obj_cam)
    K = [SMALL.fx, SMALL.fy, SMALL.cx, SMALL.cy]
    depth, rng, pixels = seen.render(SMALL, at)[0], np.random.default_rng(0), []
    for v, u in np.argwhere(depth > 0):
        ray = np.array([(u - K[2]) / K[0], (v - K[3]) / K[1], 1])
        z = depth[v, u] + rng.normal(0, NOISE_M) + 0.01 * (rng.uniform() < 0.03)  # few show something else
        hit = energies.find_hit(field, ray, z)
        pixels.append([u, v, z, rng.uniform(0.3, 1), hit.z, abs(hit.phi) > 1e-4])
    pixels = np.array(pixels, np.float32)
    given = (model.values, model.voxel_size, model.origin)
    core = _core.look_at_form(given, SMALL._core, pixels, prior, T, NOISE_M, SYSTEMATIC_M)
    middle = _core.surface_samples(*given, 960)[0].mean(axis=0, dtype=float) - shape.centre
    told = (size.View(*volume, shape.diameter, middle, pixels, K, prior), T_obj_cam, NOISE_M, SYSTEMATIC_M)
    return core, (size.size_by_depth(*told), size.strain_by_depth(*told))


def assert_the_same(core, twin, rtol=3e-5):
    """Each number to that share of the largest of its array; an axis has no sign."""
    for a, b in zip(core, twin, strict=True):
        a, b = (np.abs(x) if np.shape(x) == (3,) else np.asarray(x) for x in (a, b))
        np.testing.assert_allclose(a, b, rtol=0, atol=rtol * np.abs(b).max())


@pytest.fixture(scope="module")
def model():
    return knobbly(np.ones(3))


# In single precision a hit that is searched anew is off by some 1e-8 m.
@pytest.mark.parametrize(("larger", "rtol"), [(1.0, 3e-5), (1.05, 5e-4)])
def test_the_size_by_depth_is_the_twins_and_the_true_one(model, larger, rtol):
    core, twin = looked(model, knobbly(larger * np.ones(3), 0.0007))
    assert_the_same(core[0], twin[0], rtol)
    assert_the_same(core[1], twin[1])
    log_scale, own_var, shared_var, _, unexplained = core[0]
    assert abs(log_scale - np.log(larger)) < min(0.006, 3 * np.sqrt(own_var + shared_var))
    assert larger == 1 or unexplained < 0.2


def test_the_strain_by_depth_is_the_twins_and_the_true_one(model):
    core, twin = looked(model, knobbly(np.array([1.2, 1, 1]), 0.0007), prior=0)
    assert (core[0], twin[0]) == (None, None)  # no size explains it
    assert_the_same(core[1], twin[1])
    _, _, _, axis, log_stretch, sd = core[1]
    assert abs(axis[0]) > 0.98
    assert abs(log_stretch - np.log(1.2)) < min(0.03, 2 * sd)


def test_a_strain_moves_the_hits_as_its_rows_say():
    ball = st.SDF.sphere(0.04, voxels=60)
    view, T_obj_cam, step = (ball.values, ball.voxel_size, ball.origin), np.linalg.inv(T_CAM_OBJ), 1e-3
    field, K = energies.SingleObject(*view, T_obj_cam), [SMALL.fx, SMALL.fy, SMALL.cx, SMALL.cy]
    (v, u), middle = np.argwhere(ball.render(SMALL, T_CAM_OBJ)[0] > 0)[150], np.array([0.002, 0.001, 0])
    ray = np.array([(u - K[2]) / K[0], (v - K[3]) / K[1], 1])
    z = energies.find_hit(field, ray, ball.render(SMALL, T_CAM_OBJ)[0][v, u]).z
    pixel = np.array([[u, v, z, 1, z, 0]])
    rows = size.read(size.View(*view, 0.08, middle, pixel, K, 0), T_obj_cam).rows[0, size.NO_STRAIN :]

    def hit(strain):  # of a ball that is stretched about `middle`
        def phi(depth):
            q = T_obj_cam[:3, :3] @ (depth * ray) + T_obj_cam[:3, 3] - middle
            return float(ball(np.array([np.linalg.solve(np.eye(3) + strain, q) + middle]))[0])

        return brentq(phi, z - 0.003, z + 0.003)

    numeric = [(hit(step * E) - hit(-step * E)) / (2 * step) for E in size.STRAINS]
    np.testing.assert_allclose(rows, numeric, atol=0.02 * np.abs(rows).max())


def test_one_face_of_a_box_tells_neither_size_nor_form():
    box = st.SDF.box([0.07, 0.05, 0.04], voxels=60)
    assert looked(box, box, at=geometry.pose([0, 0, 0], [0, 0, 0.4])) == ((None, None), (None, None))


@pytest.mark.parametrize("larger", [(1, 1, 1), (1.05, 1.05, 1.05), (1.08, 1, 1), (1, 0.93, 1)])
def test_what_the_outline_says_is_the_twins_and_the_truth(larger):
    lines = lines_of(POSE, picture(POSE, box_mesh(np.multiply(larger, SIZE_M))))
    T = np.ascontiguousarray(np.linalg.inv(POSE))
    told = (1.3, np.array([0.002, -0.001, 0.003, 0.01, 0.02, -0.01]), 4.0, np.array([0.003, -0.002, 0.001]))
    core = _core.outline_size(lines, CAMERA._core, ALIGNED, T, *told)
    assert_the_same(core, size.look_by_outline(lines, CAMERA.K, T, *told))

    look = _core.outline_size(lines, CAMERA._core, ALIGNED, T, 1.0, np.zeros(6), 1.0)
    log_scale, _, var, _, information, pull = look
    stretches = np.log(larger)
    strain = size.STRAINS.diagonal(axis1=1, axis2=2) @ stretches
    if not strain.any():
        assert abs(log_scale - stretches[0]) < min(0.015, 2 * np.sqrt(var))
        strain = size.STRAINS[0].diagonal() * 0.1 @ size.STRAINS.diagonal(axis1=1, axis2=2).T
        assert abs(strain @ pull / (strain @ information @ strain)) < 0.3  # nothing is seen of it
    else:
        assert 0.6 < strain @ pull / (strain @ information @ strain) < 1.4

    few = lines[:29]
    assert _core.outline_size(few, CAMERA._core, ALIGNED, T, *told) is None
    assert size.look_by_outline(few, CAMERA.K, T, *told) is None


@pytest.mark.parametrize(
    ("solid", "is_round"),
    [(st.SDF.box(SIZE_M, voxels=60), False), (st.SDF.cylinder(0.04, 0.1, voxels=60), True)],
)
def test_the_form_that_is_seen_is_the_twins_and_a_round_one_turns(solid, is_round):
    depth = solid.render(CAMERA, POSE)[0]
    depth += (0.01 * (np.random.default_rng(0).uniform(size=depth.shape) < 0.2)).astype(np.float32)
    depth[:, 165:] = 0  # the right part is hidden
    volume = (solid.values, solid.voxel_size, solid.origin)
    form, least, rows = _core.seen_form(volume, CAMERA._core, depth, POSE, 600, 0.004)
    points, normals = rows[:, :3].astype(float), rows[:, 3:].astype(float)
    corners = np.abs([solid.origin, solid.origin + solid.voxel_size * np.array(solid.values.shape[::-1])])
    diameter = 2 * np.linalg.norm(corners.max(axis=0))
    K = [CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy]
    twin = tracking.seen_form(points, normals, diameter, depth, K, POSE, 0.004)
    np.testing.assert_allclose(form, twin, rtol=0, atol=1e-5 * twin.max())
    assert least == pytest.approx(tracking.least_form_slope(points, solid.voxel_size), rel=1e-6)
    unit = np.diag([1, 1, 1, *[2 / diameter] * 3])
    slope = np.sqrt(np.abs(np.linalg.eigvalsh(unit @ form @ unit)[0]))
    assert (slope < least) == is_round
