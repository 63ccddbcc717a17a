# SPDX-License-Identifier: MIT
"""The ball in depth and in colour: the fits against truth, what stands in the way."""

import numpy as np
import pytest
from ball_scenes import COLOR, DEPTH, RADIUS_M, recorded

import sdftrack as st
from sdftrack import _core

EXACT_FIT_M = 2e-5  # float32 depth of 1e-7 relative, and the noise floor's weighting
MIN_FOUND = 0.9  # far away it has 9 pixels of radius in these small images
SPREADS = 4.5  # standard deviations: of a few hundred numbers none is further
CENTER_PX = 0.1  # the target
FINDER = _core.BallFinder(DEPTH._core, RADIUS_M)


def test_the_fit_in_exact_depth_finds_the_centre():
    scene, frames = recorded(8, noise=None, seed=3)
    for frame, center in zip(frames, scene.centers_cam, strict=True):
        ball = FINDER.fit(frame.depth, center + np.array([0.015, -0.01, 0.02]))
        assert np.abs(ball.center_cam - center).max() < EXACT_FIT_M


@pytest.mark.parametrize("every", [3, 4, 5])
def test_what_was_filled_in_a_lattice_of_holes_moves_no_ball(every):
    scene, frames = recorded(8, noise=None, seed=3)
    found = 0
    for frame, center in zip(frames, scene.centers_cam, strict=True):
        depth = frame.depth.copy()
        depth[::every] = depth[:, ::every] = 0
        holed = st.Frame(depth)
        as_given, as_filled = (
            min(np.abs(ball.center_cam - center).max() for ball in FINDER.search(holed.depth, given))
            for given in (holed._given, None)
        )
        if as_filled < RADIUS_M:  # a small ball may be missed by the search, which tests every fourth pixel
            found += 1
            assert as_given < EXACT_FIT_M < as_filled
    assert found >= 6


@pytest.mark.parametrize("noise", [0.001, "kinect"])
def test_the_ball_is_found_in_noisy_depth_within_its_stated_spread(noise):
    scene, frames = recorded(noise=noise, seed=0)
    off = []
    for frame, center in zip(frames, scene.centers_cam, strict=True):
        for ball in FINDER.search(frame.depth):
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
    ball = FINDER.fit(depth, center + np.array([0.0, 0.005, 0.005]))
    assert ball is None or np.all(
        np.abs(ball.center_cam - center) < SPREADS * np.sqrt(np.diag(ball.covariance))
    )
    depth = frames[4].depth.copy()
    depth[: int(v)] = 0
    ball = FINDER.fit(depth, center + np.array([0.0, 0.005, 0.005]))
    assert np.all(np.abs(ball.center_cam - center) < SPREADS * np.sqrt(np.diag(ball.covariance)))


def test_walls_and_balls_of_another_size_are_no_balls():
    wall = np.full(DEPTH.shape, 1.2, np.float32)
    assert FINDER.search(wall) == []
    assert FINDER.search(np.zeros(DEPTH.shape, np.float32)) == []
    scene, frames = recorded(noise=0.001, seed=0)
    for factor in (0.5, 2.2):  # what rods before the wall may look like is another matter
        for ball in _core.BallFinder(DEPTH._core, factor * RADIUS_M).search(frames[4].depth):
            assert np.linalg.norm(ball.center_cam - scene.centers_cam[4]) > 3 * RADIUS_M


def center_of(image, color, camera=COLOR):
    """Image of the centre of the best outline of this colour."""
    (best, *_) = _core.find_outlines(image, _core.BallColor(color).mask(image), camera._core)
    return best.center(camera._core)[0]


@pytest.mark.parametrize(
    "setting", [{}, {"exposure_s": 0.01}, {"hand": False, "clutter": False, "gloss": 0.6}]
)
def test_the_centre_in_colour_is_right_to_a_tenth_of_a_pixel(setting):
    scene, frames = recorded(8, noise=0.001, seed=0, **setting)
    seen = zip(frames, scene.color_px, strict=True)
    off = [center_of(frame.color, scene.color) - px for frame, px in seen]
    assert np.linalg.norm(np.mean(off, axis=0)) < CENTER_PX / 2
    assert np.sqrt(np.mean(np.sum(np.square(off), axis=1))) < CENTER_PX


def test_fingers_over_a_third_of_the_outline_are_left_out():
    scene, frames = recorded(8, noise=0.001, seed=0)
    i = int(np.argmin(scene.centers_cam[:, 2]))
    image = frames[i].color.copy()
    u, v = scene.color_px[i]
    image[:, : int(u - 6)] = (205, 155, 130)
    assert np.linalg.norm(center_of(image, scene.color) - (u, v)) < 2 * CENTER_PX


def test_the_colour_that_moves_is_the_balls():
    scene, frames = recorded(noise=0.001, seed=0)
    color = _core.moving_color([f.color for f in frames[::3]]).color
    unit, ball = color / np.linalg.norm(color), np.array(scene.color) / np.linalg.norm(scene.color)
    assert unit @ ball > 0.98
    with pytest.raises(ValueError, match="found none"):
        _core.moving_color([frames[0].color] * 5)
