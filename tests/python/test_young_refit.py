# SPDX-License-Identifier: MIT
"""The young shape and its poses are found anew beside the tracking: better, at fixed frames, and only if better."""

from __future__ import annotations

import functools
import gc
import time
import weakref
from typing import Any

import numpy as np
import pytest
from reconstruction_scene import body, first_mask, pose_errors, turning

import sdftrack as st
from sdftrack.reconstruction import young_refit
from sdftrack.reconstruction.volume import Lattice

CAMERA = st.Camera(400.0, 400.0, 159.5, 119.5, 320, 240)
VOXELS, FIRST = 64, 8
DUE = FIRST + young_refit.frames_taken(FIRST, VOXELS)


@functools.cache
def noisy(n: int = 30) -> Any:
    return st.synth.sequence(
        body(), n, turning(n, 90.0), "kinect", seed=3, camera=CAMERA, clutter="wall", threads=1
    )


def followed(n: int = 30, **options: Any) -> tuple[st.Reconstructor, dict[int, Any]]:
    seq = noisy()
    star = st.Reconstructor(seq.camera, voxels=VOXELS, **{"threads": 1, "refit_after": FIRST, **options})
    poses = {0: star.start(seq[0], mask=first_mask(seq)).pose}
    for i in range(1, n):
        poses[i] = star.track(seq[i]).pose
    return star, poses


@pytest.mark.slow
def test_the_frames_that_follow_are_nearer_to_the_truth() -> None:
    plain, refitted = (pose_errors(noisy(), followed(refit_after=k)[1])[20:].mean(axis=0) for k in (0, FIRST))
    assert plain[1] > np.radians(0.3)
    assert (refitted < 0.8 * plain).all()


@pytest.mark.slow
def test_it_is_taken_before_a_frame_that_is_known_beforehand(monkeypatch: Any) -> None:
    _, poses = followed(DUE + 4)
    _, never = followed(DUE + 4, refit_after=0)
    same = [np.array_equal(poses[i], never[i]) for i in poses]
    assert all(same[:DUE])
    assert not any(same[DUE:])
    slowly = young_refit.YoungRefit._refit

    def later(self: Any) -> None:
        time.sleep(0.5)
        slowly(self)

    monkeypatch.setattr(young_refit.YoungRefit, "_refit", later)
    _, again = followed(DUE + 4, threads=2)
    assert all(np.array_equal(poses[i], again[i]) for i in poses)


def test_what_explains_the_frames_no_better_is_not_taken(monkeypatch: Any) -> None:
    class Doubtful:
        def __init__(self, *given: Any) -> None:
            pass

        def misfit_m(self, shape: Any) -> float:
            return 1.0

    _, never = followed(DUE + 4, refit_after=0)
    monkeypatch.setattr(young_refit, "Judge", Doubtful)
    _, poses = followed(DUE + 4)
    assert all(np.array_equal(poses[i], never[i]) for i in poses)


def test_another_pose_of_a_look_alike_is_no_correction() -> None:
    here = [np.eye(4)] * 3
    assert not young_refit._far(here, [st.geometry.pose((0, 0, 0.1), (0.005, 0, 0))] * 3)
    assert young_refit._far(here, [np.eye(4), np.eye(4), st.geometry.pose((0, 0, 0.2), (0, 0, 0))])
    assert young_refit._far(here, [np.eye(4), st.geometry.pose((0, 0, 0), (0.02, 0, 0)), np.eye(4)])


def test_an_error_on_the_thread_is_raised_where_its_result_is_due(monkeypatch: Any) -> None:
    def broken(self: Any) -> None:
        raise MemoryError("no room for a second volume")

    monkeypatch.setattr(young_refit.YoungRefit, "_refit", broken)
    star, _ = followed(DUE)
    with pytest.raises(MemoryError, match="second volume"):
        star.track(noisy()[DUE])
    assert star.track(noisy()[DUE]).index == DUE  # and the camera goes on


def test_a_frame_that_is_refused_where_it_is_due_leaves_all_in_order() -> None:
    star, _ = followed(DUE)
    with pytest.raises(ValueError, match="camera's size"):
        star.track(st.Frame(np.ones((10, 10), np.float32)))
    assert star.track(noisy()[DUE]).ok


def test_a_refit_counts_all_frames_and_one_that_is_due_later_is_kept_in_a_file(tmp_path: Any) -> None:
    assert followed(DUE + 1)[0].quality().frames == DUE + 1
    star, _ = followed(FIRST - 2)
    star.save(tmp_path / "star")
    again = st.Reconstructor.load(tmp_path / "star")
    for i in range(FIRST - 2, FIRST + 1):
        again.track(noisy()[i])
    assert again._refit is not None


def test_what_is_asked_for_meanwhile_ends_it(tmp_path: Any) -> None:
    seq = noisy()
    star, _ = followed(FIRST + 2)
    assert star._refit is not None
    star.save(tmp_path / "star")
    assert st.Reconstructor.load(tmp_path / "star")._refit is None
    star.refine(rounds=1)
    assert star._refit is None
    star, _ = followed(FIRST + 2)
    begun = star._refit
    star.start(seq[0], mask=first_mask(seq))
    assert star._refit is None
    for i in range(1, FIRST + 1):
        star.track(seq[i])
    assert star._refit is not None
    assert star._refit is not begun


def test_a_reconstructor_that_is_let_go_takes_its_refits_with_it() -> None:
    star, _ = followed(DUE + 1)
    gone = weakref.ref(star)
    del star
    gc.collect()
    assert gone() is None


def test_a_coarser_lattice_holds_the_same_space() -> None:
    place = Lattice((200, 232, 200), 0.001, (0.1, 0.2, 0.3))
    coarse = young_refit.coarser(place, 100)
    assert max(coarse.voxels) <= 101
    assert coarse.origin == place.origin
    for fine, rough in zip(place.voxels, coarse.voxels, strict=True):
        assert (rough - 1) * coarse.voxel_m >= (fine - 1) * place.voxel_m - 1e-12
    assert young_refit.coarser(Lattice((64, 64, 64), 0.001, (0, 0, 0)), 100).voxels == (64, 64, 64)


def test_bad_input_is_named() -> None:
    for wrong in (-1, 2.5, "soon"):
        with pytest.raises((TypeError, ValueError), match="refit_after"):
            st.Reconstructor(CAMERA, refit_after=wrong)
