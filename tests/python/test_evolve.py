# SPDX-License-Identifier: MIT
"""The evolution of a level set: its energy, its derivative, where the front ends, what remains of the distance."""

import numpy as np
import pytest
from levelset_scene import lattice, slope_error, zero_crossings

import sdftrack as st
from reference import levelset as reference
from sdftrack import _core

VOXEL_M, RADIUS = 0.002, 11.3  # the ball's, in voxels
STEP = 1e-5
DERIVATIVE_ATOL = 1e-7  # measured 1e-8; slopes are up to 3
# Ten steps in float, and a polynomial for the sine with an error of 2e-6.
TWIN_ATOL_VOXELS = 3e-5


def core_options(**given):
    o = _core.EvolveOptions()
    for name, value in given.items():
        setattr(o, name, value)
    return o


def rough(seed=0):
    """A field with slopes on both sides of 1 (voxels), and log ratios up to some +-10."""
    random = np.random.default_rng(seed)
    phi = random.normal(size=(5, 6, 7)) + 0.6 * np.arange(7) - 2
    return phi, 3 * random.normal(size=phi.shape)


def corner(n):
    """Of the volume, from the middle of the ball: off the middle of the volume, so that no two voxels mirror."""
    return np.array([0.13, -0.21, 0.08]) - 0.5 * (n - 1)


def ball(n=40, radius=RADIUS):
    """Signed distance (voxels) to a ball."""
    return np.linalg.norm(lattice((n,) * 3, 1.0, corner(n)), axis=-1) - radius


def ratio_of(phi, most=2.5):
    return -most * np.tanh(phi / 2)


def in_m(phi):
    return (VOXEL_M * phi).astype(np.float32)


@pytest.mark.parametrize("printed", [False, True])
def test_the_slope_is_the_derivative_of_the_energy_at_every_voxel(printed):
    phi, a = rough()
    derivative = np.zeros(phi.shape)
    for i in np.ndindex(phi.shape):
        e = np.zeros(phi.shape)
        e[i] = STEP
        up, down = (reference.energy(phi + s * e, a, 4, 3, printed) for s in (1, -1))
        derivative[i] = (up - down) / (2 * STEP)
    flow = reference.slope(phi, a, 4, 3, printed)
    np.testing.assert_allclose(flow, -derivative / reference.volumes(phi.shape), atol=DERIVATIVE_ATOL)
    assert np.abs(flow).max() > 0.3


@pytest.mark.parametrize("printed", [False, True])
def test_the_core_evolves_as_the_twin_does(printed):
    of_two = [np.ascontiguousarray(x[:2, :2, :2]) for x in rough()]  # with faces only
    for phi, a in (rough(), of_two, (ball(13, 4.2), 50 * ratio_of(ball(13, 4.2)))):
        out = _core.evolve(
            in_m(phi), a.astype(np.float32), VOXEL_M, 10, core_options(printed=printed, dt=0.7, sigma_h=3)
        )
        expected = reference.evolve(phi, a, 10, sigma_h=3, dt=0.7, printed=printed)
        assert np.abs(expected - phi).max() > 0.3
        np.testing.assert_allclose(out / VOXEL_M, expected, atol=TWIN_ATOL_VOXELS)


@pytest.mark.parametrize("printed", [False, True])
def test_the_energy_never_grows_up_to_the_longest_step(printed):
    o = core_options(printed=printed)
    o.dt = o.longest_step
    phi, a = rough()
    phi, a = in_m(phi), a.astype(np.float32)
    costs = [reference.energy(phi / VOXEL_M, a, 4, 3, printed)]
    for _ in range(30):
        phi = _core.evolve(phi, a, VOXEL_M, 1, o)
        costs.append(reference.energy(phi / VOXEL_M, a, 4, 3, printed))
    assert (np.diff(costs) < 1e-5).all()
    assert costs[-1] < 0.7 * costs[0]


@pytest.mark.slow
@pytest.mark.parametrize("regulariser", ["double_well", "printed"])
@pytest.mark.parametrize("start", [-1.5, 2.0])
def test_the_front_ends_on_the_ball_that_the_evidence_tells_of(regulariser, start):
    truth = ball()
    ratio = ratio_of(truth).astype(np.float32)
    phi = in_m(truth + start)
    out = st.levelset.evolve(phi, ratio, 100, VOXEL_M, regulariser=regulariser, redistance_every=5)
    radius = np.linalg.norm(zero_crossings(out / VOXEL_M, 1.0, corner(len(out))), axis=1).mean()
    assert abs(radius - RADIUS) < 0.1


@pytest.mark.parametrize("regulariser", ["double_well", "printed"])
def test_the_band_stays_a_distance_field(regulariser):
    truth = ball()
    out = st.levelset.evolve(
        in_m(truth + 1), ratio_of(truth).astype(np.float32), 50, VOXEL_M, regulariser=regulariser
    )
    assert slope_error(out, VOXEL_M) < 0.05


def test_without_evidence_both_regularisers_bring_a_steep_field_back():
    for printed in (False, True):
        phi, none = in_m(1.3 * ball()), np.zeros((40, 40, 40), np.float32)
        before = slope_error(phi, VOXEL_M)
        after = slope_error(_core.evolve(phi, none, VOXEL_M, 100, core_options(printed=printed)), VOXEL_M)
        assert before > 0.29
        assert after < 0.8 * before


def test_the_shape_that_the_evidence_denies_vanishes():
    phi = in_m(ball(16, 2.0))
    out = st.levelset.evolve(phi, np.full(phi.shape, -3, np.float32), 60, VOXEL_M)
    assert (out > 0).all()


def test_the_defaults_are_the_cores():
    o, given = _core.EvolveOptions(), st.levelset.evolve.__kwdefaults__
    assert (o.sigma_h, o.sigma_phi, o.dt) == (given["sigma_h"], given["sigma_phi"], given["dt"])
    assert o.printed == (given["regulariser"] == "printed")
