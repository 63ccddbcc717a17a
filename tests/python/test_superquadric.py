# SPDX-License-Identifier: MIT
"""Superquadrics: distances against the twin and differences, fits of one view and of points, what is made of them."""

import numpy as np
import pytest

import sdftrack as st
from experiments.primitives.superquadrics import CAMERA, WITHIN, errors
from experiments.synth.solids import ray_depth, rendered_scene, standing_scene
from reference import primitives as twin
from sdftrack import _core
from sdftrack.primitives.result import SIZES, SOLIDS
from sdftrack.synth.noise import Gaussian
from sdftrack.viz.primitives import wires

KIND = _core.PrimitiveKind.__members__["superquadric"]
PRINTED = _core.Scaling.__members__["printed"]
SIZE = {"rx": 0.08, "ry": 0.05, "rz": 0.06, "e1": 0.6, "e2": 1.3}
SHAPES = [
    SIZE,
    {"rx": 0.05, "ry": 0.08, "rz": 0.035, "e1": 0.12, "e2": 0.15},
    {"rx": 0.04, "ry": 0.04, "rz": 0.06, "e1": 0.12, "e2": 1.0},
    {"rx": 0.10, "ry": 0.06, "rz": 0.010, "e1": 0.3, "e2": 1.7},
]
STEP = 1e-6


def near_surface(size, count, band_m, seed=0):
    """Points (count, 3) up to `band_m` off the surface, along its normals, by the twin's norm and its differences."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3)) * [size["rx"], size["ry"], size["rz"]]
    on = way / twin.superquadric_norm(size, way)[:, None]
    n = np.stack(
        [
            twin.superquadric_norm(size, on + d) - twin.superquadric_norm(size, on - d)
            for d in STEP * np.eye(3)
        ],
        1,
    )
    return on + rng.uniform(-band_m, band_m, (count, 1)) * n / np.linalg.norm(n, axis=1, keepdims=True)


def phi(size, points, scaling=_core.Scaling.__members__["exact"]):
    return _core.primitive_distances(KIND, list(size.values()), points, scaling)


# ---- distances ----
@pytest.mark.parametrize("size", SHAPES)
def test_the_distance_is_the_twins_next_to_the_surface_and_never_more(size):
    points = near_surface(size, 150, 0.002)
    found, true = phi(size, points)[0], twin.distance("superquadric", size, points)
    assert (found <= true + 1e-9).all()
    off = np.sort(true - found)
    assert off[int(0.9 * len(off))] < 1e-6
    assert off[-1] < 1e-4  # at edges whose radius is less than the way to them


def test_with_exponents_of_one_it_is_an_ellipsoid():
    size = {**SIZE, "e1": 1.0, "e2": 1.0}
    points = near_surface(size, 200, 0.002)
    ellipsoid = _core.primitive_distances(
        _core.PrimitiveKind.__members__["ellipsoid"], [0.08, 0.05, 0.06], points
    )
    found = phi(size, points)
    np.testing.assert_allclose(found[0], ellipsoid[0], atol=1e-8)
    np.testing.assert_allclose(found[1], ellipsoid[1], atol=1e-4)
    np.testing.assert_allclose(found[2][:, :3], ellipsoid[2], atol=1e-4)


@pytest.mark.parametrize("e", [0.1, 1.0, 2.0])
def test_it_is_sound_where_coordinates_are_zero(e):
    size = {"rx": 0.08, "ry": 0.05, "rz": 0.06, "e1": e, "e2": e}
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0, -0.06, 0], [0, 0, 0.05]])
    found, grad, by_size = phi(size, points)
    np.testing.assert_allclose(found[1:], [0.02, 0.01, -0.01 if e < 2 else found[3]], atol=1e-7)
    assert -0.05 <= found[0] < 0
    assert np.isfinite(by_size).all()
    np.testing.assert_allclose(np.linalg.norm(grad, axis=1), 1, atol=1e-9)


@pytest.mark.parametrize("size", SHAPES[:3])
@pytest.mark.parametrize("scaling", ["exact", "printed"])
def test_derivatives_are_the_slopes_of_the_distance(size, scaling):
    """On the surface the exact form's are right to rounding, off it to the share of the way to their centre."""
    scaling = _core.Scaling.__members__[scaling]
    for band_m, worst in ((1e-9, 1e-5), (2e-4, 2e-3)):
        points = near_surface(size, 200, band_m, seed=1)
        _, grad, by_size = phi(size, points, scaling)
        slopes = [
            (phi(size, points + d, scaling)[0] - phi(size, points - d, scaling)[0]) / (2 * STEP)
            for d in STEP * np.eye(3)
        ]
        for name in size:
            more, less = {**size, name: size[name] + STEP}, {**size, name: size[name] - STEP}
            slopes.append((phi(more, points, scaling)[0] - phi(less, points, scaling)[0]) / (2 * STEP))
        off = np.abs(np.column_stack([grad, by_size]) - np.stack(slopes, 1)).max(axis=1)
        assert np.quantile(off, 0.95) < worst, band_m


@pytest.mark.parametrize("size", SHAPES)
def test_the_reach_is_that_of_the_farthest_of_many_points_and_so_is_its_derivative(size):
    rng = np.random.default_rng(2)
    way = rng.normal(size=(20000, 3)) * [size["rx"], size["ry"], size["rz"]]
    surface = way / twin.superquadric_norm(size, way)[:, None]
    lengths = list(size.values())
    for v in rng.normal(size=(6, 3)):
        v /= np.linalg.norm(v)
        reach, at, by_size = _core.primitive_reach(KIND, lengths, v.tolist())
        most = (surface @ v).max()
        assert most - 1e-12 <= reach < 1.02 * most
        assert np.dot(at, v) == pytest.approx(reach, abs=1e-12)
        assert twin.superquadric_norm(size, np.array([at])) == pytest.approx(1, abs=1e-9)
        for i in range(5):
            changed = [[*lengths[:i], lengths[i] + d, *lengths[i + 1 :]] for d in (STEP, -STEP)]
            more, less = (_core.primitive_reach(KIND, sizes, v.tolist())[0] for sizes in changed)
            assert by_size[i] == pytest.approx((more - less) / (2 * STEP), abs=1e-6)


# ---- fits ----
def test_one_view_gives_axes_exponents_and_pose_within_their_intervals():
    rng = np.random.default_rng(3)
    scene = standing_scene("superquadric", SIZE, CAMERA, rng, (0.7, 0.8))
    frame = st.Frame(Gaussian(0.001)(scene.depth, scene.cosine, rng))
    fit = st.fit_primitive(frame, "superquadric", camera=CAMERA, mask=scene.mask)
    assert fit.ok, fit.reason
    off, sd = errors(fit, scene)
    assert (np.abs(off) < 2 * WITHIN * sd).all(), off / sd
    assert (sd[6:9] < 0.001).all()
    assert (sd[9:] < 0.03).all()
    assert fit.size["rx"] >= fit.size["ry"]
    again = st.fit_primitive(frame, "superquadric", camera=CAMERA, mask=scene.mask, initial=fit)
    np.testing.assert_allclose(list(again.size.values()), list(fit.size.values()), rtol=0.01)


@pytest.mark.parametrize("scaling", ["exact", "printed"])
def test_points_all_around_give_it_too(scaling):
    points = near_surface(SIZE, 4000, 0.0) + np.random.default_rng(4).normal(0, 5e-4, (4000, 3))
    T = st.geometry.pose([0.4, -0.7, 0.3], [0.03, -0.02, 0.8])
    fit = st.fit_primitive(st.geometry.transform_points(T, points), "superquadric", scaling=scaling)
    np.testing.assert_allclose(list(fit.size.values()), list(SIZE.values()), rtol=0.01)
    assert all(fit.bounded.values())


def test_an_axis_along_the_view_has_no_variance_to_trust():
    T = np.eye(4)
    T[2, 3] = 0.9
    size = {"rx": 0.08, "ry": 0.06, "rz": 0.05, "e1": 0.1, "e2": 0.4}
    scene = rendered_scene("superquadric", size, T, (np.array([0, 0, -1.0]), 1.8), CAMERA)
    frame = st.Frame(Gaussian(0.001)(scene.depth, scene.cosine, np.random.default_rng(5)))
    fit = st.fit_primitive(frame, "superquadric", camera=CAMERA, mask=scene.mask, plane=None)
    along = ["rx", "ry", "rz"][int(np.abs(fit.T_cam_obj[2, :3]).argmax())]
    assert not fit.bounded[along], fit
    assert fit.status == "weak"
    assert along in fit.reason


# ---- use ----
def test_auto_does_not_try_it():
    assert "superquadric" not in SOLIDS
    assert "superquadric" in SIZES


@pytest.mark.parametrize(("name", "value"), [("e1", 0.05), ("e2", 2.1), ("rx", 0.0)])
def test_a_start_beyond_the_limits_is_refused(name, value):
    start = (np.eye(4), {**SIZE, name: value})
    with pytest.raises(ValueError, match=r"initial: expected (exponents of 0\.1 to 2|lengths above 0)"):
        st.fit_primitive(np.zeros((20, 3)), "superquadric", initial=start)


def test_its_volume_mesh_and_wires_are_on_the_surface_and_exponents_have_no_unit():
    fit = st.PrimitiveFit("superquadric", np.eye(4), SIZE, 1e-6 * np.eye(11), 0.001, 1.0, st.Status.OK)
    for points in (fit.to_mesh().vertices, *wires("superquadric", SIZE)):
        assert np.abs(twin.superquadric_norm(SIZE, points) - 1).max() < 0.02
    at = near_surface(SIZE, 60, 0.01, seed=6)
    # The volume's voxels are 1.6 mm; it interpolates between them.
    np.testing.assert_allclose(fit.sdf(at), twin.distance("superquadric", SIZE, at), atol=4e-4)
    assert "rx 80.0 +- 1.0 mm" in repr(fit)
    assert "e1 0.60 +- 0.00;" in repr(fit).replace(", e2 1.30 +- 0.00", "")


def test_the_renderers_depth_is_where_the_twins_norm_is_one():
    origin = np.array([0.1, -0.2, -0.6])
    rays = np.random.default_rng(7).uniform(-0.06, 0.06, (400, 3)) - origin
    t, n = ray_depth("superquadric", SIZE, origin, rays)
    hit = np.isfinite(t)
    at = origin + t[hit, None] * rays[hit]
    np.testing.assert_allclose(twin.superquadric_norm(SIZE, at), 1, atol=1e-9)
    assert (np.einsum("ni,ni->n", n[hit], rays[hit]) < 0).all()
    assert 100 < hit.sum() < 400
