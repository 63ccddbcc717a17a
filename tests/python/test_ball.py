# SPDX-License-Identifier: MIT
"""The ball in depth and in colour: exact geometry, the fits against truth, what stands in the way."""

import numpy as np
import pytest
from ball_scenes import COLOR, DEPTH, RADIUS_M, recorded

import sdftrack as st
from sdftrack.calibration.ball_color import BallColor, moving_color
from sdftrack.calibration.ball_in_color import edges_along, find_outlines
from sdftrack.calibration.ball_in_depth import fit_ball, ray_hits, search_balls
from sdftrack.calibration.cone import fit_cone, outline_of_sphere

EXACT_PX = 1e-6  # rounding of double arithmetic through a linear solve
LENS = (0.12, -0.25, 0.001, -0.0005, 0.1)
LENS_PX = 1e-5  # the lens is inverted by iteration
DIFFERENCE = 1e-6  # m, step of numerical derivatives
DERIVATIVE = 1e-5  # of central differences at that step
EXACT_FIT_M = 2e-5  # float32 depth of 1e-7 relative, and the noise floor's weighting
MIN_FOUND = 0.9  # far away it has 9 pixels of radius in these small images
SPREADS = 4.5  # standard deviations: of a few hundred numbers none is further
EDGE_PX = 0.03  # of a box-filtered edge, sampled with linear interpolation, 8-bit
CENTER_PX = 0.1  # the target
OFF_CENTRE = st.Camera(525.0, 530.0, 300.0, 250.0, 640, 480)


@pytest.mark.parametrize("lens", [(), LENS])
def test_the_axis_of_the_tangent_cone_is_the_image_of_the_centre(lens):
    camera = st.Camera(525.0, 530.0, 300.0, 250.0, 640, 480, lens)
    for center in ([0.3, -0.2, 0.7], [0.0, 0.0, 1.0], [-0.4, 0.25, 0.8]):
        cone = fit_cone(outline_of_sphere(camera, center, 0.04), camera)
        assert np.abs(cone.center_px - camera.project(center)).max() < (LENS_PX if lens else EXACT_PX)
        assert cone.half_angle_rad == pytest.approx(np.arcsin(0.04 / np.linalg.norm(center)), abs=1e-7)


def test_the_stated_spread_of_a_centre_is_the_one_found():
    center, rng, offs = [0.2, 0.1, 0.8], np.random.default_rng(1), []
    outline = outline_of_sphere(OFF_CENTRE, center, 0.04, 160)  # one edge a pixel
    for _ in range(300):
        cone = fit_cone(outline + 0.1 * rng.normal(size=outline.shape), OFF_CENTRE)
        off = cone.center_px - OFF_CENTRE.project(center)
        offs.append(off @ np.linalg.solve(cone.covariance_px, off))
    assert 1.6 < np.mean(offs) < 2.6  # chi-square of two: 2; 300 runs and the robust scale leave 15 %


def test_the_depth_of_a_hit_changes_with_the_centre_as_differences_say():
    rng = np.random.default_rng(2)
    center = np.array([0.05, -0.03, 0.8])
    rays = center[:2] / center[2] + 0.03 * rng.uniform(-1, 1, (40, 2))
    z, dz = ray_hits(rays, center, 0.04)
    assert np.isfinite(z).all()
    for k, e in enumerate(np.eye(3)):
        ahead, behind = (ray_hits(rays, center + s * DIFFERENCE * e, 0.04)[0] for s in (1, -1))
        numeric = (ahead - behind) / (2 * DIFFERENCE)
        assert np.abs(dz[:, k] - numeric).max() < DERIVATIVE


def test_the_fit_in_exact_depth_finds_the_centre():
    scene, frames = recorded(8, noise=None, seed=3)
    for frame, center in zip(frames, scene.centers_cam, strict=True):
        ball = fit_ball(frame.depth, DEPTH, RADIUS_M, center + np.array([0.015, -0.01, 0.02]))
        assert np.abs(ball.center_cam - center).max() < EXACT_FIT_M


@pytest.mark.parametrize("noise", [0.001, "kinect"])
def test_the_ball_is_found_in_noisy_depth_within_its_stated_spread(noise):
    scene, frames = recorded(noise=noise, seed=0)
    off = []
    for frame, center in zip(frames, scene.centers_cam, strict=True):
        for ball in search_balls(frame.depth, DEPTH, RADIUS_M):
            if np.linalg.norm(ball.center_cam - center) < RADIUS_M:
                off.append((ball.center_cam - center) / np.sqrt(np.diag(ball.covariance)))
    assert len(off) >= MIN_FOUND * len(frames)
    assert np.abs(off).max() < SPREADS
    assert 0.7 < np.std(off) < 1.5  # neighbouring readings of the Kinect share their noise


def test_a_hand_over_half_of_the_ball_moves_it_no_further_than_stated():
    scene, frames = recorded(noise=0.001, seed=0)
    center = scene.centers_cam[4]
    u, v = DEPTH.project(center)
    depth = frames[4].depth.copy()
    depth[:, : int(u)] = np.where(depth[:, : int(u)] > 0, center[2] - 0.15, 0)
    ball = fit_ball(depth, DEPTH, RADIUS_M, center + np.array([0.0, 0.005, 0.005]))
    assert ball is None or np.all(
        np.abs(ball.center_cam - center) < SPREADS * np.sqrt(np.diag(ball.covariance))
    )
    depth = frames[4].depth.copy()
    depth[: int(v)] = 0
    ball = fit_ball(depth, DEPTH, RADIUS_M, center + np.array([0.0, 0.005, 0.005]))
    assert np.all(np.abs(ball.center_cam - center) < SPREADS * np.sqrt(np.diag(ball.covariance)))


def test_walls_and_balls_of_another_size_are_no_balls():
    wall = np.full(DEPTH.shape, 1.2, np.float32)
    assert search_balls(wall, DEPTH, RADIUS_M) == []
    assert search_balls(np.zeros(DEPTH.shape, np.float32), DEPTH, RADIUS_M) == []
    scene, frames = recorded(noise=0.001, seed=0)
    for factor in (0.5, 2.2):  # what rods before the wall may look like is another matter
        for ball in search_balls(frames[4].depth, DEPTH, factor * RADIUS_M):
            assert np.linalg.norm(ball.center_cam - scene.centers_cam[4]) > 3 * RADIUS_M


@pytest.mark.parametrize("shade", [0.0, 0.5])
def test_an_edge_is_found_to_a_few_hundredths_whatever_the_balls_shade(shade):
    fine, h, w, at = 20, 40, 60, 30.37
    u = (np.arange(w * fine) + 0.5) / fine - 0.5
    inside = (
        (u < at)[:, None] * np.array([210.0, 50, 30]) * (1 - shade * np.clip((u - 15) / 20, 0, 1))[:, None]
    )
    row = np.where((u < at)[:, None], inside, np.array([140.0, 145, 150])).reshape(w, fine, 3).mean(axis=1)
    image = np.repeat(np.rint(row)[None], h, axis=0).astype(np.float32)
    start = np.column_stack([np.full(20, 30.0), np.linspace(10, 30, 20)])
    found = edges_along(image, start, np.tile([1.0, 0.0], (20, 1)), np.full(20, 3.0))
    assert found.sure.all()
    assert np.abs(found.at[:, 0] - at).max() < EDGE_PX


@pytest.mark.parametrize(
    "setting", [{}, {"exposure_s": 0.01}, {"hand": False, "clutter": False, "gloss": 0.6}]
)
def test_the_centre_in_colour_is_right_to_a_tenth_of_a_pixel(setting):
    scene, frames = recorded(8, noise=0.001, seed=0, **setting)
    model = BallColor(np.array(scene.color, float))
    off = []
    for frame, px in zip(frames, scene.color_px, strict=True):
        outline = find_outlines(frame.color, model.likeness(frame.color), COLOR)[0]
        off.append(outline.cone(COLOR).center_px - px)
    assert np.linalg.norm(np.mean(off, axis=0)) < CENTER_PX / 2
    assert np.sqrt(np.mean(np.sum(np.square(off), axis=1))) < CENTER_PX


def test_fingers_over_a_third_of_the_outline_are_left_out():
    scene, frames = recorded(8, noise=0.001, seed=0)
    i = int(np.argmin(scene.centers_cam[:, 2]))
    image = frames[i].color.copy()
    u, v = scene.color_px[i]
    image[:, : int(u - 6)] = (205, 155, 130)
    model = BallColor(np.array(scene.color, float))
    outline = find_outlines(image, model.likeness(image), COLOR)[0]
    assert np.linalg.norm(outline.cone(COLOR).center_px - (u, v)) < 2 * CENTER_PX


def test_the_colour_that_moves_is_the_balls():
    scene, frames = recorded(noise=0.001, seed=0)
    color = moving_color([f.color for f in frames[::3]])
    unit, ball = color / np.linalg.norm(color), np.array(scene.color) / np.linalg.norm(scene.color)
    assert unit @ ball > 0.98
    with pytest.raises(ValueError, match="found none"):
        moving_color([frames[0].color] * 5)
