# SPDX-License-Identifier: MIT
"""Whether the tracker knows what it does not know: correlated errors, a wrong shape, a wrong place."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack import _core
from sdftrack.reference import energies as twin
from sdftrack.reference import tracking as twin_tracking

AREA_RTOL = 1e-3  # float sums of some thousand terms of both signs
# The factor's sd at 70 x 70 white pixels is about 1 / sqrt(24 windows, overlapping by half), 0.15; three of them.
WHITE_ATOL = 0.45
SCALE_M, FLOOR = 0.002, 0.1


def block_noise(side, size=70, seed=0):
    """(pixels of a disc, noise of 1 sigma that squares of side x side pixels share)."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[:size, :size]
    disc = (u - size / 2) ** 2 + (v - size / 2) ** 2 < (size / 2) ** 2
    blocks = -(-size // side)
    noise = np.kron(rng.standard_normal((blocks, blocks)), np.ones((side, side)))[:size, :size]
    return u[disc].astype(np.float32), v[disc].astype(np.float32), noise[disc].astype(np.float32)


@pytest.mark.parametrize("side", [1, 3])
def test_the_correlation_area_is_that_of_the_twin(side):
    u, v, noise = block_noise(side)
    residual = np.float32(SCALE_M) * noise
    pull = np.array([twin.DepthLogistic(SCALE_M, FLOOR)(float(r)).slope for r in residual])
    area = _core.correlation_area(u, v, residual, SCALE_M, FLOOR)
    assert area == pytest.approx(twin_tracking.correlation_area(u, v, pull), rel=AREA_RTOL)


@pytest.mark.parametrize("side", [1, 2, 4])
def test_the_correlation_area_is_the_size_of_the_blocks_that_share_an_error(side):
    areas = []
    for seed in range(20):
        u, v, noise = block_noise(side, seed=seed)
        areas.append(_core.correlation_area(u, v, SCALE_M * noise, SCALE_M, FLOOR))
    # Half-overlapping windows of 10 pixels see of a block of 4 what does not cross their border: 0.8 of it.
    assert 0.7 * side**2 < np.mean(areas) < side**2 + WHITE_ATOL
    assert areas[0] == pytest.approx(side**2, rel=3 * WHITE_ATOL / np.sqrt(2))


def test_too_few_pixels_say_nothing_about_correlation():
    u, v, noise = block_noise(1, size=9)
    assert _core.correlation_area(u, v, SCALE_M * noise, SCALE_M, FLOOR) == 0


def test_the_interpolation_error_is_known_where_the_field_is():
    # phi = |p| has the Laplacian 2 / |p|.
    ball = st.SDF.sphere(0.05, voxels=60)
    field = twin.SingleObject(ball.values, ball.voxel_size, ball.origin, np.eye(4))
    rng = np.random.default_rng(0)
    p = rng.normal(size=(200, 3))
    p *= 0.05 / np.linalg.norm(p, axis=1)[:, None]
    expected = ball.voxel_size**2 / 12 * 2 / 0.05
    found = [twin_tracking.interpolation_error(field, x, ball.voxel_size) for x in p]
    surplus = [field.row(x).phi for x in p]  # of the interpolant at the true surface
    assert np.mean(found) == pytest.approx(expected, rel=0.05)
    assert np.mean(surplus) == pytest.approx(expected, rel=0.1)
