# SPDX-License-Identifier: MIT
"""Colour: histograms and posteriors against their twin, the way from depth to colour, and the RGB-D penalties."""

import itertools

import numpy as np
import pytest

import sdftrack as st
from reference import appearance as twin
from reference import energies as twin_energies
from reference import tracking
from sdftrack import _core, geometry
from sdftrack.camera.rgbd import color_map

# float32 histograms and posteriors.
POSTERIOR_ATOL = 2e-6
# The same after a difference of two histograms; measured 5e-6.
WITHOUT_FRONT_ATOL = 1e-5
# A sum of 4096 products in float32.
OVERLAP_ATOL = 1e-5
LIKELIHOODS = ["odds", "printed"]
SCALE_M = 0.004

CAMERA = st.Camera(fx=120, fy=122, cx=39.5, cy=29.5, width=80, height=60)
TRUTH = geometry.pose([0.4, -0.9, 0.3], [0.004, -0.006, 0.35])
START = geometry.pose([0.43, -0.88, 0.27], [0.006, -0.004, 0.353])
RED, BLUE, GREY, SKIN = (200, 40, 40), (30, 40, 190), (120, 120, 120), (200, 150, 120)


@pytest.fixture(scope="module")
def shape():
    return st.union(st.SDF.box([0.10, 0.06, 0.04], voxels=60), st.SDF.sphere(0.033, voxels=60))


@pytest.fixture(scope="module")
def depth(shape):
    near = shape.render(CAMERA, TRUTH)[0]
    noise = np.random.default_rng(3).normal(0, 0.001, near.shape)
    return np.where(near > 0, near + noise, 0.42).astype(np.float32)  # a wall close behind


@pytest.fixture(scope="module")
def color(depth):
    """A red object before a blue wall, each with some grey."""
    rng = np.random.default_rng(4)
    image = np.where((depth < 0.41)[..., None], RED, BLUE)
    image = np.where(rng.random(depth.shape)[..., None] < 0.15, GREY, image)
    return np.clip(image + rng.normal(0, 6, image.shape), 0, 255).astype(np.uint8)


def rgbd_energy(shape, depth, color, camera=CAMERA, poses=START, mask=None, penalty="rgbd", **options):
    frame = st.Frame(depth, color, mask=mask)
    return st.Energy(shape, camera, frame, poses, penalty=penalty, scale_m=SCALE_M, **options)


def random_counts(seed, pixels=3000, around=None, sd=30):
    rng = np.random.default_rng(seed)
    middle = rng.uniform(60, 190, 3) if around is None else around
    colors = np.clip(rng.normal(middle, sd, (pixels, 3)), 0, 255).astype(np.uint8)
    return np.bincount(twin.color_bin(colors), minlength=4096).astype(np.float32)


# --- histograms
def test_posteriors_and_overlap_of_pooled_histograms_are_those_of_the_twin():
    model = _core.ColorModel(0.7)
    shares = [c / c.sum() for c in (random_counts(0), random_counts(1))]
    model.update(random_counts(0), random_counts(1))
    for seed in (2, 4):
        new = random_counts(seed), random_counts(seed + 1)
        model.update(*new, 0.05, 0.3)
        shares = [twin.pool(s, c, rate) for s, c, rate in zip(shares, new, (0.05, 0.3), strict=True)]
    expected = twin.posterior(*shares)
    assert expected.min() < 0.1
    assert expected.max() > 0.9
    np.testing.assert_allclose(model.posterior, expected, atol=POSTERIOR_ATOL)
    assert model.overlap == pytest.approx(twin.overlap(*shares), abs=OVERLAP_ATOL)


@pytest.mark.parametrize("held", [False, True])
def test_the_colours_at_a_pose_and_of_what_stands_in_front_are_counted_as_the_twin_counts_them(
    shape, depth, color, held
):
    if held:
        depth, color = depth.copy(), color.copy()
        depth[20:30, 20:60] = 0.30  # a bar, 5 cm before the object's centre
        color[20:30, 20:60] = SKIN
    got = counted(shape, depth, color, TRUTH, budget=depth.size)
    centre = tracking.make_shape(shape.values, shape.voxel_size, shape.origin).centre
    field = twin_energies.SingleObject(
        shape.values, shape.voxel_size, shape.origin - centre, tracking.centred(TRUTH, centre)
    )
    K = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])
    expected = twin.count_colors(depth, color, K, field, shape.voxel_size, (0, 0, 80, 60))
    for mine, other in zip(got, expected, strict=True):
        assert np.abs(mine - other).sum() <= 0.01 * other.sum()  # phi within float32 of a limit
    red, blue, skin = (twin.color_bin(np.array(c, np.uint8)) for c in (RED, BLUE, SKIN))
    assert got[0][blue] == got[1][red] == 0
    assert got[0][red] > 20
    assert got[1][blue] > 20
    if held:
        assert expected[2][skin] > 100
        assert got[2].sum() == got[2][skin]  # nothing behind


def test_colours_of_a_hand_that_were_counted_as_the_objects_are_taken_out_as_by_the_twin():
    thing, behind, hand = (random_counts(seed, around=c, sd=12) for seed, c in enumerate((BLUE, GREY, SKIN)))
    share, around, front = (c / c.sum() for c in (0.85 * thing + 0.15 * hand, behind, hand))
    model = _core.ColorModel(0.7)
    model.update(0.85 * thing + 0.15 * hand, behind, front=hand)
    np.testing.assert_allclose(
        model.posterior, twin.posterior(share, around, front_share=front), atol=WITHOUT_FRONT_ATOL
    )
    plain = _core.ColorModel(0.7)
    plain.update(0.85 * thing + 0.15 * hand, behind)
    of_hand = np.average(model.posterior, weights=hand), np.average(plain.posterior, weights=hand)
    of_thing = np.average(model.posterior, weights=thing), np.average(plain.posterior, weights=thing)
    assert of_hand[0] < of_hand[1] - 0.2
    assert of_thing[0] > of_thing[1] - 0.05


def test_an_object_of_the_hands_own_colours_keeps_them():
    thing, behind = random_counts(30), random_counts(31)
    model, plain = _core.ColorModel(0.7), _core.ColorModel(0.7)
    model.update(thing, behind, front=0.5 * thing)
    plain.update(thing, behind)
    np.testing.assert_array_equal(model.posterior, plain.posterior)


def counted(shape, depth, color, T, mask=None, budget=100000, camera=CAMERA):
    return _core.color_counts(
        shape.values, shape.voxel_size, shape.origin.tolist(), camera._core, depth, mask, color,
        color_map(camera, color), T, 0.3, budget,
    )  # fmt: skip


def test_colours_of_a_mask_are_those_inside_and_in_the_ring(shape, depth, color):
    mask = (depth < 0.41).astype(np.uint8)
    inside, ring, front = counted(shape, depth, color, TRUTH, mask)
    assert inside.sum() == mask.sum()
    np.testing.assert_array_equal(
        inside, np.bincount(twin.color_bin(color[mask != 0]), minlength=4096).astype(np.float32)
    )
    assert 0 < ring.sum() <= (mask == 0).sum()
    assert ring[twin.color_bin(np.array(RED, np.uint8))] == 0
    assert front.sum() == 0


# --- over the image
def a_finger_over_an_object(rng, width=64, height=40, noise_m=0.001):
    """An upright object at 0.5 m, a finger that comes from 3 cm before it down onto it, some pixels left out."""
    v, u = np.mgrid[0:height, 0:width]
    depth = np.full((height, width), 0.5)
    finger = abs(v - 20) < 7
    depth[finger] = np.where(u < 40, 0.5 - 0.03 * np.clip((40 - u) / 20, 0, 1), depth)[finger]
    depth += noise_m * rng.standard_normal(depth.shape)
    at = np.flatnonzero((rng.random(depth.shape) < 0.7) & (u > 2)).astype(np.int32)
    z = depth.ravel()[at].astype(np.float32)
    return at, z, (0.5 - z).astype(np.float32), finger.ravel()[at] & (u.ravel()[at] < 40)


@pytest.mark.parametrize("with_distance", [False, True])
@pytest.mark.parametrize("noise_m", [0.001, 0.004])
@pytest.mark.parametrize("focal_px", [80.0, 300.0, 2500.0])
def test_posteriors_are_smoothed_over_the_image_as_by_the_twin(with_distance, noise_m, focal_px):
    rng = np.random.default_rng(3)
    at, z, distance, _ = a_finger_over_an_object(rng)
    foreground = rng.uniform(0.02, 0.98, len(at)).astype(np.float32)
    arguments = (64, focal_px, noise_m, distance if with_distance else None)
    got = _core.smooth_foreground(at, z, foreground, *arguments)
    expected = twin.smooth_foreground(at, z.astype(float), foreground.astype(float), *arguments)
    np.testing.assert_allclose(got, expected, atol=POSTERIOR_ATOL)
    assert np.abs(got - foreground).max() > 0.1


def test_what_lies_on_the_surface_beside_a_finger_in_front_is_doubted_and_no_other_part_is():
    rng = np.random.default_rng(5)
    at, z, distance, finger = a_finger_over_an_object(rng)
    prior = np.full(len(at), 0.7, np.float32)
    got = _core.smooth_foreground(at, z, prior, 64, 300.0, 0.001, distance)
    u, v = at % 64, at // 64
    contact = finger & (distance < 0.005)
    assert contact.sum() > 20
    assert np.median(got[contact]) < 0.25
    away = (abs(v - 20) > 14) | (u > 56)
    np.testing.assert_allclose(got[away], 0.7, atol=1e-5)


# --- from depth to colour
def rigs():
    T = geometry.pose([0.01, -0.03, 0.02], [0.025, -0.002, 0.004])
    lens = st.Camera(
        fx=100, fy=101, cx=44, cy=33, width=90, height=70, distortion=[0.1, -0.2, 1e-3, 2e-3, 0.05]
    )
    plain = st.Camera(fx=100, fy=101, cx=44, cy=33, width=90, height=70)
    P = plain.K @ T[:3, :3] @ np.linalg.inv(CAMERA.K)
    return {
        "aligned": st.RGBDCamera(CAMERA),
        "rigid": st.RGBDCamera(CAMERA, plain, T_color_depth=T),
        "lens": st.RGBDCamera(CAMERA, lens, T_color_depth=T),
        "pair": st.RGBDCamera(CAMERA, plain, projective=(P, plain.K @ T[:3, 3])),
    }


@pytest.mark.parametrize("kind", ["aligned", "rigid", "lens", "pair"])
def test_the_cores_mapping_finds_the_pixels_of_the_rig(kind):
    rig = rigs()[kind]
    size = CAMERA.shape if kind == "aligned" else rig.color.shape
    mapping = color_map(rig, np.zeros((*size, 3), np.uint8))
    found = 0
    for u, v, z in itertools.product(range(0, 80, 7), range(0, 60, 7), (0.3, 0.8)):
        point = z * np.array([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, 1])
        px = rig.project_to_color(point)
        got = mapping.find(u, v, z)
        if got is None:
            assert not (px > 0).all() or px[0] > size[1] - 1 or px[1] > size[0] - 1
            continue
        found += 1
        assert np.abs(np.array(got) - px).max() <= 0.5 + 1e-3  # the nearest pixel, in float32
    assert found > 50


def test_a_pixel_that_the_colour_camera_cannot_see_has_no_colour_evidence(shape):
    """A plate hides the object's left from a colour camera that stands far to the left."""
    T = geometry.pose(t_m=[0.06, 0, 0])
    rig = st.RGBDCamera(CAMERA, CAMERA, T_color_depth=T)
    depth = np.where(shape.render(CAMERA, TRUTH)[0] > 0, shape.render(CAMERA, TRUTH)[0], 0.6).astype(
        np.float32
    )
    plate = np.s_[:, :24]
    depth[plate] = np.where(depth[plate] > 0.5, 0.22, depth[plate])
    # Two colours that the model tells apart: what is seen has one of two posteriors, what is not has the prior.
    colors = np.full((60, 80, 3), 99, np.uint8)
    colors[:, :40] = RED
    energy = rgbd_energy(shape, depth, colors, rig, TRUTH)
    seen = energy.residuals(energy.start)
    unknown = seen["foreground"] == np.float32(0.7)
    # All readings, so that what hides is among them.
    mapping = color_map(rig, colors)
    places = [(u, v, mapping.find(u, v, float(depth[v, u]))) for v, u in np.ndindex(60, 80)]
    places = [p for p in places if p[2] is not None]
    color_px = np.array([p[2] for p in places])
    color_depth = np.array([depth[v, u] for u, v, _ in places])

    def hidden(reach_px):
        visible = twin.seen_by_color(color_px, color_depth, reach_px)
        at = {(u, v) for (u, v, _), s in zip(places, visible, strict=True) if not s}
        return np.array([(u, v) in at for u, v in zip(seen["u_px"], seen["v_px"], strict=True)])

    # Cells of two pixels lie between pairs within the same pixel and pairs within one and a half.
    assert hidden(0.5).sum() > 100
    assert unknown[hidden(0.5)].all()
    assert not unknown[~hidden(1.5)].any()


# --- penalties
def twin_of(energy, likelihood):
    from test_energy import Twin

    same = Twin(energy)
    same.penalty = (
        twin_energies.ColorOdds(SCALE_M, energy.options.outlier_floor, energy.options.color_prior)
        if likelihood == "odds"
        else twin_energies.ColorPrinted(SCALE_M)
    )
    return same


@pytest.mark.parametrize("likelihood", LIKELIHOODS)
@pytest.mark.parametrize("residual", ["point", "ray_hit"])
def test_cost_gradient_and_hessian_are_those_of_the_twin(shape, depth, color, likelihood, residual):
    from test_energy import assert_same_model

    energy = rgbd_energy(shape, depth, color, residual=residual, color_likelihood=likelihood)
    same = twin_of(energy, likelihood)
    foreground = energy.residuals(energy.start)["foreground"].astype(np.float64)
    assert foreground.min() < 0.1
    assert foreground.max() > 0.9
    assert_same_model(
        energy.linearize(energy.start),
        twin_energies.linearize(
            same.field, same.rays, same.depths, same.gains, same.penalty, None, foreground
        ),
    )
