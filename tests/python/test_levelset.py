# SPDX-License-Identifier: MIT
"""Evidence about voxels, the distance between inside and outside, the evolution of a level set."""

import numpy as np
import pytest
from levelset_scene import (
    BALL_M,
    CAMERA,
    K,
    ball_depth,
    directions,
    fuse,
    lattice,
    looking_from,
    reconstruction,
    slope_error,
    zero_crossings,
)

import sdftrack as st
from reference import levelset as reference
from sdftrack import _core

# Not whole blocks of 8 in any axis, and one (17) that ends in a block of border voxels alone.
SHAPE, VOXEL_M, ORIGIN = (19, 17, 21), 0.004, (-0.041, -0.033, -0.039)
# A voxel 0.3 m away is rounded by 3e-8 m, and the smooth ratio's slope is 1.6 / noise = 400 per m beside the surface;
# the printed one's is 2 / distance, up to 1e6 per m where the ratio is cut.
RATIO_ATOL, PRINTED_RATIO_ATOL, WEIGHT_ATOL = 2e-5, 2e-3, 1e-6
CROSSING_ATOL_VOXELS = 1e-3  # both from the core's own sums, of which some are near 0
NOISE = {"noise_m": 0.001, "noise_per_m": 0.02}  # at 0.4 m as large as a voxel


def views(n, noise_m=0.0005, distance_m=0.3, seed=1):
    """(T_cam_obj, depth, mask) all round the ball; a hole of NaN and one of 0 in each."""
    random = np.random.default_rng(seed)
    for k, direction in enumerate(directions(n)):
        T = looking_from(direction, distance_m, 0.3 * k)
        depth, mask = ball_depth(CAMERA, T)
        depth += random.normal(size=depth.shape).astype(np.float32) * np.float32(noise_m)
        depth[20:24, 30:40], depth[40:43, 30:40] = np.nan, 0
        yield T, depth, mask


# ---- 1. evidence ----
@pytest.mark.parametrize("printed", [False, True])
@pytest.mark.parametrize("max_weight", [100.0, 1.5])
def test_evidence_and_its_sums_are_those_of_the_twin(printed, max_weight):
    """Printed, a guess stays a factor, whatever is seen."""
    prior = np.random.default_rng(0).normal(size=SHAPE).astype(np.float32) if printed else None
    o = reference.Options(printed=printed, min_noise_m=VOXEL_M, max_weight=max_weight, **NOISE)
    core = reconstruction(SHAPE, VOXEL_M, ORIGIN, prior, printed=printed, max_weight=max_weight, **NOISE)
    ratio, weight = prior.astype(float) if printed else np.zeros(SHAPE), np.zeros(SHAPE)
    for T, depth, mask in views(4):  # from the fifth on the core leaves out what is surely empty
        fuse(core, CAMERA, T, depth, mask)
        p_cam = lattice(SHAPE, VOXEL_M, ORIGIN) @ T[:3, :3].T + T[:3, 3]
        said = reference.evidence(p_cam, np.nan_to_num(depth), mask, K, o)
        ratio, weight = reference.fuse(ratio, weight, said, max_weight, printed)
    assert (ratio > 0).mean() > 0.05
    assert (weight == 0).mean() > 0.05
    assert weight.max() <= max_weight * (1 + 1e-6)
    np.testing.assert_allclose(core.weight, weight, atol=WEIGHT_ATOL)
    # Printed, q comes within 1e-4 of 1, and its logarithm has that many digits less.
    rtol = 5e-4 if printed else 1e-7
    np.testing.assert_allclose(
        core.log_ratio, ratio, rtol=rtol, atol=PRINTED_RATIO_ATOL if printed else RATIO_ATOL
    )


# ---- 2. fusing ----
def test_a_guess_counts_only_where_nothing_is_seen():
    prior = np.full(SHAPE, 0.4, np.float32)
    plain, guessed = (reconstruction(SHAPE, VOXEL_M, ORIGIN, p) for p in (None, prior))
    for T, depth, mask in list(views(6))[:2]:
        for core in (plain, guessed):
            fuse(core, CAMERA, T, depth, mask)
    seen = plain.weight > 0
    assert 0.1 < seen.mean() < 0.9
    np.testing.assert_array_equal(guessed.weight, plain.weight)
    np.testing.assert_array_equal(guessed.log_ratio[seen], plain.log_ratio[seen])
    assert (guessed.log_ratio[~seen] == np.float32(0.4)).all()


def test_one_frame_carves_a_guess_that_is_too_large_before_and_beside_the_object():
    n, voxel_m = 50, 0.0025
    origin = np.full(3, -0.5 * voxel_m * (n - 1))
    points = lattice((n,) * 3, voxel_m, origin)
    away = np.linalg.norm(points, axis=-1)
    prior = (0.4 * np.tanh((0.055 - away) / (4 * voxel_m))).astype(np.float32)
    T = looking_from([0, 0, 1], 0.3)
    core = reconstruction((n,) * 3, voxel_m, origin, prior)
    depth, mask = ball_depth(CAMERA, T)
    fuse(core, CAMERA, T, depth, mask)
    p = points @ T[:3, :3].T + T[:3, 3]
    u, v = np.moveaxis(CAMERA.project(p.reshape(-1, 3)), -1, 0)
    in_view = ((u > 1) & (u < CAMERA.width - 2) & (v > 1) & (v < CAMERA.height - 2)).reshape((n,) * 3)
    # Rays past the ball, by more than the 2 px that say nothing at an edge (4 mm), and what lies before it.
    beside = in_view & (np.hypot(p[..., 0], p[..., 1]) * 0.3 / p[..., 2] > BALL_M + 0.006)
    before = in_view & (away > BALL_M + 0.006) & (np.hypot(p[..., 0], p[..., 1]) < 0.015) & (p[..., 2] < 0.3)
    behind = (np.hypot(p[..., 0], p[..., 1]) < 0.015) & (p[..., 2] > 0.3) & (away < 0.045)
    for carved in (beside, before):
        assert (prior[carved] > 0).sum() > 500
        assert (core.phi[carved] > 0).all()
    assert (core.phi[behind] < 0).all()


# ---- 3. distance ----
def test_distances_beside_a_change_of_sign_are_those_of_the_twin_after_every_frame():
    core = reconstruction(SHAPE, VOXEL_M, ORIGIN, **NOISE)
    for T, depth, mask in views(6):
        fuse(core, CAMERA, T, depth, mask)
        ratio, weight = core.log_ratio.astype(np.float64), core.weight.astype(np.float64)
        mean = np.where(weight > 0, ratio / np.maximum(weight, 1e-30), ratio)
        expected = reference.crossings(mean, VOXEL_M)
        beside = ~np.isnan(expected)
        assert beside.sum() > 300
        assert np.abs(core.phi - expected)[beside].max() < CROSSING_ATOL_VOXELS * VOXEL_M


def test_a_ball_seen_from_all_round_without_noise_is_right_to_a_tenth_of_a_voxel():
    n, voxel_m = 64, 0.0014
    origin = np.array([-0.0443, -0.0437, -0.0441])
    away = np.linalg.norm(lattice((n,) * 3, voxel_m, origin), axis=-1)
    camera = st.Camera(400, 400, 79.5, 79.5, 160, 160)
    # A guess too large by 8 voxels: the front comes from farther than the band is wide.
    prior = (0.4 * np.tanh((BALL_M + 0.012 - away) / (4 * voxel_m))).astype(np.float32)
    core = reconstruction((n,) * 3, voxel_m, origin, prior, threads=2)
    for direction in directions(40):
        T = looking_from(direction, 0.3)
        fuse(core, camera, T, *ball_depth(camera, T))
    error = np.linalg.norm(zero_crossings(core.phi, voxel_m, origin), axis=1) - BALL_M
    assert np.median(np.abs(error)) < 0.1 * voxel_m  # measured 0.023
    assert np.abs(error).max() < 0.25 * voxel_m  # measured 0.10
    assert slope_error(core.phi, voxel_m) < 0.05  # measured 0.024
    far = np.abs(core.phi - (away - BALL_M)) / voxel_m
    assert far[np.abs(core.phi) < 8 * voxel_m].max() < 1  # what the tracker looks at
    deep = away < 6 * voxel_m  # where the distance has its ridge, which nodes of 4 voxels cut off
    assert far[~deep].max() < 2.5  # measured 1.8, at the corners
    assert far[deep].max() < 4  # measured 3.6


# ---- st.levelset ----
def one_frame(**given):
    T = looking_from([0.2, -0.3, 1], 0.3)
    depth, mask = ball_depth(CAMERA, T)
    return st.Frame(depth, mask=mask, **given), T


def test_a_mask_overrides_the_frames_and_without_any_all_readings_are_the_objects():
    frame, T = one_frame()
    grid = st.SDF.sphere(BALL_M, voxels=24)
    own = st.levelset.evidence(frame, CAMERA, T, grid)
    bare = st.Frame(frame.depth)
    np.testing.assert_array_equal(st.levelset.evidence(bare, CAMERA, T, grid, mask=frame.mask), own)
    np.testing.assert_array_equal(
        st.levelset.evidence(frame, CAMERA, T, grid, mask=np.zeros(frame.shape, bool)) > 0, False
    )
    no_wall = st.Frame(np.where(frame.mask, frame.depth, 0).astype(np.float32))
    np.testing.assert_array_equal(st.levelset.evidence(no_wall, CAMERA, T, grid) > 0, own > 0)
    assert (own > 0).any()
    triple = (grid.values.shape, grid.voxel_size, grid.origin)
    np.testing.assert_array_equal(st.levelset.evidence(frame, CAMERA, T, triple), own)


def test_colours_are_read_where_the_lens_puts_them():
    camera = st.Camera(300, 300, 79.5, 79.5, 160, 160, distortion=(1.2, 0, 0, 0, 0))
    depth = np.full((160, 160), 0.3, np.float32)
    v, u = np.mgrid[:160, :160].astype(np.uint8)
    rgb = np.ascontiguousarray(np.dstack([u, v, np.zeros_like(u)]))
    origin = np.array([-0.06, -0.06, 0.292])
    core = _core.Reconstruction([60, 60, 8], 0.002, origin.tolist(), None, _core.ReconstructionOptions(), 1)
    region = [0, 0, 160, 160]
    core.fuse(depth, camera._core, np.eye(4), region, np.ones((160, 160), np.uint8), None, rgb)
    z, y, x = np.nonzero(core.seen)
    points = origin + 0.002 * np.column_stack([x, y, z])
    expected = camera.project(points)
    found = core.rgb_seen[z, y, x, :2] / 256
    assert len(points) > 1000
    assert np.abs(expected - (300 * points[:, :2] / points[:, 2:] + 79.5)).max() > 4  # the lens matters
    assert np.abs(found - expected).max() < 2  # nearest pixels, before and after the lens


def test_the_far_side_of_a_first_guess_is_there_from_the_first_frame_on():
    n, voxel_m = 48, 0.001
    origin = np.array([-0.024, -0.024, 0.3])
    z = np.arange(n)[:, None, None]
    prior = np.where((z >= 16) & (z <= 27), np.float32(0.4), np.float32(-0.4)) * np.ones(
        (n, n, n), np.float32
    )
    core = reconstruction((n, n, n), voxel_m, origin, prior)
    camera = st.Camera(400, 400, 79.5, 79.5, 160, 160)
    depth = np.full((160, 160), 0.3155, np.float32)  # the near side
    fuse(core, camera, np.eye(4), depth, np.ones((160, 160), np.uint8))
    through = np.array(core.phi)[:, n // 2, n // 2] / voxel_m
    np.testing.assert_allclose(through[26:30], [-1.5, -0.5, 0.5, 1.5], atol=0.1)
    assert (core.surface_boxes[:, 2] >= 24).any()


def test_what_the_colour_camera_does_not_see_has_no_colour():
    camera = st.Camera(300, 300, 31.5, 31.5, 64, 64)
    depth = np.full((64, 64), 0.3, np.float32)
    grey, none = np.full((64, 64, 3), 200, np.uint8), np.zeros((64, 64, 3), np.uint8)
    origin = [-0.02, -0.02, 0.292]
    for shown in ((grey, none, none), (none, None, grey), (grey, grey)):
        core = _core.Reconstruction([20, 20, 8], 0.002, origin, None, _core.ReconstructionOptions(), 1)
        for rgb in shown:
            core.fuse(depth, camera._core, np.eye(4), [0, 0, 64, 64], np.ones((64, 64), np.uint8), None, rgb)
        colors = core.rgb_seen[np.array(core.seen) > 0]
        assert len(colors) > 500
        assert (colors[:, :3] == 200 * 256).all()
        with pytest.raises(ValueError, match="read-only"):
            core.rgb_seen[:] = 0
