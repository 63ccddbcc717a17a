# SPDX-License-Identifier: MIT
"""record, convert, synth: every layout returns what was written; interruptions and full disks lose nothing."""

import errno
import json
import os
import signal

import numpy as np
import pytest
from fault_runs import stopped

import sdftrack as st
from sdftrack._internal import files
from sdftrack.cli.app import run
from sdftrack.io.writers import WRITERS, Contents
from sdftrack.io.writers.base import DepthUnits

CAMERA = st.Camera(60.0, 61.0, 31.0, 23.5, 64, 48)
LAYOUTS = list(WRITERS)
CUBE = st.SDF.box((0.1, 0.1, 0.1), voxels=16).to_mesh()


def sensor_sequence(n=6, units_per_m=1000, seed=0):
    """Depth as a sensor delivers it, whole units; a moving pose."""
    rng = np.random.default_rng(seed)
    frames = [
        st.Frame(
            rng.integers(0, 4 * units_per_m, CAMERA.shape).astype(np.uint16),
            rng.integers(0, 256, (*CAMERA.shape, 3), np.uint8), timestamp=100 + i / 30,
            depth_scale=1 / units_per_m,
        )
        for i in range(n)
    ]  # fmt: skip
    poses = np.stack([st.geometry.pose(rng.uniform(-1, 1, 3), rng.uniform(-2, 2, 3)) for _ in range(n)])
    return st.Sequence(frames, CAMERA, poses, {1: CUBE})


def same(a, b):
    assert len(a) == len(b)
    for i, (x, y) in enumerate(zip(a, b, strict=True)):
        np.testing.assert_array_equal(x.depth, y.depth)
        np.testing.assert_array_equal(x.color, y.color)
        assert (y.error, y.index) == ("", i)
        assert x.timestamp == pytest.approx(y.timestamp, abs=1e-6)
        for k, T in a.ground_truth.get(i, {}).items():
            np.testing.assert_allclose(b.ground_truth[i][k], T, atol=1e-9, rtol=0)
    for name in ("fx", "fy", "cx", "cy", "width", "height"):
        assert getattr(a.camera.depth, name) == pytest.approx(getattr(b.camera.depth, name), abs=1e-12)


# Open3D's files hold millimetres and TUM's a fifth of that, BOP's and mcap any unit.
WAYS = [
    (there, back, units_per_m)
    for units_per_m, fit in (
        (1000, LAYOUTS), (5000, ["bop", "tum", "mcap"]), (10_000, ["bop", "mcap"]), (4000, ["bop", "mcap"]),
    )
    for there in fit
    for back in fit
]  # fmt: skip


@pytest.mark.parametrize(("there", "back", "units_per_m"), WAYS)
def test_sequences_go_through_two_layouts_and_come_back(tmp_path, there, back, units_per_m):
    seq = sensor_sequence(units_per_m=units_per_m)
    st.save_sequence(tmp_path / "0", seq, layout=there)
    assert run(["convert", str(tmp_path / "0"), "--to", back, "--out", str(tmp_path / "1"), "-q"]) == 0
    with st.open_sequence(tmp_path / "1") as read:
        assert read.layout == ("ros2" if back == "mcap" else back)
        same(seq, read)
        np.testing.assert_allclose(np.ptp(read.models[read.objects[0]].vertices, axis=0), 0.1, rtol=1e-6)


def test_metres_do_not_depend_on_the_unit_of_the_file():
    """The nearest float32 to a distance, by any unit of sensors that divides it."""
    mm = np.arange(1, 6500, dtype=np.uint16).reshape(1, -1)
    nearest = (np.arange(1, 6500) / 1000).astype(np.float32).reshape(1, -1)
    scales = ((1, 0.001), (1, float(np.float32(0.001))), (10, 0.0001), (5, 1 / 5000), (10, 0.1 * 1e-3))
    for factor, scale in scales:
        depth = st.Frame(mm * np.uint16(factor), depth_scale=scale, check_units=False).depth
        np.testing.assert_array_equal(depth, nearest)
    odd = st.Frame(mm, depth_scale=0.00123, check_units=False).depth  # no whole number of units per metre
    np.testing.assert_array_equal(odd, mm.astype(np.float32) * np.float32(0.00123))


def test_depth_that_no_unit_holds_is_rounded_and_said(tmp_path, capsys):
    rng = np.random.default_rng(1)
    depth = rng.uniform(0.7, 0.9, CAMERA.shape).astype(np.float32)
    st.save_sequence(tmp_path / "0", st.Sequence([st.Frame(depth, timestamp=1.0)], CAMERA))
    units = DepthUnits((1000,))
    stored, units_per_m = units.of(st.Frame(depth))
    assert (units_per_m, units.rounded_m) == (1000, 0.001)
    assert np.abs(stored / 1000 - depth).max() <= 0.0005 + 1e-6
    # The file holds tenths of a millimetre, and open3d whole ones.
    assert run(["convert", str(tmp_path / "0"), "--to", "open3d", "--out", str(tmp_path / "1")]) == 0
    assert "depth is rounded to 1 mm" in capsys.readouterr().out
    assert run(["convert", str(tmp_path / "0"), "--to", "bop", "--out", str(tmp_path / "2")]) == 0
    assert "rounded" not in capsys.readouterr().out


def test_an_interrupted_recording_is_continued(tmp_path):
    seq = sensor_sequence()
    for layout in LAYOUTS:
        folder = tmp_path / layout
        (folder / "mine").mkdir(parents=True)
        contents = Contents(seq.camera, seq.objects, seq.models)
        with WRITERS[layout](folder, contents) as writer:
            for i in range(3):
                writer.add(seq[i], seq.ground_truth[i])
        with (folder / ".frames.jsonl").open("ab") as file:
            file.write(b'{"im_id": 3, "cam')  # as a killed program leaves it
        with pytest.raises(ValueError, match="interrupted"):
            st.open_sequence(folder)
        other = Contents(st.RGBDCamera(st.Camera(61.0, 61.0, 31.0, 23.5, 64, 48)), seq.objects, seq.models)
        with pytest.raises(ValueError, match="different: camera"):
            WRITERS[layout](folder, other, resume=True)
        with WRITERS[layout](folder, contents, resume=True) as writer:
            assert writer.count == 3
            for i in range(3, len(seq)):
                writer.add(seq[i], seq.ground_truth[i])
            writer.finish()
        with st.open_sequence(folder) as read:
            same(seq, read)
        assert (folder / "mine").is_dir()  # no folder of the writer, although it is empty
        assert not list(folder.glob(".*"))


def test_convert_continues_after_it_was_killed(tmp_path):
    st.save_sequence(tmp_path / "0", sensor_sequence(300))
    arguments = ["convert", str(tmp_path / "0"), "--to", "tum", "--out", str(tmp_path / "1"), "-q"]
    journal = tmp_path / "1" / ".frames.jsonl"
    begun = lambda: journal.is_file() and journal.read_bytes().count(b"\n") > 5  # noqa: E731
    stopped(arguments, begun, by=signal.SIGKILL)
    assert not (tmp_path / "1" / "depth.txt").exists()
    assert run([*arguments]) == 1  # not without being told to
    assert run([*arguments, "--resume"]) == 0
    same(sensor_sequence(300), st.open_sequence(tmp_path / "1"))
    assert run([*arguments, "--resume"]) == 1  # nothing is left to continue


def test_a_full_disk_leaves_a_readable_bag(tmp_path, monkeypatch, capsys):
    st.save_sequence(tmp_path / "0", sensor_sequence())
    whole, written = files.UnbufferedFile.write, []

    def full_in_the_fourth_frame(self, data):
        written.append(len(data))
        if sum(written) > 4.5e4:  # frames have 14 kB
            self._file.write(data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "no space left on the disk")
        return whole(self, data)

    monkeypatch.setattr(files.UnbufferedFile, "write", full_in_the_fourth_frame)
    out = tmp_path / "1"
    assert run(["convert", str(tmp_path / "0"), "--to", "mcap", "--out", str(out), "-q"]) == 1
    assert "frames before that are in" in capsys.readouterr().err
    monkeypatch.undo()
    with pytest.warns(UserWarning, match="what is whole is used"):
        read = st.open_sequence(out)
    with read:
        assert 1 <= len(read) < 6
        same(sensor_sequence()[: len(read)], read)


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="needs a file system that reserves space")
def test_space_for_the_index_is_reserved(tmp_path):
    seq = sensor_sequence(1)
    with WRITERS["bop"](tmp_path, Contents(seq.camera, seq.objects, seq.models)) as writer:
        for i in range(3000):  # of small entries
            writer.journal.add(
                {"im_id": i, "camera": {"cam_K": list(range(9)), "depth_scale": 1.0}, "gt": []}
            )
            size = (tmp_path / ".frames.jsonl").stat().st_size
            assert (tmp_path / ".reserve").stat().st_size >= 2 * size
        writer.finish()
    cameras = json.loads((tmp_path / "scene_camera.json").read_text())
    assert len(cameras) == 3000
    assert not (tmp_path / ".reserve").exists()


def test_record_stores_every_frame_of_a_camera(tmp_path, capsys):
    seq = sensor_sequence(20)
    st.save_sequence(tmp_path / "0", seq)
    out = tmp_path / "1"
    assert run(["record", f"replay:{tmp_path / '0'}", "--fps", "100", "--out", str(out)]) == 0
    assert "20 frames written" in capsys.readouterr().out
    read = st.open_sequence(out)
    assert [f.depth.tobytes() for f in read] == [f.depth.tobytes() for f in seq]
    steps = np.diff([f.timestamp for f in read])
    assert np.median(steps) == pytest.approx(0.01, abs=0.005)
    some = ["--frames", "4", "--out", str(tmp_path / "2"), "-q"]
    assert run(["record", f"replay:{tmp_path / '0'}", *some]) == 0
    assert len(st.open_sequence(tmp_path / "2")) == 4


def test_overwrite_replaces_only_what_a_recording_wrote(tmp_path, capsys):
    st.save_sequence(tmp_path / "0", sensor_sequence())
    out = tmp_path / "1"
    arguments = ["convert", str(tmp_path / "0"), "--out", str(out), "-q"]
    assert run(arguments) == 0
    (out / "notes.txt").write_text("mine")
    assert run(arguments) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert run([*arguments, "--to", "tum", "--overwrite"]) == 0
    assert (out / "notes.txt").read_text() == "mine"
    assert st.open_sequence(out).layout == "tum"
    assert not (out / "scene_camera.json").exists()
    (tmp_path / "2").mkdir()
    (tmp_path / "2" / "notes.txt").write_text("mine")
    assert run(["convert", str(tmp_path / "0"), "--out", str(tmp_path / "2"), "--overwrite"]) == 1
    assert "got other files" in capsys.readouterr().err


def test_mcap_holds_both_cameras_models_and_any_depth(tmp_path):
    rng = np.random.default_rng(5)
    color = st.Camera(90.0, 90.0, 47.5, 35.5, 96, 72, (0.1, -0.05, 0.001, 0.002, 0.01))
    depth = st.Camera(60.0, 61.0, 31.0, 23.5, 64, 48, (0.02, 0.01, 0.0, 0.0, 0.001))
    camera = st.RGBDCamera(
        depth, color, T_color_depth=st.geometry.pose([0.01, -0.02, 0.03], [0.05, 0.001, 0.002])
    )
    frames = [
        st.Frame(
            rng.uniform(0.7, 0.9, depth.shape).astype(np.float32),
            rng.integers(0, 256, (*color.shape, 3), np.uint8),
            timestamp=1.7e9 + i / 30,
        )
        for i in range(3)
    ]
    poses = {
        i: {k: st.geometry.pose([0.1, 0.2 * k, 0.3], [0.1, 0.2, 1.0 + i]) for k in range(2)} for i in (0, 2)
    }
    seq = st.Sequence(frames, camera, poses, {7: CUBE, 3: CUBE}, objects=[7, 3])
    st.save_sequence(tmp_path / "s", seq, layout="mcap")
    with st.open_sequence(tmp_path / "s") as read:
        assert read.objects == [7, 3]
        assert sorted(read.models) == [3, 7]
        np.testing.assert_allclose(read.models[7].vertices, CUBE.vertices, atol=1e-6)
        assert sorted(read.ground_truth) == [0, 2]
        same(seq, read)
        np.testing.assert_allclose(read.camera.T_color_depth, camera.T_color_depth, atol=1e-9)
        assert read.camera.color == color
        assert read.camera.depth == depth


def test_other_programs_read_the_recording(tmp_path):
    from rosbags.highlevel import AnyReader

    st.save_sequence(tmp_path / "s", sensor_sequence(4), layout="mcap")
    with AnyReader([tmp_path / "s"]) as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == {
            "/camera/depth/image_raw": 4, "/camera/depth/camera_info": 4,
            "/camera/color/image_raw/compressed": 4, "/camera/color/camera_info": 4, "/ground_truth": 4,
        }  # fmt: skip
        connection, _, data = next(m for m in reader.messages() if m[0].topic == "/camera/depth/image_raw")
        image = reader.deserialize(data, connection.msgtype)
    assert image.encoding == "16UC1"
    units = image.data.view("<u2").reshape(image.height, image.width)
    np.testing.assert_array_equal(units / np.float32(1000), sensor_sequence(4)[0].depth)


@pytest.mark.parametrize("color", [None, st.Camera(90.0, 90.0, 47.5, 35.5, 96, 72)])
def test_colour_with_a_mapping_that_ros_cannot_state_is_kept_without_it(tmp_path, color):
    camera = st.RGBDCamera(CAMERA, color, projective=(CAMERA.K, np.zeros(3)))
    images = [
        f.replace(color=np.full((72, 96, 3), (10 * i, 200, 30), np.uint8))
        for i, f in enumerate(sensor_sequence(3))
    ]
    with pytest.warns(UserWarning, match="the mapping to colour is omitted"):
        st.save_sequence(tmp_path / "s", st.Sequence(images, camera), layout="mcap")
    with pytest.warns(UserWarning, match="are ignored: no fixed transform"):
        seq = st.open_sequence(tmp_path / "s")
    with seq:
        assert seq.camera.T_color_depth is None
        for i, frame in enumerate(seq):
            np.testing.assert_array_equal(frame.depth, images[i].depth)
            assert frame.color is None
        seq.take_unregistered_color()
        np.testing.assert_array_equal(seq[2].color, images[2].color)


def test_images_of_no_layout_are_converted_by_patterns(tmp_path):
    import cv2

    for i in range(12):
        (tmp_path / f"in/f{i}").mkdir(parents=True)
        cv2.imwrite(str(tmp_path / f"in/f{i}/depth.png"), np.full((48, 64), 1000 + i, np.uint16))
        cv2.imwrite(str(tmp_path / f"in/f{i}/color.png"), np.full((48, 64, 3), i, np.uint8))
    np.savetxt(tmp_path / "K.txt", [[60, 0, 31.5], [0, 60, 23.5], [0, 0, 1]])
    call = [
        "convert",
        str(tmp_path / "in"),
        "--out",
        str(tmp_path / "out"),
        "-q",
        "--color-glob",
        "*/color.png",
    ]
    assert run([*call, "--camera", str(tmp_path / "K.txt")]) == 2  # --depth-glob is missing
    assert run([*call, "--depth-glob", "*/nothing.png"]) == 1
    assert run([*call, "--camera", str(tmp_path / "K.txt"), "--depth-glob", "*/depth.png"]) == 0
    frames = [
        (round(1000 * float(f.depth[0, 0])), int(f.color[0, 0, 0]))
        for f in st.open_sequence(tmp_path / "out")
    ]
    assert frames == [(1000 + i, i) for i in range(12)]
