# SPDX-License-Identifier: MIT
"""The contour tracker against its numpy twin, against discs whose motion is known, and its derivatives."""

import numpy as np
import pytest

from reference import contour as twin
from sdftrack import _core

# Posteriors are ratios of float sums over a few thousand pixels.
POSTERIOR_ATOL = 2e-5
# Five steps in float against double; without tension nothing smooths along the outline, and roundings grow threefold
# with each step.
STEPS_ATOL = 1e-3
Options = _core.ContourOptions
IDENTITY = [1.0, 0.0, 0.0, 1.0, 40.0, 30.0]


def disc_phi(nx=61, ny=51, radius=14.0, middle=(30.0, 25.0)):
    y, x = np.mgrid[:ny, :nx]
    return (np.hypot(x - middle[0], y - middle[1]) - radius).astype(np.float32)


def parts(warp):
    return np.reshape(warp[:4], (2, 2)), np.array(warp[4:])


def test_the_regulariser_is_the_slope_of_the_distance_energy():
    # The printed one: minus the derivative of sum (|grad phi| - 1)^2 / 2, on a smooth phi = r^2 / 20, in closed form:
    # div((1 - 1 / |grad phi|) grad phi) = phi_rr + phi_r / r - 1 / r = 1 / 10 + 1 / 10 - 1 / r.
    y, x = np.mgrid[:61, :61] - 30.0
    r = np.hypot(x, y)
    phi = (r**2 / 20 - 5).astype(np.float32)
    half = np.full(phi.shape, 0.5, np.float32)  # says nothing
    stepped = _core.contour_steps(phi, half, 1, Options(mu=0.1, dt=1.0, tension=0.0, band=30.0))
    ring = (r > 8) & (r < 20)
    np.testing.assert_allclose((stepped - phi)[ring], 0.1 * (0.2 - 1 / r[ring]), atol=2e-4)


@pytest.mark.parametrize("tension", [0.0, 1.0])
def test_five_shape_steps_are_those_of_the_twin(tension):
    rng = np.random.default_rng(4)
    foreground = rng.uniform(0.02, 0.98, (51, 61)).astype(np.float32)
    phi = disc_phi()
    got = _core.contour_steps(phi, foreground, 5, Options(tension=tension))
    want = twin.shape_step(phi.astype(float), foreground, tension=tension, steps=5)
    np.testing.assert_allclose(got, want, atol=STEPS_ATOL)


@pytest.mark.parametrize("options", [{}, {"bins": 32}, {"windows": 1}, {"shrink": 500.0}])
def test_the_posteriors_are_those_of_the_twin(options):
    rng = np.random.default_rng(6)
    image = rng.integers(0, 256, (60, 80, 3), dtype=np.uint8) // 32 * 32
    image[20:40, 30:50, 0] = 200
    phi = disc_phi()
    got = _core.contour_posterior(image, image, phi, IDENTITY, Options(**options))
    want = twin.posterior(image, image, phi, *parts(IDENTITY), **options)
    np.testing.assert_allclose(got, want, atol=POSTERIOR_ATOL)


@pytest.mark.parametrize("pool", ["linear", "log"])
@pytest.mark.parametrize("rates", [(0.02, 0.2), (0.5, 0.05), (1.0, 1.0), (0.0, 0.0)])
def test_the_opinion_pools_are_those_of_the_twin(pool, rates):
    rng = np.random.default_rng(7)
    first, *more = rng.integers(0, 256, (4, 60, 80, 3), dtype=np.uint8) // 64 * 64
    for k, image in enumerate((first, *more)):
        image[20:40, 30:50, 0] = 200 - 60 * k  # colours that come and colours that go
    options = {"pool": pool, "object_rate": rates[0], "background_rate": rates[1]}
    phi = disc_phi()
    got = _core.contour_posterior(first, more[-1], phi, IDENTITY, Options(**options), more)
    want = twin.posterior(first, more[-1], phi, *parts(IDENTITY), pooled=more, **options)
    np.testing.assert_allclose(got, want, atol=POSTERIOR_ATOL)
    if rates[0] > 0:  # at a rate of 0 the new colours are known, and that is all
        alone = _core.contour_posterior(first, more[-1], phi, IDENTITY, Options(**options))
        assert np.abs(got - alone).max() > 0.05
