# SPDX-License-Identifier: MIT
"""What trackers, energies and fits of poses refuse: in one line that names the argument, and without a trace."""

import functools

import numpy as np
import pytest
from refusals import assert_refused, refused
from tracking_scene import CAMERA, POSE, SIZE_M, box_mesh, depth_of, frame_of, wall_frame

import sdftrack as st

EMPTY, FULL = np.zeros(CAMERA.shape, bool), np.ones(CAMERA.shape, bool)
COLOR_ALONE = st.Frame(None, np.zeros((*CAMERA.shape, 3), np.uint8))
LARGE_COLOR = np.zeros((480, 640, 3), np.uint8)


@functools.cache
def box():
    return st.SDF.box(SIZE_M, voxels=48)


@functools.cache
def frame():
    return frame_of()


def with_value(row, column, value):
    T = POSE.copy()
    T[row, column] = value
    return T


def made(**options):
    return st.Tracker(**{"shapes": box(), "camera": CAMERA, **options})


@refused(
    (lambda: made(shapes=[]), ValueError, "shapes: expected at least one SDF"),
    (lambda: made(shapes=box_mesh()), TypeError, "shapes: .* got Mesh; .*SDF.from_mesh"),
    (lambda: made(shapes=st.SDF(np.ones((8, 8, 8), np.float32), 0.01, [0, 0, 0])), ValueError, "no inside"),
    (lambda: made(options={"padding_m": 0.1}), TypeError, "options: .* got dict"),
    (lambda: made(names=["a", "b"]), ValueError, r"names: expected one per shape \(1\), got 2"),
    (lambda: made().track(frame()), RuntimeError, r"call start\(frame, poses=\[\.\.\.\]\) first"),
    (lambda: made().recover(frame()), RuntimeError, "call start"),
    (lambda: made(mode="rgbd").start(frame(), poses=POSE), ValueError, "colour image with mode='rgbd'"),
)
def test_a_tracker_that_cannot_be_made_or_begun_says_why(call, error, words):
    assert_refused(call, error, words)


def running():
    tracker = made(threads=1)
    tracker.start(frame(), poses=[POSE])
    tracker.track(frame())
    return tracker


@functools.cache
def undisturbed():
    return running().track(frame()).poses


@refused(
    (lambda t: t.start(frame(), poses=[POSE, POSE]), ValueError, r"poses: .*per shape \(1\), got 2"),
    (lambda t: t.start(frame(), poses=[with_value(0, 3, np.nan)]), ValueError, r"poses\[0\]: .*not finite"),
    (lambda t: t.start(frame(), poses=POSE.T), ValueError, r"poses\[0\]: .*transposed"),
    (lambda t: t.start(frame(), masks=EMPTY), ValueError, r"masks\[0\]: .*empty mask"),
    (lambda t: t.start(frame(), masks=FULL[:10]), ValueError, r"masks\[0\]: .* image's shape \(240, 320\)"),
    (lambda t: t.start(frame(), boxes=[(400, 10, 20, 20)]), ValueError, r"boxes\[0\]: .*overlaps the image"),
    (lambda t: t.start(frame(), clicks=(320, 3)), ValueError, "320 x 240"),
    (lambda t: t.start(frame(), poses=POSE, masks=FULL), ValueError, "one of poses, masks, boxes, clicks"),
    (lambda t: t.track(np.ones((10, 10), np.float32)), ValueError, "camera's size 320 x 240, got 10 x 10"),
    (lambda t: t.track(np.full((240, 320), 500, np.uint16)), ValueError, "depth_scale"),
    (lambda t: t.track(np.full((240, 320), 500, np.float32)), ValueError, "depth"),  # millimetres
    (lambda t: t.track(frame().replace(color=LARGE_COLOR)), ValueError, "color: .*320 x 240.*RGBDCamera"),
    (lambda t: t.set_pose(-1, POSE), ValueError, r"k: expected 0\.\.0"),
    (lambda t: t.set_pose(0, POSE, np.zeros((6, 6))), ValueError, "covariance: expected a symmetric matrix"),
    (lambda t: t.add("box.ply"), TypeError, r"shape: expected st\.SDF, got str; .* or give a st\.Primitive"),
    (lambda t: t.add(box(), pose=POSE, mask=FULL), ValueError, "got pose and mask"),
    (lambda t: t.remove(0), ValueError, "at least one remaining object"),
    (lambda t: t.recover(frame(), k=3), ValueError, r"k: expected 0\.\.0, an object's number"),
    (lambda t: t.recover(frame(), k=0, mask=EMPTY), ValueError, "mask: expected at least one pixel"),
)
def test_a_wrong_use_is_refused_and_the_tracker_goes_on_as_before(call, error, words):
    tracker = running()
    assert_refused(call, error, words, tracker)
    result = tracker.track(frame())
    assert (result.index, result.ok) == (2, True)
    np.testing.assert_array_equal(result.poses, undisturbed())


def test_recover_needs_a_frame_after_an_object_was_added():
    tracker = made(threads=1)
    tracker.start(frame(), poses=[POSE])
    tracker.remove(tracker.add(box()))
    assert_refused(lambda: tracker.recover(frame()), RuntimeError, "call track")


def energy(**change):
    given = {"shapes": box(), "camera": CAMERA, "frame": frame(), "poses": POSE, "max_pixels": 300}
    return st.Energy(**{**given, **change})


def scaled(scales):
    return st.State(POSE[None], scales=np.array(scales))


def with_size():
    return energy(unknowns=("pose", "scale"))


@refused(
    (lambda: energy(shapes=[box()] * 5), ValueError, "shapes: expected 1 to 4 SDFs, got 5"),
    (lambda: energy(frame=COLOR_ALONE), ValueError, "depth"),
    (lambda: energy(frame=wall_frame()), ValueError, "no depth measurement"),
    (lambda: energy(penalty="rgbd"), ValueError, "frame: expected a colour image for penalty='rgbd'"),
    (lambda: energy(residuals="point"), TypeError, "did you mean 'residual'"),
    (lambda: with_size().cost(scaled([-1.0])), ValueError, "scales of one number > 0"),
    (lambda: energy().cost(st.State(np.full((1, 4, 4), np.nan))), ValueError, "poses: .*not finite"),
    (lambda: energy().moved(energy().start, np.zeros(7)), ValueError, "delta: expected 6 numbers, got 7"),
    (lambda: st.minimize(energy(), fixed=[True]), ValueError, r"fixed: .* per unknown \(6\), got 1"),
)
def test_an_energy_that_cannot_be_says_why(call, error, words):
    assert_refused(call, error, words)


def fits(**change):
    given = {"shapes": box(), "camera": CAMERA, "frame": frame(), "poses": POSE, "device": "cpu"}
    return st.fit_poses(**{**given, **change})


@refused(
    (lambda: fits(shapes=[box(), box()]), ValueError, r"poses: expected one 4x4 matrix per shape \(2\)"),
    (lambda: fits(frame=COLOR_ALONE), ValueError, "frame: expected a depth image"),
    (lambda: fits(poses=np.diag([1.0, 1, -1, 1])[None]), ValueError, "poses.*mirror"),
)
def test_fits_of_poses_that_cannot_be_say_why(call, error, words):
    assert_refused(call, error, words)


@pytest.mark.parametrize("mode", ["auto", "rgbd"])
def test_colour_of_another_size_is_refused_at_the_start_too(mode):
    tracker = made(mode=mode, threads=1)
    other = frame().replace(color=LARGE_COLOR)
    for place in ({"poses": POSE}, {"masks": depth_of() < 1}, {}):
        assert_refused(
            lambda p=place: tracker.start(other, **p), ValueError, "color: .*320 x 240.*RGBDCamera"
        )
