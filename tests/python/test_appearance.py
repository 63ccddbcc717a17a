# SPDX-License-Identifier: MIT
"""Colour: posteriors of a frame against their twin, the way from depth to colour, and the RGB-D penalties."""

import itertools

import numpy as np
import pytest

import sdftrack as st
from reference import appearance as twin
from reference import energies as twin_energies
from reference import tracking
from sdftrack import geometry
from sdftrack.camera.rgbd import color_map

# Posteriors of counts in which one pixel of a hundred is counted otherwise: phi is within float32 of a limit.
COUNTED_ATOL = 0.02
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


# --- from a frame to posteriors
@pytest.mark.parametrize(
    ("held", "learning"), [(False, "guarded"), (True, "guarded"), (False, "printed"), (True, "printed")]
)
def test_every_pixel_has_the_posterior_of_the_colours_at_the_pose_and_around_as_by_the_twin(
    shape, depth, color, held, learning
):
    if held:
        depth, color = depth.copy(), color.copy()
        depth[20:30, 20:60] = 0.30  # a bar, 5 cm before the object's centre
        color[20:30, 20:60] = SKIN
    energy = rgbd_energy(shape, depth, color, poses=TRUTH, padding_m=0.3, color_learning=learning)
    seen = energy.residuals(energy.start)
    centre = tracking.make_shape(shape.values, shape.voxel_size, shape.origin).centre
    field = twin_energies.SingleObject(
        shape.values, shape.voxel_size, shape.origin - centre, tracking.centred(TRUTH, centre)
    )
    K = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])
    counts = twin.count_colors(
        depth, color, K, field, shape.voxel_size, (0, 0, 80, 60), learning == "printed"
    )
    red, blue, skin = (twin.color_bin(np.array(c, np.uint8)) for c in (RED, BLUE, SKIN))
    assert min(counts[0][red], counts[1][blue]) > 20
    if learning == "guarded":
        assert counts[0][blue] == counts[1][red] == 0
        assert counts[2].sum() == counts[2][skin]  # nothing behind
        assert (counts[2][skin] > 100) == held
    shares = [c / c.sum() for c in counts if c.any()]
    expected = twin.posterior(*shares[:2], front_share=shares[2] if counts[2].any() else None)
    of = color[seen["v_px"].astype(int), seen["u_px"].astype(int)]
    off = np.abs(seen["foreground"] - expected[twin.color_bin(of)])
    assert np.quantile(off, 0.95) < COUNTED_ATOL
    assert seen["foreground"].min() < 0.1
    assert seen["foreground"].max() > 0.9


def test_colours_of_a_mask_are_those_inside_and_in_the_ring(shape, depth, color):
    mask = depth < 0.41
    energy = rgbd_energy(shape, depth, color, mask=mask)
    seen = energy.residuals(energy.start)
    inside = mask[seen["v_px"].astype(int), seen["u_px"].astype(int)]
    of = np.array(color[seen["v_px"].astype(int), seen["u_px"].astype(int)], int)
    grey = np.ptp(of, axis=1) < 60
    assert (seen["foreground"][inside & ~grey] > 0.9).all()
    assert (seen["foreground"][~inside & ~grey] < 0.1).all()


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
