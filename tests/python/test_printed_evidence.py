# SPDX-License-Identifier: MIT
"""The source's likelihood of a voxel (thesis Eqs. 4.28 to 4.31) and first guess (4.34), by formula and in the core."""

import numpy as np
import pytest
from levelset_scene import CAMERA, K, ball_depth, fuse, lattice, looking_from, reconstruction

import sdftrack as st
from reference import levelset as reference
from sdftrack.reconstruction.initialization import printed_prior

SHAPE, VOXEL_M, ORIGIN = (19, 17, 21), 0.004, (-0.041, -0.033, -0.039)
SLANTED = st.Camera(500.0, 500.0, 160.0, 120.0, 321, 241)
# Ranges of 0.3 m are rounded by 3e-8 m, and the log ratio's slope is 2 / |d|: a voxel 4 micrometres from a reading, of
# some thousand in three frames, is off by 0.02.
RATIO_ATOL, RATIO_RTOL = 2e-3, 5e-3


def slanted_plane():
    """Depth (m) of a plane that leans by 45 degrees, half a metre away on the middle pixel's ray."""
    u = np.arange(SLANTED.width)
    row = 0.5 / (1 - (u - SLANTED.cx) / SLANTED.fx)  # z = 0.5 + x
    return np.broadcast_to(row, (SLANTED.height, SLANTED.width)).astype(np.float32)


def said_at(point_m, depth, sigma_d_m, mask=None):
    """What the core says of one point of the camera's frame."""
    grid = ((2, 2, 2), 1e-3, point_m)
    ratio = st.levelset.evidence(
        st.Frame(depth), SLANTED, np.eye(4), grid, form="printed", sigma_d_m=sigma_d_m, mask=mask
    )
    return float(ratio[0, 0, 0])


def test_two_millimetres_behind_a_slanted_plane_the_printed_formula_gives_2_085():
    # d = 2 mm along the ray, sigma_d = 8 mm: q = e^(-1/4), log(L_in / L_out) = log((1 + q) / (1 - q)).
    q = np.exp(-0.25)
    assert np.log((1 + q) / (1 - q)) == pytest.approx(2.085, abs=5e-4)
    at = (0.0, 0.0, 0.502)
    assert said_at(at, slanted_plane(), 0.008) == pytest.approx(2.085, abs=5e-4)


def test_only_the_objects_readings_speak_and_all_of_them_do():
    depth = slanted_plane()
    mask = np.zeros(depth.shape, np.uint8)
    mask[120, 160] = 1  # a single pixel, all of it border
    assert said_at((0.0, 0.0, 0.502), depth, 0.008, mask) == pytest.approx(2.0846, abs=5e-4)
    mask[:] = 1
    mask[120, 160] = 0  # what is not the object's carves nothing
    assert said_at((0.0, 0.0, 0.3), depth, 0.008, mask) == 0
    assert said_at((0.0, 0.0, 0.502), depth, 0.008, mask) == 0


def test_the_core_says_what_the_twin_says_and_the_guess_stays_a_factor():
    o = reference.Options(printed=True, sigma_d_m=0.006)
    prior = np.random.default_rng(0).normal(size=SHAPE).astype(np.float32)
    core = reconstruction(SHAPE, VOXEL_M, ORIGIN, prior, printed=True, sigma_d_m=0.006)
    ratio, weight = prior.astype(np.float64), np.zeros(SHAPE)
    for k, direction in enumerate(([0.2, -0.3, 1], [1, 0.1, 0.2], [-0.5, 1, 0.1])):
        T = looking_from(direction, 0.3, 0.3 * k)
        depth, mask = ball_depth(CAMERA, T)
        fuse(core, CAMERA, T, depth, mask)
        p_cam = lattice(SHAPE, VOXEL_M, ORIGIN) @ T[:3, :3].T + T[:3, 3]
        said = reference.evidence(p_cam, depth, mask, K, o)
        ratio, weight = reference.fuse(ratio, weight, said, o.max_weight, printed=True)
    np.testing.assert_array_equal(core.weight, weight)
    assert 0.1 < (weight == 0).mean() < 0.9
    np.testing.assert_allclose(core.log_ratio, ratio, rtol=RATIO_RTOL, atol=RATIO_ATOL)


def test_the_first_guess_is_the_printed_one():
    phi = np.linspace(-40, 40, 81)
    G = reference.first_guess(phi)
    np.testing.assert_allclose([G[0], G[40], G[-1]], [0.75, 0.5, 0.25], atol=3e-5)  # a = 0.5
    np.testing.assert_allclose(
        printed_prior(0.002 * phi.astype(np.float32), 0.002), np.log(G / (1 - G)), atol=1e-6
    )
