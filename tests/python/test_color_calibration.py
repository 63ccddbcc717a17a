# SPDX-License-Identifier: MIT
"""Depth-to-colour registration: a delay, whole recordings, what cannot be registered."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from ball_scenes import COLOR, DEPTH, RADIUS_M, recorded

import sdftrack as st
from experiments.synth.ball import ball_path, ball_scene
from sdftrack.calibration.as_printed import fit_as_printed, hough_circle
from sdftrack.calibration.color_result import BallPairs, ColorMapping
from sdftrack.calibration.color_to_depth import check_spread

T_TRUE = st.geometry.pose((0.02, -0.03, 0.01), (-0.025, 0.002, -0.004))
HELD_OUT_PX = 0.3  # the target, on images four times as large
TIME_S = 0.003  # the target
CIRCLE_PX = 3.0  # Hough votes for whole pixels, and for the middle of an ellipse


def simulated(n=40, noise_px=0.0, seed=0, late_s=0.0):
    """Pairs on the ball's usual path."""
    rng = np.random.default_rng(seed)
    at = ball_path(seed)
    t = np.arange(n) / 15
    true = ColorMapping(DEPTH, M=COLOR.K @ T_TRUE[:3])
    px = true.predict(at(t + late_s))[0] + noise_px * rng.normal(size=(n, 2))
    spread = np.tile(max(noise_px, 0.01) ** 2 * np.eye(2), (n, 1, 1))
    C = np.tile(1e-12 * np.eye(3), (n, 1, 1))
    nan = np.full((n, 2), np.nan)
    return BallPairs(np.arange(n), at(t), C, px, spread, np.full(n, 20.0), t, nan, np.ones(n, bool))


def test_a_thing_that_does_not_shrink_with_the_distance_is_not_the_ball():
    pairs = simulated(12)
    right = replace(pairs, radius_px=20.0 / pairs.center_cam[:, 2])
    check_spread(right, 4, "frames")
    with pytest.raises(ValueError, match=r"not the ball found in colour.*check ball_radius"):
        check_spread(replace(right, radius_px=right.radius_px[::-1] * np.linspace(0.5, 2, 12)), 4, "frames")


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "known"), [(0.001, False), ("kinect", True)])
def test_a_recording_registers_the_cameras(noise, known):
    scene, frames = recorded(noise=noise, seed=0)
    shares = []
    result = st.calibrate_color_to_depth(
        frames, DEPTH, RADIUS_M, None if known else scene.color,
        color_camera=COLOR if known else None, progress=shares.append, threads=1 + known,
    )  # fmt: skip
    p = scene.random_points(1000)
    off = np.linalg.norm(result.project(p) - scene.camera.project_to_color(p), axis=1)
    assert np.sqrt(np.mean(off**2)) < HELD_OUT_PX
    assert np.mean(off < 3 * np.linalg.norm(result.sd_px(p), axis=1)) > 0.9
    assert result.rms_px < HELD_OUT_PX
    assert np.count_nonzero(result.pairs.kept) >= 21
    assert result.camera.aligned is False
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert (result.T_covariance is not None) == known
    assert result.covariance.shape == (12, 12)
    assert np.all(np.linalg.eigvalsh(result.covariance) > -1e-9 * np.trace(result.covariance))
    if known:
        sd = np.sqrt(np.diag(result.T_covariance))
        wanted = scene.camera.T_color_depth
        assert np.all(np.abs(st.geometry.log(result.T_color_depth @ st.geometry.inverse(wanted))) < 5 * sd)


def test_printed_the_2_norm_of_exact_pairs_gives_the_exact_map_and_a_wrong_pair_is_never_dropped():
    pairs, size = simulated(40), (COLOR.width, COLOR.height)
    fit = fit_as_printed(pairs, DEPTH, size)
    p = ball_path(7)(np.linspace(0, 5, 50))
    np.testing.assert_allclose(
        fit.map.predict(p)[0], ColorMapping(DEPTH, M=COLOR.K @ T_TRUE[:3]).predict(p)[0], atol=1e-5
    )
    off = pairs.color_px.copy()
    off[3] += 20
    spoilt = fit_as_printed(replace(pairs, color_px=off), DEPTH, size)
    assert spoilt.kept.all()
    assert np.linalg.norm(spoilt.residual_px) < np.hypot(20, 20)  # of the truth: the least squares are lower
    step = np.random.default_rng(0).normal(size=(3, 4)) * 1e-3 * np.abs(spoilt.map.M)
    for sign in (-1, 1):
        moved = ColorMapping(DEPTH, M=spoilt.map.M + sign * step).predict(pairs.center_cam)[0]
        assert np.linalg.norm(off - moved) > np.linalg.norm(spoilt.residual_px)


def test_printed_a_hough_circle_finds_the_centre_of_a_disc_to_half_a_pixel():
    y, x = np.mgrid[:240, :320]
    for at in ((160.3, 121.7), (40.0, 60.5)):
        mask = np.hypot(x - at[0], y - at[1]) < 21
        found = hough_circle(mask.astype(np.uint8))
        assert np.hypot(found[0] - at[0], found[1] - at[1]) < 1
        assert abs(found[2] - 21) < 2
    assert hough_circle(np.zeros((240, 320), np.uint8)) is None


def test_printed_a_recording_registers_with_the_form_of_the_thesis():
    scene, frames = recorded(noise=0.001, seed=0)
    result = st.calibrate_color_to_depth(frames, DEPTH, RADIUS_M, scene.color, method="printed")
    at = result.pairs.index
    off_m = np.linalg.norm(result.pairs.center_cam - scene.centers_cam[at], axis=1)
    off_px = np.linalg.norm(result.pairs.color_px - scene.color_px[at], axis=1)
    assert len(at) == len(frames)
    assert off_m.max() < 0.001
    assert off_px.max() < CIRCLE_PX
    assert result.rms_px < np.sqrt((off_px**2).mean())  # least squares are below those of the truth
    assert result.pairs.kept.all()
    with pytest.raises(ValueError, match="method: expected 'ours' with mask_fn"):
        st.calibrate_color_to_depth(frames, DEPTH, RADIUS_M, scene.color, method="printed", time_offset=True)
    with pytest.raises(ValueError, match="method: expected one of 'ours', 'printed'"):
        st.calibrate_color_to_depth(frames, DEPTH, RADIUS_M, scene.color, method="hough")


def test_a_recording_with_late_colour_says_by_how_much():
    scene, frames = recorded(noise=0.001, seed=1, time_offset_s=0.03)
    result = st.calibrate_color_to_depth(
        frames, DEPTH, RADIUS_M, scene.color, color_camera=COLOR, time_offset=True
    )
    assert abs(result.time_offset_s - 0.03) < TIME_S
    assert result.time_offset_sd_s < TIME_S
    p = scene.random_points(1000)
    off = np.linalg.norm(result.project(p) - scene.camera.project_to_color(p), axis=1)
    assert np.sqrt(np.mean(off**2)) < HELD_OUT_PX
    assert "ms" in repr(result)


def test_masks_in_place_of_a_colour_and_any_number_of_threads_give_the_same_kind_of_result():
    scene, frames = recorded(noise=0.001, seed=0)

    def mask(frame):
        c = frame.color.astype(int)
        return (c[..., 0] > 70) & (c[..., 0] > 2 * c[..., 1]) & (c[..., 0] > 2 * c[..., 2])

    one, many = (
        st.calibrate_color_to_depth(
            iter(frames[:12]), DEPTH, RADIUS_M, mask_fn=mask, color_camera=COLOR, threads=n
        )
        for n in (1, 3)
    )
    assert np.array_equal(one.T_color_depth, many.T_color_depth)
    p = scene.random_points(500)
    assert np.abs(one.project(p) - scene.camera.project_to_color(p)).max() < HELD_OUT_PX


def test_bad_frames_in_the_middle_are_passed_over():
    scene, frames = recorded(noise=0.001, seed=0)
    damaged = list(frames[:16])
    damaged[3] = st.Frame.unreadable("cut", 0.4, 3)
    damaged[7] = st.Frame(None, frames[7].color)
    damaged[9] = st.Frame(np.zeros(DEPTH.shape, np.float32), frames[9].color, 1.2)
    result = st.calibrate_color_to_depth(damaged, DEPTH, RADIUS_M, scene.color, color_camera=COLOR)
    assert not {3, 7, 9} & set(result.pairs.index.tolist())
    assert len(result.pairs) >= 12


def only(path, n=9):
    """A recording along a path that cannot do."""
    return recorded(n, noise=None, seed=0, path=path, hand=False, clutter=False)[1]


@dataclass(frozen=True)
class _Path:
    spread: tuple[float, float, float]

    def __call__(self, t):
        s = np.stack([np.sin(5 * t), np.sin(8 * t), np.cos(3 * t)], axis=-1)
        return np.array([0.0, 0.0, 0.8]) + s * self.spread


@pytest.mark.parametrize(
    ("spread", "message"),
    [
        ((0.25, 0.15, 0.0), "at one depth"), ((0.25, 0.0, 0.15), "in one plane"),
        ((0.25, 0.0, 0.0), "on a line"), ((0.0, 0.0, 0.0), "hardly moves"),
    ],
)  # fmt: skip
def test_a_path_that_fixes_nothing_is_named(spread, message):
    with pytest.raises(ValueError, match=message):
        st.calibrate_color_to_depth(only(_Path(spread)), DEPTH, RADIUS_M, (225, 60, 30))


def test_a_plane_is_enough_when_the_colour_camera_is_known():
    frames = only(_Path((0.25, 0.15, 0.0)))
    result = st.calibrate_color_to_depth(frames, DEPTH, RADIUS_M, (225, 60, 30), color_camera=COLOR)
    assert result.rms_px < HELD_OUT_PX


def test_a_ball_that_is_too_small_in_the_image_is_called_that():
    small = st.Camera(60.0, 60.0, 31.5, 23.5, 64, 48)
    scene = ball_scene(
        6, RADIUS_M, depth_camera=DEPTH, color_camera=small, fps=7.5, clutter=False, hand=False, color_noise=0
    )
    with pytest.raises(ValueError, match="too small"):
        st.calibrate_color_to_depth(scene.sequence, DEPTH, RADIUS_M, scene.color)


def test_colour_that_is_late_without_a_word_is_warned_of():
    scene, frames = recorded(noise=0.001, seed=1, time_offset_s=0.03)
    with pytest.warns(UserWarning, match="is colour late"):
        result = st.calibrate_color_to_depth(frames, DEPTH, RADIUS_M, scene.color, color_camera=COLOR)
    assert result.rms_px > 1  # colour 30 ms late at up to 0.9 m/s
