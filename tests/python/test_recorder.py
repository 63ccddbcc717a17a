# SPDX-License-Identifier: MIT
"""The files that a recorder leaves, and those that it must not."""

import csv
import errno
import json
import re
import struct
import threading
import tracemalloc

import numpy as np
import pytest
from tracking_fakes import CAMERA, Ball, frame, pose, result

import sdftrack as st
from sdftrack import recorder as recorder_module
from sdftrack.recorder import Recorder

OWN = {"poses.csv", "trajectory_0.txt", "overlay.mp4", "report.json", "report.html"}


def record(folder, n=4, status=None, **options):
    with Recorder(folder, CAMERA, Ball(), **options) as recorder:
        for i in range(n):
            T = pose(0.002 * i)
            s = None if status is None else [status[i]]
            recorder.add(frame(i, T), result([T], s, i), truth={0: T})
    return folder


def rows_of(folder):
    with (folder / "poses.csv").open() as f:
        return list(csv.DictReader(f))


def decoded(path):
    import av

    with av.open(str(path)) as video:
        return [picture.to_ndarray(format="rgb24") for picture in video.decode(video=0)]


def strict_json(path):
    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    return json.loads(path.read_text(), parse_constant=refuse)


def test_all_files_are_there_and_no_temporary_one(tmp_path):
    out = record(tmp_path / "new" / "deep")
    assert {p.name for p in out.iterdir()} == OWN | {"ground_truth_0.txt"}


def test_poses_are_bop_rows_in_millimetres(tmp_path):
    rows = rows_of(record(tmp_path, scene_id=7, obj_ids=[3]))
    assert list(rows[0]) == ["scene_id", "im_id", "obj_id", "score", "R", "t", "time"]
    assert [r["im_id"] for r in rows] == ["0", "1", "2", "3"]
    assert rows[1]["scene_id"] == "7"
    assert rows[1]["obj_id"] == "3"
    np.testing.assert_allclose(np.array(rows[1]["t"].split(), float), [2.0, 0.0, 500.0])
    np.testing.assert_allclose(np.array(rows[1]["R"].split(), float), np.eye(3).ravel())
    assert float(rows[1]["time"]) == pytest.approx(0.002)
    assert float(rows[1]["score"]) == pytest.approx(0.9)


def test_trajectory_is_tum_in_metres(tmp_path):
    rows = np.loadtxt(record(tmp_path) / "trajectory_0.txt")
    np.testing.assert_allclose(rows[2], [2 / 30, 0.004, 0, 0.5, 0, 0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(np.loadtxt(tmp_path / "ground_truth_0.txt"), rows)


def test_a_lost_object_and_a_bad_frame_have_no_row_but_are_reported(tmp_path):
    out = record(tmp_path, status=["ok", "lost", "bad_frame", "weak"])
    assert [r["im_id"] for r in rows_of(out)] == ["0", "3"]
    assert len(np.loadtxt(out / "trajectory_0.txt")) == 2
    frames = strict_json(out / "report.json")["frames"]
    assert [f["objects"][0]["status"] for f in frames] == ["ok", "lost", "bad_frame", "weak"]
    assert frames[1]["objects"][0]["covariance"] is None
    assert frames[1]["objects"][0]["pose"][0][3] == pytest.approx(0.002)


def test_report_has_the_documented_keys(tmp_path):
    report = strict_json(record(tmp_path, settings={"mode": "depth", "bad": float("nan")}) / "report.json")
    assert set(report) == {"version", "settings", "frames"}
    assert report["settings"]["mode"] == "depth"
    assert report["settings"]["bad"] is None
    assert set(report["frames"][0]) == {"im_id", "timestamp", "seconds", "objects"}
    assert set(report["frames"][0]["objects"][0]) == {
        "obj_id", "k", "name", "status", "reason", "confidence", "energy", "inliers", "pose", "covariance",
    }  # fmt: skip


def test_the_video_plays_in_a_browser(tmp_path):
    import av

    path = record(tmp_path, n=5) / "overlay.mp4"
    with av.open(str(path)) as video:
        stream = video.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert (stream.width, stream.height) == (160, 120)  # the odd row is cut
        assert float(stream.average_rate) == pytest.approx(30)
        assert sum(1 for _ in video.decode(stream)) == 5
    data, at, order = path.read_bytes(), 0, []
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        order.append(kind)
        at += size
    assert order.index(b"moov") < order.index(b"mdat")


def test_one_frame_is_a_video_too_but_not_when_not_asked_for_or_without_shapes(tmp_path):
    assert not (record(tmp_path / "a", video=False) / "overlay.mp4").exists()
    assert (record(tmp_path / "one", n=1) / "overlay.mp4").stat().st_size > 0
    none = record(tmp_path / "none", n=0)
    assert {p.name for p in none.iterdir()} == {"poses.csv", "report.json", "report.html"}
    assert strict_json(none / "report.json")["frames"] == []
    with Recorder(tmp_path / "b", CAMERA) as recorder:
        recorder.add(frame(), result([pose()]))
    assert not (tmp_path / "b" / "overlay.mp4").exists()


@pytest.mark.parametrize(
    ("error", "words"), [(KeyError("in the loop"), "'in the loop'"), (KeyboardInterrupt(), "interrupted")]
)
def test_files_are_whole_when_the_loop_raises_and_the_report_says_so(tmp_path, error, words):
    def loop():
        with Recorder(tmp_path / "cut", CAMERA, Ball()) as recorder:
            recorder.add(frame(0, pose()), result([pose()]))
            raise error

    with pytest.raises(type(error)):
        loop()
    assert {p.name for p in (tmp_path / "cut").iterdir()} == OWN
    report = strict_json(tmp_path / "cut" / "report.json")
    assert len(report["frames"]) == 1
    assert report["stopped"] == words
    assert "stopped" not in strict_json(record(tmp_path / "whole") / "report.json")


def test_overwrite_replaces_own_files_alone_and_drops_stale_ones(tmp_path):
    with Recorder(tmp_path, CAMERA, [Ball(), Ball()]) as recorder:
        recorder.add(frame(), result([pose(), pose(0.1)]))
    assert (tmp_path / "trajectory_1.txt").exists()
    (tmp_path / "mine.txt").write_text("keep")
    (tmp_path / "trajectory_9.txt").write_text("mine too")
    record(tmp_path, n=2, overwrite=True)
    assert (tmp_path / "mine.txt").read_text() == "keep"
    assert (tmp_path / "trajectory_9.txt").read_text() == "mine too"
    assert not (tmp_path / "trajectory_1.txt").exists()
    assert len(strict_json(tmp_path / "report.json")["frames"]) == 2


def test_old_files_stay_until_the_new_ones_are_whole(tmp_path):
    before = (record(tmp_path) / "poses.csv").read_text()
    recorder = Recorder(tmp_path, CAMERA, Ball(), overwrite=True)
    recorder.add(frame(), result([pose()]))
    assert (tmp_path / "poses.csv").read_text() == before
    recorder.close()
    assert (tmp_path / "poses.csv").read_text() != before


def test_a_full_disk_is_one_clear_error_and_leaves_nothing(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path, CAMERA, Ball())
    recorder.add(frame(), result([pose()]))
    recorder.add(frame(1), result([pose()]))

    def full(fd):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="out: no space left on the disk of") as caught:
        recorder.close()
    assert caught.value.errno == errno.ENOSPC
    assert list(tmp_path.iterdir()) == []
    recorder.close()  # again is harmless


def test_an_error_of_the_last_picture_is_raised_when_the_recorder_is_closed(tmp_path):
    class Broken(Ball):
        def render(self, camera, T_cam_obj):
            raise RuntimeError("no picture")

    recorder = Recorder(tmp_path, CAMERA, Broken())
    recorder.add(frame(), result([pose()]))
    with pytest.raises(RuntimeError, match="no picture"):
        recorder.close()
    assert list(tmp_path.iterdir()) == []


def test_a_live_recorder_never_waits_and_says_what_the_video_omits(tmp_path):
    let_go = threading.Event()

    class Slow(Ball):
        def render(self, camera, T_cam_obj):
            let_go.wait()
            return super().render(camera, T_cam_obj)

    recorder = Recorder(tmp_path, CAMERA, Slow(), live=True)
    for i in range(20):
        recorder.add(frame(i), result([pose()], i=i))
    let_go.set()
    recorder.close()
    assert recorder.omitted >= 20 - 1 - recorder_module.WAITING
    assert len(decoded(tmp_path / "overlay.mp4")) == 20 - recorder.omitted
    assert len(strict_json(tmp_path / "report.json")["frames"]) == 20


def test_memory_does_not_grow_with_the_number_of_frames(tmp_path):
    with Recorder(tmp_path, CAMERA) as recorder:
        one = result([pose()])
        for _ in range(50):
            recorder.add(frame(), one)
        tracemalloc.start()
        for _ in range(2000):
            recorder.add(frame(), one)
        grown = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()
    assert grown < 100_000  # the rows are 1 MB
    assert (tmp_path / "report.json").stat().st_size > 1_000_000


def test_a_section_and_files_of_others_stand_in_the_report_and_go_with_the_next_run(tmp_path):
    with Recorder(tmp_path / "out", CAMERA) as recorder:
        recorder.add(frame(), result([pose()]))
        (tmp_path / "out" / "mesh.ply").write_text("mine")
        recorder.wrote("mesh.ply")
        recorder.wrote("mesh.ply")
        recorder.note("shape", {"size_m": np.array([0.1, np.nan])})
        with pytest.raises(ValueError, match="frames"):
            recorder.note("frames", {})
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["shape"] == {"size_m": [0.1, None]}
    assert report["settings"]["files"].count("mesh.ply") == 1
    with Recorder(tmp_path / "out", CAMERA, overwrite=True) as recorder:
        recorder.wrote("mesh.ply")  # written again: it stays
    assert (tmp_path / "out" / "mesh.ply").is_file()
    with Recorder(tmp_path / "out", CAMERA, overwrite=True) as recorder:
        recorder.add(frame(), result([pose()]))
    assert not (tmp_path / "out" / "mesh.ply").exists()


def test_a_shape_that_grows_is_drawn_as_it_is_now(tmp_path):
    with Recorder(tmp_path, CAMERA, Ball()) as recorder:
        recorder.add(frame(), result([pose()]))
        recorder.add(frame(), result([pose()]), shapes=[st.SDF.sphere(0.02, voxels=32)])
    before, after = decoded(tmp_path / "overlay.mp4")
    assert np.abs(before.astype(int) - after).max() > 60


def test_page_says_how_each_object_was_followed(tmp_path):
    """Shares, the runs of frames without a pose with their first reason, and names as text, whatever is in them."""
    told = ["ok", "lost", "lost", "weak", "bad_frame", "ok", "ok", "ok"]
    record(tmp_path, 8, told, names=["<b>mug</b>"], settings={"sequence": "/there/kitchen & hall"})
    page = (tmp_path / "report.html").read_text()
    assert "<h1>kitchen &amp; hall</h1>" in page
    assert "&lt;b&gt;mug&lt;/b&gt;" in page
    assert "<b>mug" not in page
    assert re.findall(r'">([0-9.]+) %</b><span>([a-z ]+): (\d)', page) == [
        ("50.0", "ok", "4"), ("12.5", "weak", "1"), ("12.5", "bad frame", "1"), ("25.0", "lost", "2"),
    ]  # fmt: skip
    runs = re.findall(r'scope="row">(images? [0-9 to]+)</th><td>([a-z ]+)</td>', page)
    assert runs == [("images 1 to 2", "lost"), ("image 4", "bad frame")]
    assert 'src="overlay.mp4"' in page
    assert "<script" not in page
    assert "http" not in page


def test_page_has_objects_that_come_later(tmp_path):
    with Recorder(tmp_path, CAMERA, [Ball(), Ball()], video=False) as recorder:
        for i in range(4):
            poses = [pose(0.002 * i)] * (1 + i // 2)
            recorder.add(frame(i, poses[0]), result(poses, None, i))
    page = (tmp_path / "report.html").read_text()
    assert re.findall("status of the images ([0-9]+ to [0-9]+)", page) == ["0 to 3", "2 to 3"]
    assert page.count("<b style") == 2  # both were ok, whenever they were there


def test_page_of_a_long_run_is_small(tmp_path):
    record(tmp_path, 3000, video=False)
    assert (tmp_path / "report.html").stat().st_size < 40_000
    assert "<video" not in (tmp_path / "report.html").read_text()
