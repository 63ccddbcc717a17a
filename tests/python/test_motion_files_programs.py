# SPDX-License-Identifier: MIT
"""Trajectories for other programs: C3D through ezc3d, and the tables of OpenSim."""

import dataclasses
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs
from motion_recordings import poses, trajectory
from scipy.spatial.transform import Rotation

import sdftrack as st

FLOAT32 = 2.0**-24  # relative rounding: of lengths up to 1 m and of rotation matrices
PROJECTION = 3e-7  # a rounded rotation matrix, and the nearest rotation to it
GAPS = ["ok", "lost", "weak", "bad_frame", "ok", "ok", "lost", "ok"]
ROTATION_BYTES = 17 * 4


@pytest.fixture
def ezc3d():
    return pytest.importorskip("ezc3d", reason="ezc3d is not installed: pip install 'sdftrack[motion]'")


CORPUS = Path(__file__).parents[1] / "fuzz" / "corpus" / "motion"


# -- C3D
@settings(max_examples=8, deadline=None)  # each in a process of its own
@given(
    seed=hs.integers(0, 99), start_s=hs.floats(-1e6, 2e9),
    fps=hs.sampled_from([10.0, 25.0, 30.0, 60.0, 29.97, 240.0]),
    status=hs.lists(hs.sampled_from(["ok", "lost"]), min_size=5, max_size=5),
)  # fmt: skip
def test_a_c3d_file_gives_back_poses_to_single_precision(tmp_path_factory, seed, start_s, fps, status):
    pytest.importorskip("ezc3d")
    path = tmp_path_factory.mktemp("c3d") / "a.c3d"
    given_ones = [
        trajectory(6, seed + k, name, False, ["ok", *status], start_s, fps)
        for k, name in enumerate(("cup", "Teller 1"))
    ]
    st.motion.save(path, given_ones)
    read = st.motion.load(path)
    assert [t.name for t in read] == ["cup", "Teller 1"]
    for a, b in zip(given_ones, read, strict=True):
        assert b.status == a.status
        np.testing.assert_allclose(b.poses[b.usable], a.poses[a.usable], rtol=0, atol=PROJECTION)
        # The rate is of single precision; absolute times of 2e9 s have steps of 2.4e-7 s in double precision.
        np.testing.assert_allclose(b.times_s, a.times_s, rtol=0, atol=a.duration_s * FLOAT32 + 1e-6)
        assert (b.frame, b.covariances) == ("camera", None)


def test_ezc3d_reads_labels_rate_and_gaps_and_there_is_no_marker(tmp_path, ezc3d):
    a = trajectory(8, status=GAPS)
    st.motion.save(tmp_path / "a.c3d", a)
    file = ezc3d.c3d(str(tmp_path / "a.c3d"))
    rotation, point = file["parameters"]["ROTATION"], file["parameters"]["POINT"]
    assert (rotation["LABELS"]["value"], rotation["USED"]["value"][0]) == (["cup"], 1)
    assert rotation["RATIO"]["value"][0] == 1
    assert (point["RATE"]["value"][0], point["UNITS"]["value"], point["USED"]["value"][0]) == (30.0, ["m"], 0)
    data = file.c3d_swig.data()
    residuals = [data.frame(i).rotations().subframe(0).rotation(0).reliability() for i in range(8)]
    assert residuals == [-1.0 if s in ("lost", "bad_frame") else 0.0 for s in GAPS]
    matrices = file["data"]["rotations"][:, :, 0].transpose(2, 0, 1)
    np.testing.assert_allclose(matrices[a.usable], a.poses[a.usable], rtol=0, atol=FLOAT32)
    assert file["data"]["points"].shape == (4, 0, 8)
    assert st.motion.load(tmp_path / "a.c3d")[0].status == tuple("ok" if u else "lost" for u in a.usable)


def foreign(ezc3d, path, units="mm", rate=100.0, ratio=2, frames=5, labels=("hand", "thigh"), bodies=2):
    """A file as a program for motion capture writes it: millimetres, markers, bodies twice as often."""
    T = poses(max(1, bodies) * frames * ratio).reshape(max(1, bodies), -1, 4, 4)
    scaled = T.copy()
    scaled[..., :3, 3] *= {"mm": 1000, "m": 1, "cm": 100}.get(units, 1)
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = [units]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["M1"]
    file["data"]["points"] = np.ones((4, 1, frames))
    if bodies:
        file.add_parameter("ROTATION", "LABELS", list(labels))
        file["data"]["rotations"] = scaled.transpose(2, 3, 0, 1)
    file.write(str(path))
    return T


@pytest.mark.parametrize("units", ["mm", "m", "cm"])
def test_rigid_bodies_of_another_program_are_read_in_its_unit_and_rate(tmp_path, ezc3d, units):
    T = foreign(ezc3d, tmp_path / "a.c3d", units)
    read = st.motion.load(tmp_path / "a.c3d")
    assert [(t.name, t.frame) for t in read] == [("hand", "laboratory"), ("thigh", "laboratory")]
    for t, expected in zip(read, T, strict=True):
        np.testing.assert_allclose(t.poses, expected, rtol=0, atol=PROJECTION)
        np.testing.assert_allclose(t.times_s, np.arange(10) / 200, rtol=0, atol=1e-9)
    assert [t.name for t in st.motion.load(tmp_path / "a.c3d", name="thigh")] == ["thigh"]


def test_a_c3d_file_that_begins_later_keeps_the_time_of_its_first_frame(tmp_path, ezc3d):
    path = tmp_path / "a.c3d"
    foreign(ezc3d, path)
    content = bytearray(path.read_bytes())
    struct.pack_into("<2H", content, 6, 301, 305)  # frames are numbered from 1
    path.write_bytes(content)
    np.testing.assert_allclose(st.motion.load(path)[0].times_s, 3 + np.arange(10) / 200, atol=1e-9)
    np.testing.assert_allclose(st.motion.load(path, fps=50)[0].times_s, np.arange(10) / 50, atol=1e-9)


def test_a_matrix_with_the_residual_minus_one_is_a_gap(tmp_path, ezc3d):
    """Programs leave the last matrix there, which ezc3d hands on as if it were measured."""
    path = tmp_path / "a.c3d"
    foreign(ezc3d, path, bodies=1, labels=["hand"], ratio=1)
    block = int(ezc3d.c3d(str(path))["parameters"]["ROTATION"]["DATA_START"]["value"][0]) - 1
    content = bytearray(path.read_bytes())
    struct.pack_into("<f", content, 512 * block + 3 * ROTATION_BYTES + 64, -1.0)
    path.write_bytes(content)
    assert st.motion.load(path)[0].status == ("ok", "ok", "ok", "lost", "ok")


def test_a_c3d_file_with_markers_only_says_that_rigid_bodies_are_needed(tmp_path, ezc3d):
    foreign(ezc3d, tmp_path / "a.c3d", bodies=0)
    with pytest.raises(
        ValueError, match=r"a.c3d: expected rigid bodies \(the group ROTATION\), got 1 markers"
    ):
        st.motion.load(tmp_path / "a.c3d")


def test_a_c3d_file_of_unknown_unit_or_rate_asks_for_it(tmp_path, ezc3d):
    path = tmp_path / "a.c3d"
    T = foreign(ezc3d, path, "")
    with pytest.raises(ValueError, match=r"POINT:UNITS m, cm or mm, got ''; give unit='mm'"):
        st.motion.load(path)
    np.testing.assert_allclose(st.motion.load(path, unit="m")[0].poses, T[0], rtol=0, atol=PROJECTION)
    foreign(ezc3d, path, "in")
    with pytest.raises(ValueError, match="POINT:UNITS m, cm or mm, got 'in'"):
        st.motion.load(path)
    foreign(ezc3d, path, "mm")
    with pytest.raises(ValueError, match=r"unit: .*a.c3d is in mm \(POINT:UNITS\), got 'm'"):
        st.motion.load(path, unit="m")


@pytest.mark.parametrize("what", ["bodies", "markers", "own"])
def test_a_truncated_c3d_file_is_refused_in_one_line(tmp_path, ezc3d, what):
    """ezc3d itself ends the process for some of them, and takes what is missing for zeros in others."""
    if what == "own":
        st.motion.save(tmp_path / "whole.c3d", trajectory(8))
    else:
        foreign(ezc3d, tmp_path / "whole.c3d", bodies=2 if what == "bodies" else 0)
    content = (tmp_path / "whole.c3d").read_bytes()
    path = tmp_path / "cut.c3d"
    for size in (1, 2, 300, 679, 1600, len(content) - 513):  # the last block may be padding
        path.write_bytes(content[:size])
        with pytest.raises(ValueError, match=r"cut\.c3d: ") as error:
            st.motion.load(path)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (b"no C3D file at all", "it does not begin as one"),
        ("group_without_name.c3d", "(std::bad_alloc|ezc3d took more than)"),  # asks for all memory
        ("analog_channels.c3d", "it ended ezc3d"),
    ],
)
def test_a_damaged_c3d_file_neither_ends_nor_holds_up_the_process(tmp_path, ezc3d, content, words):
    path = tmp_path / "damaged.c3d"
    path.write_bytes(content if isinstance(content, bytes) else (CORPUS / content).read_bytes())
    with pytest.raises(ValueError, match=rf"damaged\.c3d: .*{words}"):
        st.motion.load(path)


def test_times_that_are_irregular_or_differ_are_refused_by_files_with_one_rate(tmp_path):
    pytest.importorskip("ezc3d")
    jumpy = st.motion.Trajectory([0, 0.1, 0.25, 0.3], poses(4), name="cup")
    other = st.motion.Trajectory([0, 0.1, 0.2, 0.3], poses(4), name="box")
    one = st.motion.Trajectory([0.5], poses(1), name="cup")
    for suffix in (".c3d", ".trc"):
        with pytest.raises(
            ValueError, match=r"irregular \(frame 2 is 50 ms off a rate of 10 Hz\); resample them first"
        ):
            st.motion.save(tmp_path / f"a{suffix}", jumpy)
        with pytest.raises(ValueError, match="takes two frames"):
            st.motion.save(tmp_path / f"a{suffix}", one)
    for suffix in (".c3d", ".trc", ".sto"):
        with pytest.raises(ValueError, match="'box' has other times than 'cup'"):
            st.motion.save(tmp_path / f"a{suffix}", [jumpy, other])
    assert list(tmp_path.iterdir()) == []


def test_what_a_c3d_file_cannot_hold_is_refused(tmp_path, ezc3d):
    with pytest.raises(ValueError, match="1 to 127 bytes"):
        st.motion.save(tmp_path / "a.c3d", trajectory(name="ä" * 64))
    a = trajectory()
    with pytest.raises(ValueError, match="one reference frame, got"):
        st.motion.save(tmp_path / "a.c3d", [a, dataclasses.replace(trajectory(name="box"), frame="table")])
    assert list(tmp_path.iterdir()) == []
    n = 65536
    long = st.motion.Trajectory(np.arange(n) / 100, np.tile(np.eye(4), (n, 1, 1)))
    with pytest.raises(ValueError, match="at most 65535 frames"):
        st.motion.save(tmp_path / "a.c3d", long)
    st.motion.save(tmp_path / "a.c3d", long.part(slice(1, None)))
    assert len(st.motion.load(tmp_path / "a.c3d")[0]) == n - 1


# -- OpenSim
def storage(path):
    """Names of a storage's columns, their kind, times (n,) and numbers (n, columns, size)."""
    head, _, table = path.read_text().partition("endheader\n")
    names, *rows = [line.split("\t") for line in table.splitlines()]
    numbers = [[cell.split(",") for cell in row[1:]] for row in rows]
    kind = head.split("DataType=")[1].split()[0]
    return names, kind, [float(row[0]) for row in rows], np.array(numbers, float)


def test_storages_have_orientations_and_positions(tmp_path):
    given_ones = [trajectory(8, status=GAPS), trajectory(8, 4, "Teller 1")]
    st.motion.save(tmp_path / "a.sto", given_ones)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.sto", "a_position.sto"]
    (_, turn_kind, _, q), (names, kind, times, p) = map(
        storage, (tmp_path / "a.sto", tmp_path / "a_position.sto")
    )
    assert (names, turn_kind, kind) == (["time", "cup", "Teller 1"], "Quaternion", "Vec3")
    np.testing.assert_array_equal(times, given_ones[0].times_s)
    for k, t in enumerate(given_ones):
        np.testing.assert_array_equal(np.isfinite(p[:, k]).all(axis=1), t.usable)
        np.testing.assert_allclose(p[t.usable, k], t.poses[t.usable, :3, 3], rtol=0, atol=1e-12)
        R = Rotation.from_quat(np.roll(q[t.usable, k], -1, axis=1)).as_matrix()  # w comes first
        np.testing.assert_allclose(R, t.poses[t.usable, :3, :3], rtol=0, atol=1e-9)


def test_quaternions_of_a_storage_do_not_jump_between_signs(tmp_path):
    turns = np.linspace(0, 4 * np.pi, 60)
    T = np.array([st.geometry.exp(np.r_[0, 0, 0, 0, 0, a]) for a in turns])
    st.motion.save(tmp_path / "a.sto", st.motion.Trajectory(np.arange(60) / 30, T, name="cup"))
    q = storage(tmp_path / "a.sto")[-1][:, 0]
    assert np.linalg.norm(np.diff(q, axis=0), axis=1).max() < 0.12  # half of a step of 0.21 rad
    np.testing.assert_allclose(q[:, 0], np.cos(turns / 2), atol=1e-9)


def test_markers_are_at_the_origin_and_at_points_of_the_caller(tmp_path):
    a = trajectory(8, status=GAPS)
    st.motion.save(tmp_path / "a.trc", [a, trajectory(8, 4, "box")], points={"cup": {"rim": (0, 0, 0.05)}})
    lines = [line.split("\t") for line in (tmp_path / "a.trc").read_text().splitlines()]
    assert lines[2] == ["30", "30", "8", "3", "mm", "30", "1", "8"]
    assert lines[3][2::3] == ["cup", "cup_rim", "box"]
    table = np.array(lines[6:], float)
    np.testing.assert_array_equal(table[:, 1], a.times_s)
    p = table[:, 2:].reshape(8, 3, 3)
    np.testing.assert_array_equal(np.isfinite(p[:, 0]).all(axis=1), a.usable)
    rim = a.poses[:, :3, :3] @ [0, 0, 0.05] + a.poses[:, :3, 3]
    np.testing.assert_allclose(p[a.usable, 0], 1e3 * a.poses[a.usable, :3, 3], rtol=0, atol=1e-9)
    np.testing.assert_allclose(p[a.usable, 1], 1e3 * rim[a.usable], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("points", "error", "words"),
    [
        ({"mug": {}}, ValueError, "expected names of the trajectories"),
        ({"cup": {"rim": (0, 1, np.nan)}}, ValueError, "three finite numbers"),
        ({"cup": {"a\tb": (0, 0, 0)}}, ValueError, "no tab"),
        ({"cup": {"lid": (0, 0, 0)}}, ValueError, "two markers would have the name 'cup_lid'"),
    ],
)
def test_points_that_cannot_be_markers_are_refused(tmp_path, points, error, words):
    with pytest.raises(error, match=words):
        st.motion.save(tmp_path / "a.trc", [trajectory(), trajectory(seed=3, name="cup_lid")], points=points)
    assert list(tmp_path.iterdir()) == []


def test_names_that_opensim_cannot_read_are_refused(tmp_path):
    with pytest.raises(ValueError, match="no tab, no line break"):
        st.motion.save(tmp_path / "a.sto", trajectory(name="a\tb"))
    assert list(tmp_path.iterdir()) == []
