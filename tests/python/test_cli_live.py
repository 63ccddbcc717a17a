# SPDX-License-Identifier: MIT
"""The command live: cameras with faults, what a page asks for, files, streams, and its end."""

import json

import numpy as np
import pytest
from live_scene import CAMERA, Page, PatientCamera, recorded

import sdftrack as st
from sdftrack.cli import live as live_module
from sdftrack.cli.app import run
from sdftrack.cli.live import run as live_run
from sdftrack.live.camera import CAMERAS, CameraKind
from sdftrack.viz.viewer import Box, Click, Pause, Record, Save
from support.faulty_camera import FaultyCamera

FRAMES = 60
LOADING_S = 2.0  # of the shape, on a busy machine, before the first frame


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("live"), FRAMES)


def middle(seq, i):
    """The pixel at the duck's middle."""
    low, high = seq.models[1].bounds
    T = seq.ground_truth[i][0]
    return CAMERA.project((0.5 * (np.asarray(low) + high)) @ T[:3, :3].T + T[:3, 3])


def box_around(seq, i):
    points = seq.models[1].vertices @ seq.ground_truth[i][0][:3, :3].T + seq.ground_truth[i][0][:3, 3]
    px = CAMERA.project(points)
    low, high = px.min(axis=0) - 3, px.max(axis=0) + 3
    return ",".join(f"{v:.0f}" for v in (*low, *(high - low)))


@pytest.fixture
def faulty(monkeypatch, scene):
    """Registers the camera "faulty:" with these faults."""

    def register(**faults):
        def make(address, **_):
            register.camera = FaultyCamera(scene[0], **faults)
            register.camera._start += LOADING_S
            return register.camera

        monkeypatch.setitem(CAMERAS, "faulty", CameraKind("faulty", "", make))

    return register


def known(scene, start=None):
    """The arguments of an object whose shape and place are known."""
    model = ["--model", str(scene[1] / "duck.ply"), "--voxels", "50"]
    return [*model, "--init", start or f"box:{box_around(scene[0], 0)}"]


def live(scene, out, *more, camera="faulty:", start=None):
    object_ = [*known(scene, start), "--no-video", "--threads", "1"]
    return run(["live", "--camera", camera, *object_, "--out", str(out), *more])


def report_of(out):
    return json.loads((out / "report.json").read_text())["frames"]


def statuses(out):
    return [f["objects"][0]["status"] for f in report_of(out)]


def check_poses(scene, out, start):
    """Poses of frames that are ok are right, by the time at which the camera took them."""
    for frame in report_of(out):
        entry = frame["objects"][0]
        if entry["status"] == "ok":
            i = round((frame["timestamp"] - start) * 30)
            metres, radians = st.metrics.pose_error(np.array(entry["pose"]), scene[0].ground_truth[i][0])
            assert metres < 0.003
            assert radians < np.radians(3)


def test_poses_of_a_camera_are_written(scene, tmp_path, capsys):
    out = tmp_path / "out"
    assert live(scene, out, "--no-viewer", "--fps", "15", camera=f"replay:{scene[1] / 'seq'}") == 0
    assert {"poses.csv", "report.json", "report.html", "trajectory_0.txt"} == {p.name for p in out.iterdir()}
    said = capsys.readouterr()
    assert f"{len(report_of(out))} frames" in said.out
    assert "camera: replay of seq" in said.err
    assert statuses(out).count("ok") >= len(statuses(out)) - 1
    settings = json.loads((out / "report.json").read_text())["settings"]
    assert settings["command"] == "live"


def test_a_camera_with_every_fault_is_followed(scene, faulty, tmp_path, capsys):
    faulty(drop=[5, 6], repeat=[10], swap=[14], stall={20: 0.2}, unplugged=range(28, 40))
    out = tmp_path / "out"
    assert live(scene, out, "--no-viewer") == 0
    frames, status = report_of(out), statuses(out)
    assert "bad_frame" in status  # while it was unplugged
    gone = status.index("bad_frame")
    assert "is the cable connected" in frames[gone]["objects"][0]["reason"]
    assert status[-1] == "ok"  # found again
    check_poses(scene, out, faulty.camera._start)
    assert "Traceback" not in capsys.readouterr().err


@pytest.fixture
def page(monkeypatch, scene):
    """Registers a page, and the camera "faulty:" that waits for it."""

    def place(does, **faults):
        made = Page(does)
        monkeypatch.setattr(live_module, "_page", lambda *_: made)
        camera = lambda address, **_: PatientCamera(scene[0], made, **faults)  # noqa: E731
        monkeypatch.setitem(CAMERAS, "faulty", CameraKind("faulty", "", camera))
        return made

    return place


def test_a_click_starts_and_restarts_an_object(scene, page, tmp_path):
    click = middle(scene[0], 3)
    wall = (4.0, 4.0)
    made = page({3: [Click(0, *wall)], 4: [Click(0, *click)], 20: [Click(0, *click)]})
    assert live(scene, tmp_path / "out", start="view") == 0
    assert made.said[0] == "click on the object: duck"
    assert any("click on duck" in text for text in made.said[1:])  # the wall is not a duck
    assert made.said.count("duck: started") == 2
    results = [result for _, result, _ in made.shown]
    assert results[:4] == [None] * 4
    assert all(r is not None for r in results[4:])
    assert str(results[-1].status[0]) == "ok"
    assert made.shown[-1][2]["latency_s"] < 10


def test_a_box_starts_an_object_and_a_pause_holds_it(scene, page, tmp_path):
    box = [float(v) for v in box_around(scene[0], 2).split(",")]
    made = page({2: [Box(0, *box)], 10: [Pause(True)], 14: [Pause(False)]})
    out = tmp_path / "out"
    assert live(scene, out, start="view") == 0
    results = [result for _, result, _ in made.shown]
    assert [r is None for r in results[:16]] == [True] * 2 + [False] * 8 + [True] * 4 + [False] * 2
    assert len(report_of(out)) == sum(r is not None for r in results)


def test_the_user_records_and_saves(scene, page, tmp_path, monkeypatch):
    # as fast as the page takes frames, the disk may not follow
    monkeypatch.setattr(live_run, "WAITING", FRAMES)
    made = page({5: [Record(True)], 15: [Record(False), Save()], 20: [Record(True)]})
    out = tmp_path / "out"
    assert live(scene, out) == 0
    first, second = st.open_sequence(out / "recording_1"), st.open_sequence(out / "recording_2")
    assert len(first) == 10
    shown = [frame for frame, _, _ in made.shown]
    for a, b in zip(first, shown[5:15], strict=True):
        # half a unit: the synthetic depth is no sensor's
        assert np.abs(a.depth - b.depth).max() <= 0.00005 + 1e-6
        np.testing.assert_array_equal(a.color, b.color)
        assert a.timestamp == b.timestamp
    assert len(second) == len(shown) - 20  # ended with the command
    assert (out / "picture_1.png").is_file()
    assert "poses.csv" in {p.name for p in out.iterdir()}


def test_without_a_folder_nothing_is_written(scene, page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = page({5: [Record(True), Save()]})
    assert run(["live", "--camera", "faulty:", *known(scene), "-q"]) == 0
    assert [text for text in made.said if "--out" in text] == [
        "to record, start with --out DIR",
        "to save, start with --out DIR",
    ]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_an_unknown_object_is_reconstructed_and_its_mesh_grows(scene, page, tmp_path, monkeypatch):
    monkeypatch.setattr(live_run, "MESH_EVERY_S", 0.0)
    monkeypatch.setattr(live_run, "COPY_EVERY_S", 0.0)
    slow = dict.fromkeys(range(FRAMES), 0.05)  # for the thread that makes meshes
    made = page({1: [Save()], 2: [Click(0, *middle(scene[0], 2))], 40: [Save()]}, stall=slow)
    out = tmp_path / "out"
    arguments = ["--reconstruct", "--voxels", "60", "--no-video", "--out", str(out)]
    assert run(["live", "--camera", "faulty:", *arguments]) == 0
    assert "nothing to save yet: click on the object" in made.said
    mesh = st.Mesh.load(out / "mesh_1.ply")
    assert np.ptp(mesh.vertices, axis=0).max() == pytest.approx(0.2, abs=0.06)
    assert len(made.meshes) > 3
    assert made.shown[-1][2]["shapes"] is not None


def test_poses_go_to_streams(scene, faulty, tmp_path, capsys):
    pytest.importorskip("foxglove.websocket")
    faulty(real_time=False)
    mcap, out = tmp_path / "poses.mcap", tmp_path / "out"
    streams = ["--stream", "foxglove://127.0.0.1:0", "--stream", f"mcap:{mcap}"]
    assert live(scene, out, "--no-viewer", *streams) == 0
    said = capsys.readouterr()
    assert "in Foxglove, open a connection to ws://127.0.0.1:" in said.err
    assert "0 messages sent, 0 dropped" in said.out  # nobody listened
    assert said.out.count("messages sent") == said.err.count("stream: ") == 2
    assert mcap.stat().st_size > 1000
