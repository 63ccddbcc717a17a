# SPDX-License-Identifier: MIT
"""Primitives of unknown size: fields and energies against finite differences and the twin, fits against the truth."""

import pickle

import numpy as np
import pytest

import sdftrack as st
from experiments.common.primitive_errors import measure
from experiments.synth.solids import KINDS, posed_scene, random_solid, ray_depth, standing_scene
from reference import primitives as twin
from sdftrack import _core
from sdftrack.primitives.frames import fuse_sizes
from sdftrack.primitives.segmentation import ON, TABLE_M, SegmentedFrame, pieces
from sdftrack.synth.noise import Gaussian, Kinect

CAMERA = st.Camera(525, 525, 319.5, 239.5, 640, 480)
SIZES = {
    "sphere": {"radius": 0.05},
    "cylinder": {"radius": 0.04, "height": 0.11},
    "cone": {"radius": 0.06, "height": 0.13},
    "box": {"x": 0.10, "y": 0.06, "z": 0.08},
    "ellipsoid": {"rx": 0.05, "ry": 0.08, "rz": 0.035},
}
PATCH = {"width": 0.2, "height": 0.12}
ALL = {**SIZES, "plane": PATCH}
KIND = _core.PrimitiveKind.__members__
SCALING = _core.Scaling.__members__
STEP = 1e-6  # m; phi is smooth but for edges, where a difference straddles two faces
SLOPE_ATOL = 1e-6  # of central differences in double; the second derivative is at most 1 / (a few mm)
# The printed form of a patch has slopes of up to 25 beside the rim, and curvatures to match.
SLOPE_RTOL = 1e-5
TWIN_ATOL_M = 1e-9  # the twin's bisection and segments are exact to rounding
NOISE_M = 0.001
LEAN_DEG = 6.0  # less than the 10 within which a base or a side is tried flat on the table


def lengths(kind, size=None):
    return list((size or ALL[kind]).values())


def cloud(kind, count=3000, noise=0.0, seed=0):
    """Points all over a solid, its own frame, m: where rays from all around it first hit; or all over a patch."""
    rng = np.random.default_rng(seed)
    out = rng.uniform(-0.5, 0.5, (count, 3)) * [*lengths("plane"), 0] if kind == "plane" else []
    while len(out) < count:
        origin = rng.normal(size=3)
        origin *= 0.5 / np.linalg.norm(origin)
        rays = rng.uniform(-0.06, 0.06, (200, 3)) - origin
        t, _ = ray_depth(kind, SIZES[kind], origin, rays)
        hit = np.isfinite(t)
        out.extend(origin + t[hit, None] * rays[hit])
    points = np.array(out[:count])
    return points + rng.normal(0, noise, points.shape) if noise else points


def moved(points, T):
    return points @ T[:3, :3].T + T[:3, 3]


POSE = st.geometry.pose([0.4, -0.7, 0.3], [0.03, -0.02, 0.8])


def scene(kind, noise=None, seed=1):
    """(frame, truth): the solid on a table."""
    rng = np.random.default_rng(seed)
    truth = standing_scene(kind, SIZES[kind], CAMERA, rng, (0.7, 0.8))
    depth = truth.depth if noise is None else noise(truth.depth, truth.cosine, rng)
    return st.Frame(depth, mask=None), truth


# ---- fields ----
@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("scaling", ["exact", "printed"])
def test_the_gradient_and_the_derivative_by_each_length_are_those_of_the_distance(kind, scaling):
    points = np.random.default_rng(0).uniform(-0.12, 0.12, (400, 3))

    def phi(p, size):
        return _core.primitive_distances(KIND[kind], size, p, SCALING[scaling])[0]

    size = lengths(kind)
    _, grad, by_size = _core.primitive_distances(KIND[kind], size, points, SCALING[scaling])
    for i, axis in enumerate(STEP * np.eye(3)):
        slope = (phi(points + axis, size) - phi(points - axis, size)) / (2 * STEP)
        np.testing.assert_allclose(grad[:, i], slope, rtol=SLOPE_RTOL, atol=SLOPE_ATOL)
    for i in range(len(size)):
        more, less = list(size), list(size)
        more[i], less[i] = size[i] + STEP, size[i] - STEP
        slope = (phi(points, more) - phi(points, less)) / (2 * STEP)
        np.testing.assert_allclose(by_size[:, i], slope, rtol=SLOPE_RTOL, atol=SLOPE_ATOL)


@pytest.mark.parametrize("kind", ALL)
def test_distances_are_those_of_the_twin(kind):
    points = np.random.default_rng(1).uniform(-0.12, 0.12, (300, 3))
    exact = _core.primitive_distances(KIND[kind], lengths(kind), points)[0]
    np.testing.assert_allclose(exact, twin.distance(kind, ALL[kind], points), atol=TWIN_ATOL_M)
    assert (exact.min() >= 0) == (kind == "plane")  # a patch has no inside
    printed = _core.primitive_distances(KIND[kind], lengths(kind), points, SCALING["printed"])[0]
    np.testing.assert_allclose(printed, twin.printed_field(kind, ALL[kind], points), atol=TWIN_ATOL_M)


def test_distances_at_centres_tips_and_rims():
    cases = [
        ("cone", [0.06, 0.08], [0, 0, 0.04 + 0.02], 0.02),  # above the apex
        ("cone", [0.0625, 0.125], [0.02, 0, -0.0625], 0),  # on the base to the last bit
        ("ellipsoid", [0.05, 0.08, 0.03], [0, 0, 0], -0.03),
        ("plane", [0.2, 0.12], [0.099, -0.059, 0], 0),
        ("plane", [0.2, 0.12], [0.02, 0.01, -0.03], 0.03),  # behind it as before it
    ]
    for kind, size, p, wanted in cases:
        phi, grad, _ = _core.primitive_distances(KIND[kind], size, np.array([p], float))
        assert phi[0] == pytest.approx(wanted, abs=1e-9), (kind, p)
        if kind == "plane":  # on the patch itself too
            assert np.linalg.norm(grad) == pytest.approx(1, abs=1e-12), p


@pytest.mark.parametrize("kind", ALL)
def test_the_reach_is_that_of_the_farthest_of_many_points_and_so_is_its_derivative(kind):
    rng, surface = np.random.default_rng(2), cloud(kind)
    for v in rng.normal(size=(6, 3)):
        v /= np.linalg.norm(v)
        reach, at, by_size = _core.primitive_reach(KIND[kind], lengths(kind), v.tolist())
        assert reach >= (surface @ v).max() - 1e-9
        assert np.dot(at, v) == pytest.approx(reach, abs=1e-12)
        assert twin.distance(kind, ALL[kind], np.array([at])) == pytest.approx(0, abs=TWIN_ATOL_M)
        for i in range(len(by_size)):
            more = list(lengths(kind))
            more[i] += STEP
            slope = (_core.primitive_reach(KIND[kind], more, v.tolist())[0] - reach) / STEP
            assert by_size[i] == pytest.approx(slope, abs=1e-4)


@pytest.mark.parametrize("kind", ["box", "ellipsoid"])
def test_axes_are_named_by_their_lengths_and_a_start_keeps_its_names(kind):
    """x the longest, z the shortest and towards the camera, x to the right; the same solid all the same."""
    frame, truth = scene(kind)
    fit = st.fit_primitive(frame, kind, camera=CAMERA, mask=truth.mask)
    size = list(fit.size.values())
    assert size == sorted(size, reverse=True)
    assert fit.T_cam_obj[0, 0] >= 0 >= fit.T_cam_obj[2, 2]
    assert np.linalg.det(fit.T_cam_obj[:3, :3]) == pytest.approx(1)
    names = list(fit.size)
    turned = fit.T_cam_obj[:, [1, 2, 0, 3]]
    start = dict(zip(names, (size[1], size[2], size[0]), strict=True))
    again = st.fit_primitive(frame, kind, camera=CAMERA, mask=truth.mask, initial=(turned, start))
    assert list(again.size.values()) == pytest.approx(list(start.values()), rel=0.02)
    points = np.vstack([np.eye(3), -np.eye(3)]) * 0.2
    for a, b in ((fit.T_cam_obj, size), (again.T_cam_obj, list(again.size.values()))):
        q = moved(points, np.linalg.inv(a))
        b = _core.primitive_distances(KIND[kind], b, q)[0]
        np.testing.assert_allclose(
            b,
            _core.primitive_distances(KIND[kind], size, moved(points, np.linalg.inv(fit.T_cam_obj)))[0],
            atol=2e-3,
        )


# ---- points ----
@pytest.mark.parametrize("kind", KINDS)
def test_auto_names_the_kind_of_noisy_points_with_outliers(kind):
    rng = np.random.default_rng(3)
    points = np.concatenate(
        [moved(cloud(kind, noise=NOISE_M), POSE), POSE[:3, 3] + rng.uniform(-0.15, 0.15, (300, 3))]
    )
    fit = st.fit_primitive(points)
    assert fit.kind == kind, fit.scores
    assert next(iter(fit.scores)) == kind
    assert set(fit.scores) == set(KINDS)
    # 3,000 readings of 1 mm leave some 0.1 mm; outliers near the surface pull a little.
    np.testing.assert_allclose(sorted(fit.size.values()), sorted(SIZES[kind].values()), rtol=0.01)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "cone", "box"])
def test_stray_points_change_no_length(kind):
    """Three in ten, in a cube of 0.3 m: without leaving them out, cones and boxes grow to it."""
    rng = np.random.default_rng(8)
    surface = moved(cloud(kind, noise=NOISE_M), POSE)[:1500]
    strays = POSE[:3, 3] + rng.uniform(-0.15, 0.15, (640, 3))
    fit = st.fit_primitive(np.concatenate([surface, strays]), kind)
    np.testing.assert_allclose(sorted(fit.size.values()), sorted(SIZES[kind].values()), atol=0.002)
    assert 0.65 < fit.inliers < 0.75  # they are counted


def test_a_shape_of_another_kind_is_not_ok():
    """A bar that ends in a ball: most of what is seen lies on the ball."""
    bar, ball = st.SDF.box((0.12, 0.03, 0.03), voxels=100), st.SDF.sphere(0.04, voxels=80)
    shape = st.union(bar, ball.transformed(st.geometry.pose([0, 0, 0], [0.06, 0, 0])))
    scene = st.synth.sequence(shape.to_mesh(), 1, noise=NOISE_M, clutter="table", seed=0)
    fit = st.fit_primitive(scene[0], camera=scene.camera, mask=scene.masks(0)[0])
    assert fit.status == "weak"
    assert "none of these solids" in fit.reason


def test_the_end_of_a_can_that_is_out_of_sight_has_no_variance_to_trust():
    points = cloud("cylinder", noise=NOISE_M)
    seen = points[(points[:, 0] < -0.01) & (np.abs(points[:, 2]) < 0.04)]  # of its side alone, without an end
    fit = st.fit_primitive(moved(seen, POSE), "cylinder")
    assert fit.bounded == {"radius": True, "height": False}
    assert np.isinf(fit.covariance[7, 7])
    assert fit.status == "weak"
    assert "height" in fit.reason
    # the least that holds what was seen: 80 mm, but for its outermost readings
    assert fit.size["height"] >= 0.078
    assert fit.size["radius"] == pytest.approx(0.04, rel=0.03)
    assert fit.to_dict()["covariance"][7][7] is None


def test_a_start_and_a_fit_as_the_start_lead_to_the_same():
    points = moved(cloud("cylinder", noise=NOISE_M), POSE)
    one = st.fit_primitive(points, "cylinder")
    two = st.fit_primitive(points, "cylinder", initial=(POSE, {"radius": 0.05, "height": 0.09}))
    three = st.fit_primitive(points, initial=one)
    for other in (two, three):
        assert other.kind == "cylinder"
        np.testing.assert_allclose(list(other.size.values()), list(one.size.values()), rtol=2e-3)


@pytest.mark.parametrize("kind", SIZES)
def test_the_printed_form_finds_the_same_solid(kind):
    points = moved(cloud(kind, noise=NOISE_M), POSE)
    frame, _ = scene(kind, Gaussian(NOISE_M))
    fits = {
        scaling: (
            st.fit_primitive(points, kind, scaling=scaling),
            st.fit_primitive(frame, kind, camera=CAMERA, scaling=scaling),
        )
        for scaling in ("exact", "printed")
    }
    for scaling, worst_m in (("exact", (0.0004, 0.0004)), ("printed", (0.0005, 0.0007))):
        for fit, limit_m in zip(fits[scaling], worst_m, strict=True):
            np.testing.assert_allclose(sorted(fit.size.values()), sorted(lengths(kind)), atol=limit_m)
    # Another field: next to the surface it is a distance times about the extent over the length.
    assert fits["printed"][1].size != fits["exact"][1].size


# ---- frames ----
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("noise", "share"), [(Gaussian(NOISE_M), 0.01), (Kinect(), 0.02)], ids=["1 mm", "kinect"]
)
def test_a_frame_without_a_mask_gives_kind_and_size_of_what_stands_on_the_table(kind, noise, share):
    """Targets: 1 % at 1 mm, 2 % with Kinect noise."""
    frame, truth = scene(kind, noise)
    fit = st.fit_primitive(frame, camera=CAMERA)
    assert fit.kind == kind, fit.scores
    found, true = list(fit.size.values()), list(truth.size.values())
    if kind in ("box", "ellipsoid"):
        found, true = sorted(found), sorted(true)
    np.testing.assert_allclose(found, true, rtol=share)
    assert np.linalg.norm(fit.T_cam_obj[:3, 3] - truth.T_cam_obj[:3, 3]) < (0.001 if share == 0.01 else 0.003)


@pytest.mark.parametrize("kind", ["cylinder", "ellipsoid"])
@pytest.mark.parametrize("every", [3, 4, 5])
def test_what_was_filled_in_a_lattice_of_holes_moves_no_length(kind, every):
    frame, truth = scene(kind)
    depth = frame.depth.copy()
    depth[::every] = depth[:, ::every] = 0
    off = [
        max(
            abs(a / b - 1)
            for a, b in zip(sorted(fit.size.values()), sorted(truth.size.values()), strict=True)
        )
        for fit in (
            st.fit_primitive(seen, kind, camera=CAMERA, mask=truth.mask)
            for seen in (frame, st.Frame(depth), st.Frame(st.Frame(depth).depth))
        )
    ]
    assert max(off[:2]) < 3e-4 < off[2]  # whole, with holes; filled pixels taken as measured


def test_what_is_no_solid_has_a_lower_score_than_what_is():
    """A bowl: the lower half of a ball, its inside seen. It is not a solid that the picture's edge shows."""
    frame, truth = scene("sphere", Gaussian(NOISE_M))
    whole = next(iter(st.fit_primitive(frame, camera=CAMERA, mask=truth.mask, plane=None).scores.values()))
    depth = frame.depth.copy()
    points = CAMERA.back_project(depth).astype(float)
    upper = truth.mask & (points @ truth.plane[0] + truth.plane[1] > SIZES["sphere"]["radius"])
    # Where the upper half is seen, the ray goes on to the inner side behind the middle, or over the edge.
    centre = truth.T_cam_obj[:3, 3]
    rays = CAMERA.back_project(np.ones(CAMERA.shape, np.float32)).astype(float)
    a, b = (rays**2).sum(-1), rays @ centre
    far = (b + np.sqrt(np.maximum(b * b - a * (centre @ centre - SIZES["sphere"]["radius"] ** 2), 0))) / a
    inner = (far[..., None] * rays) @ truth.plane[0] + truth.plane[1] < SIZES["sphere"]["radius"]
    depth[upper] = np.where(inner, far, 1.6)[upper].astype(np.float32)
    mask = truth.mask & ~(upper & ~inner)
    bowl = next(iter(st.fit_primitive(st.Frame(depth), camera=CAMERA, mask=mask, plane=None).scores.values()))
    assert whole > 0.95
    assert bowl < 0.85 * whole


def measured_frame(kind, number, noise):
    """(frame, truth) of the measuring command's solid."""
    rng = np.random.default_rng([KINDS.index(kind), number])
    truth = standing_scene(kind, random_solid(kind, rng), CAMERA, rng)
    return st.Frame(noise(truth.depth, truth.cosine, rng)), truth


def measured(kind, number, noise, fitted=None):
    """(fit, truth) of that."""
    frame, truth = measured_frame(kind, number, noise)
    return st.fit_primitive(frame, fitted or kind, camera=CAMERA), truth


@pytest.mark.parametrize(
    ("kind", "number", "noise", "fitted", "share"),
    [
        ("box", 25, Gaussian(NOISE_M), "box", 0.005),  # a face at a grazing angle was taken for free space
        ("cone", 70, Kinect(), "cone", 0.02),  # low ones were made smaller by doubt of their axis: 4 %
        ("cone", 86, Kinect(), "cone", 0.02),
        ("cone", 198, Gaussian(NOISE_M), "auto", 0.01),  # a flat one came out an ellipsoid
    ],
)
def test_solids_that_came_out_wrong_once_have_their_size(kind, number, noise, fitted, share):
    fit, truth = measured(kind, number, noise, fitted)
    assert fit.kind == kind
    found, true = list(fit.size.values()), list(truth.size.values())
    np.testing.assert_allclose(np.sort(found), np.sort(true), rtol=share)


@pytest.mark.parametrize(("number", "noise", "limit_deg"), [(3, Gaussian(NOISE_M), 0.3), (75, Kinect(), 1.0)])
def test_a_small_cylinder_that_stands_has_the_axis_of_its_table(number, noise, limit_deg):
    """670 and 750 pixels; by their lowest point alone they were 0.31 and 1.14 deg off, two stated deviations."""
    fit, truth = measured("cylinder", number, noise)
    error = measure(fit, truth)
    assert error.axis_deg < 0.5 * limit_deg
    assert error.axis_deg < 3 * error.axis_sd_deg
    assert error.size < 0.02


@pytest.mark.parametrize("number", [0, 9])
def test_a_cylinder_that_lies_touches_its_table_along_a_line(number):
    """By its lowest point alone these were 0.31 and 0.45 deg off."""
    rng = np.random.default_rng([KINDS.index("cylinder"), number, 11])
    truth = posed_scene("cylinder", CAMERA, rng, 90.0, 0.0)
    frame = st.Frame(Kinect()(truth.depth, truth.cosine, rng))
    error = measure(st.fit_primitive(frame, "cylinder", camera=CAMERA), truth)
    assert error.axis_deg < 0.25
    assert error.axis_deg < 3 * error.axis_sd_deg


@pytest.mark.parametrize(
    ("kind", "lean_deg"), [("cone", LEAN_DEG), ("cylinder", LEAN_DEG), ("cylinder", 90 - LEAN_DEG)]
)
def test_what_leans_is_not_laid_flat(kind, lean_deg):
    """By 6 degrees, on a wedge say: the axis is that of the readings, not the table's."""
    rng = np.random.default_rng(5)
    truth = posed_scene(kind, CAMERA, rng, lean_deg, 0.0)
    depth = Gaussian(NOISE_M)(truth.depth, truth.cosine, rng)
    error = measure(st.fit_primitive(st.Frame(depth), kind, camera=CAMERA), truth)
    assert error.axis_deg < 0.5  # 0.2 is usual at 1 mm
    assert error.axis_deg < 4 * error.axis_sd_deg


def test_the_readings_just_above_the_table_are_not_chosen_by_their_noise():
    """One threshold for each reading kept those that noise lifts: 2.4 mm too near at 6 to 8 mm of height."""
    frame, truth = measured_frame("cone", 86, Kinect())
    seen = SegmentedFrame.of(frame, CAMERA, "auto", None)
    on = (seen.labels(pieces(seen)[0], True) == ON) & truth.mask
    true = SegmentedFrame.of(st.Frame(truth.depth), CAMERA, truth.plane, None)
    foot = on & (true.heights() < 1.25 * TABLE_M * true.growth)
    off_m = (frame.depth - truth.depth)[foot]
    assert foot.sum() > 300
    assert abs(off_m.mean()) < 4 * off_m.std() / np.sqrt(foot.sum())


def test_a_box_seen_from_the_front_alone_has_an_open_depth_and_the_table_bounds_a_height():
    from experiments.synth.solids import open_view

    depth, _, mask, _ = open_view("box", np.random.default_rng([3, 0, 7]), CAMERA)
    fit = st.fit_primitive(st.Frame(depth), "box", camera=CAMERA, mask=mask, plane=None)
    along = int(np.abs(fit.T_cam_obj[2, :3]).argmax())
    assert [not b for b in fit.bounded.values()] == [i == along for i in range(3)]

    frame, truth = scene("cylinder", Gaussian(NOISE_M))
    rows = np.flatnonzero(truth.mask.any(axis=1))
    upper = truth.mask & (np.arange(480)[:, None] < rows[0] + 0.8 * len(rows))
    low = frame.depth.copy()
    low[truth.mask & ~upper] = 0  # its lower part gives no reading
    without = st.fit_primitive(st.Frame(low), "cylinder", camera=CAMERA, mask=upper, plane=None)
    assert not without.bounded["height"]


def test_frames_of_one_object_give_one_size_that_is_better_known():
    _, truth = scene("cylinder")
    frames = [st.Frame(Kinect()(truth.depth, truth.cosine, np.random.default_rng(s))) for s in range(4)]
    fit = st.fit_primitive(frames, "cylinder", camera=CAMERA, mask=truth.mask)
    assert len(fit.per_frame) == 4
    np.testing.assert_allclose(list(fit.size.values()), lengths("cylinder"), rtol=0.01)
    sd = np.sqrt(np.diag(fit.covariance)[6:])
    single = np.sqrt(np.diag(fit.per_frame[0].covariance)[6:])
    assert (sd < single).all()


def test_sizes_are_fused_by_their_information_and_what_no_frame_bounds_stays_open():
    sizes = np.array([[0.10, 0.20], [0.12, 0.30]])
    one, two = np.diag([1e-6, np.inf]), np.diag([4e-6, np.inf])
    size, covariance = fuse_sizes(sizes, np.stack([one, two]))
    assert size[0] == pytest.approx((0.10 / 1 + 0.12 / 4) / (1 + 1 / 4), rel=1e-12)  # Eq. 3.23
    assert size[1] == 0.30
    assert np.isinf(covariance[1, 1])


def test_several_solids_are_found_one_after_another():
    rng = np.random.default_rng(4)
    kinds = ["box", "cylinder", "sphere"]
    first = standing_scene("box", SIZES["box"], CAMERA, rng, (0.8, 0.81))
    depth, up, d = first.depth.copy(), *first.plane
    rays = CAMERA.back_project(np.ones(CAMERA.shape, np.float32)).astype(float).reshape(-1, 3)
    for kind, side in (("cylinder", 0.16), ("sphere", -0.16)):
        T = first.T_cam_obj.copy()
        height = SIZES[kind].get("height", 2 * SIZES[kind]["radius"])
        at = first.T_cam_obj[:3, 3] + np.array([side, 0, 0])
        T[:3, 3] = at - up * (at @ up + d) + up * height / 2
        z, _ = ray_depth(kind, SIZES[kind], -T[:3, :3].T @ T[:3, 3], rays @ T[:3, :3])
        z = z.reshape(CAMERA.shape)
        depth = np.where(z < depth, z, depth).astype(np.float32)
    frame = st.Frame(Gaussian(NOISE_M)(depth, np.ones_like(depth), rng))
    fits = st.fit_primitives(frame, camera=CAMERA)
    assert sorted(f.kind for f in fits) == sorted(kinds)
    for fit in fits:
        found, true = sorted(fit.size.values()), sorted(SIZES[fit.kind].values())
        np.testing.assert_allclose(found, true, rtol=0.02)


# ---- results ----
def test_a_fit_gives_a_volume_to_track_with_and_can_be_kept():
    fit = st.fit_primitive(moved(cloud("cone"), POSE), "cone")
    local = moved(moved(cloud("cone", 200), POSE), np.linalg.inv(fit.T_cam_obj))
    assert np.abs(fit.sdf(local)).max() < 2 * fit.sdf.voxel_size
    copy = pickle.loads(pickle.dumps(fit))
    assert copy.size == fit.size
    assert "cone" in repr(fit)
    assert "mm" in repr(fit)


def test_whole_numbers_of_numpy_are_whole_numbers_and_points_have_a_unit():
    points = moved(cloud("sphere", 200), POSE)
    one = st.fit_primitive(points, "sphere", seed=np.int64(3), threads=np.int64(1))
    two = st.fit_primitive(1e3 * points, "sphere", seed=3, unit="mm")
    assert one.size["radius"] == pytest.approx(two.size["radius"], rel=1e-6)  # of a factor of 1000 and back
    large = st.fit_primitive(1e3 * points, "sphere", unit="m")
    assert large.size["radius"] == pytest.approx(50, rel=1e-3)
