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


def test_a_bad_frame_after_set_pose_answers_that_pose(tracker):
    before = tracker.track(frame_of())
    kept = before.poses.copy()
    tracker.set_pose(0, MOVED)
    np.testing.assert_array_equal(tracker.track(st.Frame.unreadable("torn")).pose, MOVED)
    np.testing.assert_array_equal(before.poses, kept)


def test_a_pose_that_was_set_survives_a_pickle(tracker):
    tracker.set_pose(0, MOVED)
    again = pickle.loads(pickle.dumps(tracker))
    np.testing.assert_array_equal(again.track(st.Frame.unreadable("torn")).pose, MOVED)


def test_a_bad_first_frame_is_no_reason_to_remember_an_earlier_run(box, tracker):
    fresh = st.Tracker(box, CAMERA)
    for t in (fresh, tracker):
        t.start(st.Frame.unreadable("torn"), poses=POSE)
    np.testing.assert_array_equal(fresh.track(frame_of()).poses, tracker.track(frame_of()).poses)


def test_a_frame_of_another_size_changes_nothing(box, tracker):
    twin = st.Tracker(box, CAMERA)
    twin.start(frame_of(), poses=POSE)
    small = st.Frame(np.full((60, 80), 0.5, np.float32))
    with pytest.raises(ValueError, match="expected the camera's size 320 x 240, got 80 x 60"):
        tracker.track(small)
    with pytest.raises(ValueError, match="expected the camera's size 320 x 240, got 80 x 60"):
        tracker.start(small, poses=MOVED)
    mine, other = tracker.track(frame_of()), twin.track(frame_of())
    assert mine.index == other.index == 1
    np.testing.assert_array_equal(mine.poses, other.poses)


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


@pytest.mark.parametrize(
    ("make", "error", "match"),
    [
        (lambda s: st.Tracker(None, CAMERA), TypeError, "shapes: expected an SDF, got NoneType"),
        (lambda s: st.Tracker(s.to_mesh(), CAMERA), TypeError, "shapes: .* got Mesh; .*SDF.from_mesh"),
        (lambda s: st.Tracker([s, "mug.ply"], CAMERA), TypeError, r"shapes\[1\]: .* got str"),
        (lambda s: st.Tracker(s, CAMERA.K), TypeError, "camera: expected st.Camera"),
        (lambda s: st.Tracker(s, CAMERA, options={"padding_m": 0.1}), TypeError, "options: .* got dict"),
        (lambda s: st.Tracker(s, CAMERA, names="mug"), TypeError, "names: expected a list .*'mug'"),
        (lambda s: st.Tracker(s, CAMERA, collision="hard"), ValueError, "collision: expected .contact."),
        (lambda s: st.Tracker(s, CAMERA, names=["a", "b"]), ValueError, r"names: .*\(1\), got 2"),
    ],
)
def test_a_tracker_from_the_wrong_kind_of_thing_names_the_argument(box, make, error, match):
    with pytest.raises(error, match=match):
        make(box)


@pytest.mark.parametrize(
    ("use", "error", "match"),
    [
        (lambda t: t.start(frame_of(), poses="gt"), TypeError, "poses: .*'gt'"),
        (lambda t: t.start(frame_of(), poses=["gt"]), TypeError, r"poses\[0\]: .*'gt'"),
        (lambda t: t.start(frame_of(), poses=3), TypeError, "poses: .*3"),
        (lambda t: t.start(frame_of().depth, poses=POSE), TypeError, "frame: expected st.Frame, got ndarray"),
        (lambda t: t.set_pose("mug", POSE), TypeError, "k: expected 0..0, an object's number, got 'mug'"),
        (lambda t: t.set_pose(1, POSE), ValueError, "k: expected 0..0, got 1"),
        (lambda t: t.set_pose(0, "here"), TypeError, "T: .*'here'"),
        (lambda t: t.set_pose(0, np.diag([2.0, 2, 2, 1])), ValueError, "T: .*rotation"),
    ],
)
def test_a_wrong_argument_is_named(tracker, use, error, match):
    with pytest.raises(error, match=match):
        use(tracker)


@pytest.mark.parametrize(
    ("use", "match"),
    [
        (lambda s: st.SDF.sphere("a"), "sphere: expected a number, got 'a'"),
        (lambda s: st.SDF.box(("a", 1, 1)), "size: expected an array of numbers"),
        (lambda s: st.SDF.sphere(0.1, voxels="a"), "voxels: expected a number, got 'a'"),
        (lambda s: s([1j, 0, 0]), "points: expected an array of numbers"),
        (lambda s: s([None, 0, 0]), "points: expected an array of numbers"),
        (lambda s: s.render(CAMERA, "here"), "T_cam_obj: expected an array of numbers, got 'here'"),
        (lambda s: s.transformed("there"), "T: expected an array of numbers, got 'there'"),
        (lambda s: st.Frame(np.ones((4, 4), np.uint16), depth_scale="mm"), "depth_scale: .*'mm'"),
        (lambda s: st.Frame(np.ones((4, 4), np.float32), timestamp="now"), "timestamp: .*'now'"),
        (lambda s: st.Camera.from_K("K", 4, 4), "K: expected an array of numbers"),
        (lambda s: st.Energy(s, CAMERA, frame_of().depth, POSE), "frame: expected st.Frame, got ndarray"),
        (lambda s: st.Energy(None, CAMERA, frame_of(), POSE), "shapes: expected an SDF, got NoneType"),
        (lambda s: st.Energy(s, CAMERA, frame_of(), POSE).cost(POSE), "x: expected a State, got ndarray"),
        (lambda s: st.minimize(s), "energy: expected st.Energy, got SDF"),
        (lambda s: st.minimize(st.Energy(s, CAMERA, frame_of(), POSE), max_steps="a"), "max_steps: .*'a'"),
        (lambda s: st.remove_plane(frame_of().depth, CAMERA), "frame: expected st.Frame, got ndarray"),
        (lambda s: st.draw(frame_of(), None, s, CAMERA), "result: expected st.TrackResult, got NoneType"),
        (lambda s: st.save_sequence("x", None), "seq: expected st.Sequence, got NoneType"),
        (lambda s: st.metrics.pose_error("T", POSE), "T: expected an array of numbers"),
    ],
)
def test_an_argument_of_the_wrong_kind_is_named(box, use, match):
    with pytest.raises(TypeError, match=match):
        use(box)


def test_files_that_are_not_there_or_not_ours_are_named(tmp_path):
    (tmp_path / "t.pkl").write_bytes(b"ply")
    with pytest.raises(ValueError, match=r"t\.pkl: expected a file of Tracker\.save"):
        st.Tracker.load(tmp_path / "t.pkl")
    with pytest.raises(FileNotFoundError, match="no such file"):
        st.Tracker.load(tmp_path / "u.pkl")
    with pytest.raises(FileNotFoundError, match="options: no such file"):
        st.TrackerOptions.from_file(tmp_path / "o.toml")


def test_a_full_disk_is_told_with_the_file(box, tmp_path, monkeypatch):
    import errno

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match=r"box\.npz: no space left on the disk; free some"):
        box.save(tmp_path / "box.npz")
    assert list(tmp_path.iterdir()) == []


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


def test_the_helpers_for_tests_come_with_the_import():
    st.testing.assert_pose_close(POSE, POSE, 0, 0)


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
