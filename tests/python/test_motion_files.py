# SPDX-License-Identifier: MIT
"""Trajectories come back from text files and result folders as they were, and what cannot be read says why."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs
from motion_recordings import FPS, poses, results_of, trajectory, write_folder

import sdftrack as st
from sdftrack.io.report_file import tum_line

ROUNDING = 1e-9  # of poses through a quaternion, or through the nine decimals of a file, and back
STATUSES = ["ok", "weak", "lost", "bad_frame"]
BOP = "scene_id,im_id,obj_id,score,R,t,time\n"


def assert_same(a, b, atol=ROUNDING):
    np.testing.assert_allclose(a.times_s, b.times_s, rtol=0, atol=atol)
    np.testing.assert_allclose(a.poses[a.usable], b.poses[b.usable], rtol=0, atol=atol)
    assert a.status == b.status
    assert (a.name, a.frame) == (b.name, b.frame)


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def bop_row(im_id, T, obj_id=1, scene=0):
    R, t = (" ".join(f"{v:.12f}" for v in a) for a in (T[:3, :3].ravel(), 1e3 * T[:3, 3]))
    return f"{scene},{im_id},{obj_id},1.0,{R},{t},0.01\n"


def changed(folder, change):
    """Change the report of a result folder."""
    report = json.loads((folder / "report.json").read_text())
    change(report["frames"])
    write(folder / "report.json", json.dumps(report))


def tum_row(time, numbers="0 0 1 0 0 0 1"):
    return f"{time} {numbers}\n"


# -- tables
@settings(max_examples=30, deadline=None)
@given(
    seed=hs.integers(0, 99),
    names=hs.lists(hs.text(hs.characters(codec="utf-8"), min_size=1), min_size=1, max_size=3, unique=True),
    status=hs.lists(hs.sampled_from(STATUSES), min_size=5, max_size=5), start_s=hs.floats(-1e6, 2e9),
    with_covariance=hs.booleans(),
)  # fmt: skip
def test_a_table_gives_back_what_was_saved(tmp_path_factory, seed, names, status, start_s, with_covariance):
    path = tmp_path_factory.mktemp("table") / "a.csv"
    given_ones = [
        trajectory(6, seed + k, name, with_covariance, ["ok", *status], start_s)
        for k, name in enumerate(names)
    ]
    st.motion.save(path, given_ones)
    read = st.motion.load(path)
    assert [t.name for t in read] == names
    for a, b in zip(given_ones, read, strict=True):
        assert_same(a, b)
        np.testing.assert_array_equal(a.times_s, b.times_s)
        if with_covariance:
            np.testing.assert_allclose(a.covariances, b.covariances, rtol=0, atol=1e-15)
        else:
            assert b.covariances is None


def test_a_table_keeps_the_frame_and_poses_of_lost_frames(tmp_path):
    T = poses(3)
    a = st.motion.Trajectory([0, 1, 2], T, None, ["ok", "lost", "ok"], "cup", "table")
    st.motion.save(tmp_path / "a.csv", a)
    (b,) = st.motion.load(tmp_path / "a.csv")
    assert (b.frame, b.status) == ("table", ("ok", "lost", "ok"))
    np.testing.assert_allclose(b.poses, T, rtol=0, atol=ROUNDING)


def test_unknown_covariances_of_some_frames_stay_unknown(tmp_path):
    C = np.tile(np.eye(6), (3, 1, 1))
    C[1] = np.nan
    st.motion.save(tmp_path / "a.csv", st.motion.Trajectory([0, 1, 2], poses(3), C))
    np.testing.assert_array_equal(st.motion.load(tmp_path / "a.csv")[0].covariances, C)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("time_s,", "", "time_s is missing"),
        ("cov_x_y,", "", "expected all 21 columns"),
        (",ok,", ",good,", "line 5: expected a status"),
        (",ok,", ",ok,abc,", "expected a number as x_m, got 'abc'"),
        ("\ncup,", "\nmug,", "line 5: expected an object of the header"),
        ('{""name"": ""cup""', "{", "expected header lines"),
        (",END", "\n", "line 7: expected a number as cov_rz_rz, got 'the end of the row'"),
    ],
)
def test_a_damaged_table_is_refused_with_its_line(tmp_path, old, new, words):
    path = tmp_path / "a.csv"
    st.motion.save(path, trajectory(3))
    text = path.read_text()
    old = text[text.rindex(",") :] if old == ",END" else old
    assert old in text
    write(path, text.replace(old, new, 1))
    with pytest.raises(ValueError, match=words) as error:
        st.motion.load(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


# -- result folders
def test_a_result_folder_is_read_with_covariances_and_statuses(tmp_path):
    status = ["ok"] * 4 + ["lost", "weak", "bad_frame"] + ["ok"] * 5
    a, b = trajectory(status=status), trajectory(seed=5, name="box", status=["ok"] * 12)
    write_folder(tmp_path / "run", results_of(a, b), a.times_s, ("cup", "box"), (3, 4))
    for path in (tmp_path / "run", tmp_path / "run" / "report.json"):
        read = st.motion.load(path)
        for x, y in zip((a, b), read, strict=True):
            assert_same(x, y)
            np.testing.assert_allclose(x.covariances, y.covariances, rtol=1e-12)
    assert [t.name for t in st.motion.load(tmp_path / "run", name="cup")] == ["cup"]
    with pytest.raises(ValueError, match=r"name: .*run has no object 'mug'; it has box, cup"):
        st.motion.load(tmp_path / "run", name="mug")


def test_the_text_trajectory_of_a_result_folder_is_read(tmp_path):
    a = trajectory(status=["ok"] * 12, covariance=True)
    write_folder(tmp_path / "run", results_of(a), a.times_s)
    (b,) = st.motion.load(tmp_path / "run" / "trajectory_0.txt", name="cup")
    np.testing.assert_allclose(a.poses, b.poses, rtol=0, atol=5e-9)  # nine decimals
    assert b.name == "cup"
    (c,) = st.motion.load(tmp_path / "run" / "poses.csv", fps=FPS)
    np.testing.assert_allclose(a.poses, c.poses, rtol=0, atol=5e-9)
    np.testing.assert_allclose(a.times_s, c.times_s, rtol=0, atol=ROUNDING)


def test_a_report_without_timestamps_asks_for_the_frame_rate(tmp_path):
    a = trajectory(status=["ok"] * 12)
    write_folder(tmp_path / "run", results_of(a), a.times_s)
    changed(tmp_path / "run", lambda frames: [row.update(timestamp=None) for row in frames[3:]])
    with pytest.raises(ValueError, match=r"report.json: 9 of 12 frames have no timestamp; .*fps=30"):
        st.motion.load(tmp_path / "run")
    np.testing.assert_allclose(st.motion.load(tmp_path / "run", fps=60)[0].times_s, np.arange(12) / 60)


def test_objects_that_come_and_go_are_lost_where_a_frame_does_not_have_them(tmp_path):
    a, b = trajectory(4, status=["ok"] * 4), trajectory(4, 5, "box", status=["ok"] * 4)
    write_folder(tmp_path / "run", results_of(a, b), a.times_s, ("cup", "box"), (3, 3))
    changed(tmp_path / "run", lambda frames: (frames[0]["objects"].pop(1), frames[2]["objects"].pop(0)))
    x, y = st.motion.load(tmp_path / "run")
    assert x.status == ("ok", "ok", "lost", "ok")
    assert y.status == ("lost", "ok", "ok", "ok")
    np.testing.assert_allclose(y.poses[2], b.poses[2], atol=ROUNDING)


def test_an_object_that_is_lost_in_all_frames_is_left_out_with_a_warning(tmp_path):
    a, b = trajectory(4, status=["ok"] * 4), trajectory(4, 5, "box", status=["ok"] * 4)
    write_folder(tmp_path / "run", results_of(a, b), a.times_s, ("cup", "box"), (3, 4))
    changed(tmp_path / "run", lambda frames: [row["objects"][1].update(status="lost") for row in frames])
    with pytest.warns(UserWarning, match="left out, without any pose: box"):
        assert len(st.motion.load(tmp_path / "run")) == 1
    with pytest.raises(ValueError, match="box: lost in all frames"):
        st.motion.load(tmp_path / "run", name="box")


def test_objects_of_one_name_are_numbered(tmp_path):
    a, b = trajectory(4, status=["ok"] * 4), trajectory(4, 5, status=["ok"] * 4)
    write_folder(tmp_path / "run", results_of(a, b), a.times_s, ("cup", "cup"), (3, 3))
    assert [t.name for t in st.motion.load(tmp_path / "run")] == ["cup", "cup_2"]


# -- TUM
@settings(max_examples=20, deadline=None)
@given(seed=hs.integers(0, 999), start_s=hs.integers(0, 2_000_000_000))
def test_a_tum_file_gives_back_what_was_written(tmp_path_factory, seed, start_s):
    path = tmp_path_factory.mktemp("tum") / "cup.txt"
    a = trajectory(seed=seed, covariance=False, start_s=start_s, fps=50)
    path.write_text("".join(f"{tum_line(t, T)}\n" for t, T in zip(a.times_s, a.poses, strict=True)))
    (b,) = st.motion.load(path)
    np.testing.assert_allclose(b.times_s, a.times_s, rtol=0, atol=6e-7)  # written with six decimals
    np.testing.assert_allclose(b.poses, a.poses, rtol=0, atol=ROUNDING)
    assert (b.name, b.covariances, set(b.status)) == ("cup", None, {"ok"})


def test_a_tum_file_in_millimetres_is_converted_on_request_only(tmp_path):
    path = write(tmp_path / "a.txt", tum_row(0, "10 20 500 0 0 0 1") + tum_row(1, "11 20 500 0 0 0 1"))
    (t,) = st.motion.load(path, unit="mm")
    np.testing.assert_allclose(t.poses[0, :3, 3], [0.01, 0.02, 0.5])


def test_rows_of_nan_are_gaps(tmp_path):
    path = write(tmp_path / "a.txt", tum_row(0) + tum_row(1, "nan nan nan 0 0 0 1") + tum_row(2))
    (t,) = st.motion.load(path)
    assert t.status == ("ok", "lost", "ok")
    assert np.isnan(t.poses[1]).all()


def test_the_frame_rate_replaces_times_that_cannot_be_used(tmp_path):
    path = write(tmp_path / "a.txt", tum_row(0) + tum_row(0) + tum_row(0))
    np.testing.assert_allclose(st.motion.load(path, fps=10)[0].times_s, [0, 0.1, 0.2])


# -- BOP results
def test_bop_results_need_the_frame_rate_and_missing_images_are_gaps(tmp_path):
    T = poses(6)
    path = write(tmp_path / "a.csv", BOP + "".join(bop_row(i, T[i]) for i in (1, 2, 5)))
    with pytest.raises(ValueError, match=r"a.csv: BOP results number their images .*fps=30"):
        st.motion.load(path)
    (t,) = st.motion.load(path, fps=FPS)
    np.testing.assert_allclose(t.times_s, np.arange(1, 6) / FPS)
    assert t.status == ("ok", "ok", "lost", "lost", "ok")
    np.testing.assert_allclose(t.poses[t.usable], T[[1, 2, 5]], atol=ROUNDING)
    assert t.name == "object_1"


def test_every_tenth_image_of_bop_results_is_no_gap(tmp_path):
    path = write(tmp_path / "a.csv", BOP + "".join(bop_row(10 * i, poses(1)[0]) for i in range(4)))
    (t,) = st.motion.load(path, fps=30)
    np.testing.assert_allclose(t.times_s, np.arange(4) / 3)


def test_an_image_with_another_object_is_a_gap_of_this_one(tmp_path):
    (T,) = poses(1)
    rows = [bop_row(0, T), bop_row(1, T), bop_row(0, T, 7), bop_row(1, T, 7), bop_row(2, T, 7)]
    path = write(tmp_path / "a.csv", BOP + "".join(rows))
    one, seven = st.motion.load(path, fps=1)
    assert (one.status, seven.status) == (("ok", "ok", "lost"), ("ok",) * 3)


def at(x):
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_instances_of_one_object_are_one_trajectory_each(tmp_path):
    rows = [bop_row(i, at(x + 0.01 * i)) for i in range(3) for x in (0, 1)]
    a, b = st.motion.load(write(tmp_path / "a.csv", BOP + "".join(rows)), fps=1, name="cup")
    assert [a.name, b.name] == ["cup_1", "cup_2"]
    np.testing.assert_allclose([a.poses[:, 0, 3], b.poses[:, 0, 3]], [[0, 0.01, 0.02], [1, 1.01, 1.02]])


# -- what is refused, in one line with the name of the file
IDENTITY = "1 0 0 0 1 0 0 0 1"
REPORT = "expected a report of sdftrack"


def bop_rows(*places):
    return BOP + "".join(bop_row(i, at(x)) for i, x in places)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.txt", tum_row(0) + tum_row(1, "0 0 1 0 0 0 0"), "line 2: the quaternion is 0"),
        ("a.txt", tum_row(0) + tum_row(0), "repeated at frames 0 and 1"),
        ("a.txt", tum_row(0) + "1 0 0\n", "line 2: expected 'timestamp tx ty tz qx qy qz qw'"),
        ("a.txt", "# timestamp\n", "expected at least one pose, but there is none"),
        ("a.txt", tum_row(0, "nan nan nan nan nan nan nan"), "a: lost in all frames"),
        ("a.txt", tum_row(0, "10 20 500 0 0 0 1"), r"500.* m from the origin; in mm\?"),
        ("a.txt", b"\xff\xfe\x00", "expected text, got a binary file"),
        ("a.csv", BOP + f"0,1,1,1.0,{IDENTITY[:-2]},0 0 1,0.1\n", "line 2: expected 'scene_id,"),
        ("a.csv", BOP + f"0,1,1,1.0,2{IDENTITY[1:]},0 0 1,0.1\n", "line 2, R"),
        ("a.csv", bop_rows((0, 0), (1, 0), (1_700_000_000, 0)), "numbered one after the other"),
        ("a.csv", bop_rows((0, 0), (0, 1), (1, 1), (1, 0)), "obj_id 1: .*rows 1 and 2 exchange their places between"),
        ("a.csv", bop_rows((0, 0), (0, 1), (1, 1)), "obj_id 1: .*image 1 has 1 and another 2"),
        ("a.xlsx", "x", r"cannot be read from '\.xlsx'; expected .*\.c3d"),
        ("report.json", "{", REPORT),
        ("report.json", '{"frames": [{}], "settings": {}}', REPORT),
    ],
)  # fmt: skip
def test_a_file_that_is_no_trajectory_is_refused_with_its_name(tmp_path, name, text, words):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=words) as error:
        st.motion.load(path, fps=30 if text[:5] == BOP[:5] else None)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


# -- arguments
def test_arguments_are_checked(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file or folder"):
        st.motion.load(tmp_path / "a.csv")
    with pytest.raises(ValueError, match=r"this folder has no report\.json"):
        st.motion.load(tmp_path)
    st.motion.save(tmp_path / "a.csv", trajectory())
    with pytest.raises(ValueError, match=r"unit: the columns of .*a.csv are in metres"):
        st.motion.load(tmp_path / "a.csv", unit="mm")


def test_save_refuses_what_it_cannot_write_and_writes_nothing(tmp_path):
    a = trajectory()
    for path, given_ones, words in (
        ("a.xlsx", a, "expected a suffix of"),
        ("a.csv", [a, a], "a different name for each, got 'cup' twice"),
    ):
        with pytest.raises(ValueError, match=words):
            st.motion.save(tmp_path / path, given_ones)
    with pytest.raises(ValueError, match=r"points: only a \.trc file has markers"):
        st.motion.save(tmp_path / "a.csv", a, points={"cup": {"rim": (0, 0, 1)}})
    with pytest.raises(FileNotFoundError, match="make it first"):
        st.motion.save(tmp_path / "no" / "a.csv", a)
    assert list(tmp_path.iterdir()) == []
