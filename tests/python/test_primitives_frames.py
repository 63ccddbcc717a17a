# SPDX-License-Identifier: MIT
"""Primitives of unknown size in several frames: the same object in each, and frames that show nothing of it."""

import json
import pickle

import numpy as np
import pytest

import sdftrack as st
from experiments.synth.solids import ray_depth, standing_scene
from sdftrack.primitives.frames import SizeSum, fuse_sizes
from sdftrack.synth.noise import Gaussian

CAMERA = st.Camera(262, 262, 159.5, 119.5, 320, 240)
LARGE = {"x": 0.20, "y": 0.15, "z": 0.12}
SMALL = {"radius": 0.03, "height": 0.10}
RTOL = 0.03  # of a size by a thousand readings of 1 mm noise; the other object is six times as large
FEW = 900  # readings that the small object has at most


def two_objects(shift_m=0.0, seed=0):
    """A box and, 22 cm beside it, a can that is moved by `shift_m`: frame, mask of the can."""
    first = standing_scene("box", LARGE, CAMERA, np.random.default_rng(4), (0.9, 0.91))
    up, d = first.plane
    rays = CAMERA.back_project(np.ones(CAMERA.shape, np.float32)).astype(float).reshape(-1, 3)
    T = first.T_cam_obj.copy()
    at = T[:3, 3] + np.array([-0.22 - shift_m, 0, 0])
    T[:3, 3] = at - up * (at @ up + d) + up * SMALL["height"] / 2
    z, _ = ray_depth("cylinder", SMALL, -T[:3, :3].T @ T[:3, 3], rays @ T[:3, :3])
    z = z.reshape(CAMERA.shape)
    can = z < first.depth
    depth = np.where(can, z, first.depth).astype(np.float32)
    rng = np.random.default_rng(seed)
    return st.Frame(Gaussian(0.001)(depth, np.ones_like(depth), rng)), can


@pytest.fixture(scope="module")
def still():
    """Three frames of both objects, and the can's mask in the first one."""
    made = [two_objects(0, seed) for seed in range(3)]
    return [frame for frame, _ in made], made[0][1]


def small(fit):
    return np.allclose(list(fit.size.values()), list(SMALL.values()), rtol=RTOL)


def test_a_masked_object_is_not_left_for_a_larger_one_beside_it(still):
    frames, mask = still
    assert np.count_nonzero(mask) < FEW
    fit = st.fit_primitive(frames, "cylinder", camera=CAMERA, mask=mask)
    assert len(fit.per_frame) == len(frames)
    assert all(small(f) for f in (fit, *fit.per_frame)), fit.per_frame
    assert fit.skipped == {}


def test_a_start_alone_says_which_of_two_objects_is_meant(still):
    frames, mask = still
    one = st.fit_primitive(frames[0], "cylinder", camera=CAMERA, mask=mask)
    assert small(st.fit_primitive(frames[1], camera=CAMERA, initial=one))
    away = one.T_cam_obj.copy()
    away[1, 3] -= 2.0
    with pytest.raises(ValueError, match="initial: expected a pose at something that stands off"):
        st.fit_primitive(frames[1], "cylinder", camera=CAMERA, initial=(away, one.size))


def test_an_object_that_moves_farther_than_a_start_reaches_is_still_the_one_that_is_meant():
    made = [two_objects(0.05 * i, i) for i in range(3)]
    fit = st.fit_primitive([frame for frame, _ in made], "cylinder", camera=CAMERA, mask=made[0][1])
    assert all(small(f) for f in (fit, *fit.per_frame)), fit.per_frame
    assert len(fit.per_frame) == 3


def test_a_frame_in_which_another_thing_stands_in_its_place_is_left_out_with_the_reason(still):
    frames, mask = still
    without = frames[1].depth.copy()
    without[mask] = 0
    rows, columns = np.nonzero(mask)
    without[rows.min() + 5 : rows.max(), columns.min() - 30 : columns.max() + 15] = 0.75  # a board in front
    fit = st.fit_primitive([frames[0], st.Frame(without), frames[2]], "cylinder", camera=CAMERA, mask=mask)
    assert list(fit.skipped) == [1]
    assert small(fit)
    assert len(fit.per_frame) == 2


def bad_frames(good):
    """By name: (frame, what the reason says)."""
    depth = good.depth
    return {
        "zero": (st.Frame(np.zeros_like(depth)), "nothing|got none"),
        "nan": (st.Frame(depth * np.nan), "nothing|got none"),
        "empty mask": (
            st.Frame(depth, mask=np.zeros(depth.shape, bool)),
            "mask: expected some depth measurements",
        ),
        "other size": (st.Frame(depth[:100]), "camera: expected the depth image's size"),
        "unreadable": (st.Frame.unreadable("torn"), "torn"),
        "only colour": (st.Frame(None, np.zeros((*depth.shape, 3), np.uint8)), "only colour"),
    }


@pytest.mark.parametrize("name", ["zero", "nan", "empty mask", "other size", "unreadable", "only colour"])
def test_a_bad_frame_in_the_middle_is_left_out_and_named(still, name):
    import re

    frames, mask = still
    bad, why = bad_frames(frames[0])[name]
    fit = st.fit_primitive([frames[0], bad, frames[2]], "cylinder", camera=CAMERA, mask=mask)
    assert list(fit.skipped) == [1]
    assert re.search(why, fit.skipped[1]), fit.skipped
    assert len(fit.per_frame) == 2
    assert small(fit)
    assert json.loads(json.dumps(fit.to_dict(), allow_nan=False))["skipped"] == {"1": fit.skipped[1]}
    assert pickle.loads(pickle.dumps(fit)).skipped == fit.skipped


def test_a_bad_first_frame_leaves_the_mask_to_the_next(still):
    frames, mask = still
    fit = st.fit_primitive([st.Frame.unreadable("torn"), frames[0]], "cylinder", camera=CAMERA, mask=mask)
    assert fit.skipped == {0: "frame: expected a depth image, got none (torn)"}
    assert small(fit)


def test_frames_that_are_all_bad_give_one_error_with_the_first_reason(still):
    frames, _ = still
    zero = st.Frame(np.zeros_like(frames[0].depth))
    with pytest.raises(
        ValueError, match=r"frames: expected at least one .* none of 2; frame 0: frame: expected"
    ):
        st.fit_primitive([zero, zero], "cylinder", camera=CAMERA)
    with pytest.raises(ValueError, match="frames: expected at least one with a depth image"):
        st.fit_primitive(iter([]), "cylinder", camera=CAMERA)


# ---- sizes ----
def test_a_running_sum_of_sizes_is_that_of_all_at_once_and_does_not_grow():
    rng = np.random.default_rng(0)
    sizes = rng.uniform(0.05, 0.1, (200, 2))
    covariances = np.stack([np.diag(rng.uniform(1e-6, 1e-5, 2)) for _ in sizes])
    covariances[::7, 1, 1] = np.inf
    total = SizeSum(2)
    total.add(sizes[0], covariances[0])
    at_first = len(pickle.dumps(total))
    for size, covariance in zip(sizes[1:], covariances[1:], strict=True):
        total.add(size, covariance)
    assert len(pickle.dumps(total)) == at_first
    for own, wanted in zip(total.mean(), fuse_sizes(sizes, covariances), strict=True):
        np.testing.assert_array_equal(own, wanted)


@pytest.mark.parametrize("covariance", [np.zeros((2, 2)), np.full((2, 2), 1e-6)], ids=["zero", "singular"])
def test_sizes_without_any_variance_have_a_mean(covariance):
    size, fused = fuse_sizes(np.array([[0.1, 0.2], [0.1, 0.2]]), np.stack([covariance] * 2))
    np.testing.assert_allclose(size, [0.1, 0.2], rtol=1e-6)  # of the share that a variance is raised by
    assert np.isfinite(fused).all()
