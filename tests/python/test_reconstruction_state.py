# SPDX-License-Identifier: MIT
"""A reconstructor is one thread's at a time, and says of how many frames its shape is made."""

import copy
import threading

import numpy as np
import pytest
import reconstruction_scene as scene

import sdftrack as st
from sdftrack.reconstruction import quality


def begun(frames, **options):
    return scene.begun(frames, voxels=48, **options)[0]


CALLS = {
    "start": lambda star, seq: star.start(seq[0], mask=scene.first_mask(seq)),
    "resume": lambda star, seq: star.resume(seq[0], mask=scene.first_mask(seq)),
    "track": lambda star, seq: star.track(seq[2]),
    "shape": lambda star, _: star.shape,
    "mesh": lambda star, _: star.mesh(),
    "quality": lambda star, _: star.quality(),
    "tracker": lambda star, _: star.tracker(),
    "refine": lambda star, _: star.refine(rounds=1),
}


@pytest.mark.parametrize("name", [*CALLS, "save"])
def test_a_second_thread_is_refused_while_one_is_at_work(name, tmp_path):
    star, seq = begun(2), scene.sequence()
    calls = {**CALLS, "save": lambda star, _: star.save(tmp_path / "star.pkl")}
    inside, over = threading.Event(), threading.Event()

    def wait(_):
        inside.set()
        over.wait(60)

    first = threading.Thread(target=lambda: star.refine(wait, rounds=1))
    first.start()
    try:
        assert inside.wait(60)
        with pytest.raises(RuntimeError, match="this reconstructor is in use by another thread"):
            calls[name](star, seq)
    finally:
        over.set()
        first.join()
    calls[name](star, seq)  # nothing of the refusal is left


def test_what_is_called_during_a_refinement_may_look_at_the_shape():
    star = begun(2)
    seen = []
    star.refine(lambda share: seen.append(star.mesh()), rounds=1)
    assert seen


def test_a_loaded_one_counts_the_frames_that_it_holds(tmp_path):
    star = begun(12, kept_frames=5)
    assert "12 frames fused" in repr(star)
    star.save(tmp_path / "star.pkl")
    for other in (st.Reconstructor.load(tmp_path / "star.pkl"), copy.deepcopy(star)):
        held = len(other._kept)
        assert held < 12
        assert f"{held} frames fused" in repr(other)
        assert other.quality().frames == held
        result = other.track(scene.sequence()[12])
        assert result.index == 12
        assert np.isfinite(result.poses).all()


def test_a_mesh_for_another_thread_makes_nothing_fail(monkeypatch):
    star, seq = begun(2), scene.sequence()
    inside, over = threading.Event(), threading.Event()
    whole = quality.surface_mesh

    def slow(*args):
        inside.set()
        over.wait(60)
        return whole(*args)

    monkeypatch.setattr(quality, "surface_mesh", slow)
    meshes, results = [], []
    viewer = threading.Thread(target=lambda: meshes.append(star.mesh()))
    viewer.start()
    assert inside.wait(60)
    camera = threading.Thread(target=lambda: results.append(star.track(seq[2])))
    camera.start()
    camera.join(0.2)
    assert not results  # it waits
    over.set()
    for thread in (viewer, camera):
        thread.join(60)
    assert results[0].index == 2
    assert len(meshes[0].vertices) > 0


def test_an_interrupted_refinement_leaves_everything_as_it_was():
    star = begun(3)
    shape, poses = star.shape.values.copy(), [k.T_cam_obj.copy() for k in star._kept]

    def stop(share):
        if share > 0.75:  # in the second of two rounds
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        star.refine(stop, rounds=2)
    np.testing.assert_array_equal(star.shape.values, shape)
    np.testing.assert_array_equal([k.T_cam_obj for k in star._kept], poses)
    star.refine(rounds=1)


def test_frames_fused_again_with_one_measurement_at_the_end_give_the_same_surface():
    star = begun(20)
    one_by_one, at_once = star._volume.emptied(), star._volume.emptied()
    for keyframe in star._kept:
        one_by_one.fuse(keyframe)
        at_once.fuse_again(keyframe, star._volume, keyframe.T_cam_obj)
    at_once.measure()
    expected, found = one_by_one.core, at_once.core
    np.testing.assert_array_equal(found.weight, expected.weight)
    np.testing.assert_array_equal(found.log_ratio, expected.log_ratio)
    near = (np.abs(expected.phi) < expected.voxel_m) & (np.array(expected.seen) >= 3)
    assert near.sum() > 1000
    assert np.abs(found.phi - expected.phi)[near].max() < 1e-3 * expected.voxel_m


def test_a_cropped_shape_is_that_of_the_whole_one_cropped():
    star = begun(6)
    expected, found = star.shape.cropped(5), star.cropped_shape(5)
    np.testing.assert_array_equal(found.values, expected.values)
    np.testing.assert_array_equal(found.colors, expected.colors)
    np.testing.assert_allclose(found.origin, expected.origin, atol=1e-12)
    assert found.values.size < star.shape.values.size
