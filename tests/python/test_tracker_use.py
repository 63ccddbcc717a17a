# SPDX-License-Identifier: MIT
"""Using a tracker wrongly, from another thread, or by its less travelled paths."""

import pickle
import threading

import numpy as np
import pytest
from tracking_scene import CAMERA, POSE, SIZE_M, depth_of, frame_of

import sdftrack as st
from sdftrack import geometry

MOVED = geometry.pose([0, 0, 0], [0.003, 0, 0]) @ POSE


@pytest.fixture(scope="module")
def box():
    return st.SDF.box(SIZE_M)


@pytest.fixture
def tracker(box):
    tracker = st.Tracker(box, CAMERA)
    tracker.start(frame_of(), poses=POSE)
    return tracker


def test_a_bad_first_frame_is_no_reason_to_remember_an_earlier_run(box, tracker):
    fresh = st.Tracker(box, CAMERA)
    for t in (fresh, tracker):
        t.start(st.Frame.unreadable("torn"), poses=POSE)
    np.testing.assert_array_equal(fresh.track(frame_of()).poses, tracker.track(frame_of()).poses)


USES = {
    "track": lambda t: t.track(frame_of()),
    "start": lambda t: t.start(frame_of(), poses=MOVED),
    "set_pose": lambda t: t.set_pose(0, MOVED),
    "save": pickle.dumps,
}


@pytest.mark.parametrize("use", USES)
def test_every_use_by_a_second_thread_is_refused_and_changes_nothing(tracker, use, monkeypatch):
    """The first thread is held inside `track`, so nothing here depends on timing."""
    inside, leave = threading.Event(), threading.Event()
    finish = tracker._finish

    def slow(*args):
        inside.set()
        assert leave.wait(10)
        return finish(*args)

    monkeypatch.setattr(tracker, "_finish", slow)
    results = []
    worker = threading.Thread(target=lambda: results.append(tracker.track(frame_of())))
    worker.start()
    assert inside.wait(10)
    try:
        with pytest.raises(RuntimeError, match="another thread"):
            USES[use](tracker)
    finally:
        leave.set()
        worker.join()
    assert results[0].index == 1
    assert results[0].ok
    monkeypatch.undo()
    assert tracker.track(frame_of()).index == 2


def test_of_two_objects_started_in_one_place_one_is_lost_and_says_why(box):
    tracker = st.Tracker([box, box], CAMERA)
    frame = frame_of()
    result = tracker.start(frame, poses=[POSE, POSE])
    assert sorted(result.status) == ["lost", "ok"]
    gone = result.status.index("lost")
    assert result.reason[gone] == f"the pose coincides with that of another tracked object: object {1 - gone}"
    assert np.isfinite(result.poses).all()
    assert tracker.track(frame).status[1 - gone] == "ok"


def test_two_objects_that_touch_are_not_doubted(box):
    beside = POSE @ geometry.pose(t_m=(SIZE_M[0], 0, 0))
    both = np.minimum(frame_of().depth, frame_of(beside).depth)
    result = st.Tracker([box, box], CAMERA).start(st.Frame(both), poses=[POSE, beside])
    assert result.status == ["ok", "ok"]


def test_nearest_distances_are_exact_far_from_the_origin():
    """FLANN works in float32; a cloud 50 m away has as good an answer as one at 0."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.1, 0.1, (400, 3))
    turn = geometry.pose([0.2, 0.1, -0.3], [0.01, 0.0, 0.02])
    moved = points @ turn[:3, :3].T + turn[:3, 3]
    brute = np.linalg.norm(moved[:, None] - points[None], axis=2).min(axis=1).mean()
    far = np.eye(4)
    far[:3, 3] = 50.0
    assert st.metrics.adds(np.eye(4), turn, points) == pytest.approx(brute, rel=1e-9)
    assert st.metrics.adds(far, far @ turn, points) == pytest.approx(brute, rel=1e-9)


def test_the_energy_is_the_mean_of_the_objects_also_where_one_of_them_was_searched_for_again(box):
    poses = [POSE, geometry.pose([0, 0, 0], [-0.22, 0, 0]) @ POSE]  # too far from each other to touch
    frame = st.Frame(np.minimum(depth_of(poses[0]), depth_of(poses[1], seed=3)))
    both = st.Tracker([box, box], CAMERA, threads=1)
    alone = [st.Tracker(box, CAMERA, threads=1).start(frame, poses=[T]).energy for T in poses]
    assert both.start(frame, poses=poses).energy == pytest.approx(np.mean(alone))
    again = both.recover(frame, k=1).energy  # the same search finds the same,
    assert again == both.recover(frame, k=1).energy  # and the other object counts as before
