# SPDX-License-Identifier: MIT
"""Cramer-Rao bounds of primitives: slopes of exact depth against the field's, and what a bound must do."""

import numpy as np
import pytest

import sdftrack as st
from experiments.primitives.limits import _depth_slopes, bound
from experiments.synth.solids import standing_scene
from sdftrack import _core
from sdftrack.synth.noise import Gaussian, Kinect

CAMERA = st.Camera(262, 262, 159.5, 119.5, 320, 240)
SIZES = {"cone": {"radius": 0.06, "height": 0.13}, "ellipsoid": {"rx": 0.05, "ry": 0.08, "rz": 0.035}}
TABLE_SD_M = 1e-5
SLOPE_RTOL = 1e-3  # central differences over 10 micrometres; the least cosine looked at is 0.2


@pytest.fixture(params=list(SIZES))
def scene(request):
    return standing_scene(request.param, SIZES[request.param], CAMERA, np.random.default_rng(2), (0.7, 0.8))


def test_the_slopes_of_the_rendered_depth_are_those_of_the_field(scene):
    rays = CAMERA.back_project(np.ones(CAMERA.shape, np.float32)).astype(float)[scene.mask]
    found = _depth_slopes(scene, rays)
    T = np.linalg.inv(scene.T_cam_obj)
    p = (scene.depth[scene.mask].astype(float)[:, None] * rays) @ T[:3, :3].T + T[:3, 3]
    kind, size = _core.PrimitiveKind.__members__[scene.kind], np.array(list(scene.size.values()))
    _, grad, by_size = _core.primitive_distances(kind, size.tolist(), np.ascontiguousarray(p))
    row = np.column_stack([grad, np.cross(p, grad), by_size * size])
    along = np.einsum("ni,ni->n", grad @ T[:3, :3], rays)
    smooth = np.isfinite(found).all(axis=1) & (along < -0.2)
    wanted = -row / along[:, None]
    off = np.abs(found - wanted)[smooth].max(axis=1) / np.abs(wanted[smooth]).max()
    assert smooth.sum() > 500
    # A pixel at the base's rim or the tip may have another face nearest.
    assert np.quantile(off, 0.98) < SLOPE_RTOL


def test_a_bound_grows_with_the_noise_and_falls_with_what_is_known_besides(scene):
    one, two = (bound(scene, Gaussian(s), CAMERA, TABLE_SD_M, edges=False) for s in (1e-5, 2e-5))
    turn = slice(0, 3)  # the prior has no say in where it is
    np.testing.assert_allclose(np.diag(two)[turn], 4 * np.diag(one)[turn], rtol=0.02)
    alone, both = (bound(scene, Gaussian(1e-3), CAMERA, TABLE_SD_M, edges) for edges in (False, True))
    assert (np.diag(both) <= np.diag(alone) * (1 + 1e-9)).all()
    assert (np.diag(bound(scene, Kinect(), CAMERA, TABLE_SD_M)) > np.diag(both)).all()


def test_errors_of_a_fit_are_within_some_deviations_of_the_bound(scene):
    """A fit that were better than the bound, or far worse, would show that one of both is wrong."""
    rng = np.random.default_rng(0)
    sd = np.sqrt(np.diag(bound(scene, Gaussian(1e-3), CAMERA, TABLE_SD_M))[6:])
    frame = st.Frame(Gaussian(1e-3)(scene.depth, scene.cosine, rng))
    fit = st.fit_primitive(frame, scene.kind, camera=CAMERA)
    found = np.array(list(fit.size.values()))
    true = np.array(list(scene.size.values()))
    if scene.kind == "ellipsoid":
        found, sd, true = np.sort(found), sd[np.argsort(true)], np.sort(true)
    off = np.abs(np.log(found / true)) / sd
    assert off.max() < 8  # of a Gaussian; edges are no Gaussian measurements


@pytest.mark.parametrize("seed", range(6))
def test_an_ellipsoid_that_grows_without_end_is_lost(seed):
    rng = np.random.default_rng(seed)
    sheet = np.c_[rng.uniform(-0.1, 0.1, (600, 2)), rng.normal(0.8, 0.002, 600)]
    fit = st.fit_primitive(sheet, "ellipsoid")
    assert not np.isnan(fit.covariance).any()
    if max(fit.size.values()) < 100:
        assert np.isinf(fit.covariance).any()  # a sheet bounds no ellipsoid
    else:
        assert fit.status == st.Status.LOST
        assert "diverged" in fit.reason
        assert np.isinf(np.diag(fit.covariance)).all()
