# SPDX-License-Identifier: MIT
"""The viewer's server side, without a browser: what it draws and when, what is asked of it, what commands show."""

import gc
import json
import socket
import subprocess
import sys
import threading
import time
import weakref

import numpy as np
import pytest
from refusals import assert_refused, refused
from viewer_scene import CAMERA, drawn, quaternion_matrix, scene, wait_until, watched

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.cli.view import load_recording
from sdftrack.contour.drawing import draw_outline
from sdftrack.io.report_file import result_of
from sdftrack.viz.viewer import Box, Click, Viewer
from sdftrack.viz.viewer.drawer import Drawer
from sdftrack.viz.viewer.drawing import cloud, ellipsoid, object_rgb, trail_segments
from sdftrack.viz.viewer.panel import lines_html, rates_html
from sdftrack.viz.viewer.scene import place_board

pytest.importorskip("viser", reason="viser is not installed: pip install 'sdftrack[viewer]'")

SHOW_S = 0.5e-3  # the promise; measured 0.1 ms on two busy cores
BALL = st.SDF.sphere(0.05, voxels=24)


@pytest.fixture
def viewer():
    _, sdf, _ = scene()
    with Viewer(sdf, CAMERA, ["duck"], port=0) as made:
        yield made


def told(*statuses, pose=np.eye(4), reason=""):  # noqa: B008  (not changed)
    """A result as a report states it."""
    about = {"pose": pose.tolist(), "reason": reason, "confidence": 0.25}
    return result_of({"objects": [{**about, "status": status} for status in statuses]})


# -- What is drawn, and when
def test_show_returns_at_once_and_nothing_is_drawn_while_no_page_is_open(viewer):
    sequence, _, results = scene()
    depth = np.kron(sequence[0].depth, np.ones((2, 2), np.float32))
    frame = st.Frame(depth, camera=CAMERA.scaled(2.0))
    times = []
    for _ in range(200):
        began = time.perf_counter()
        viewer.show(frame, results[0], latency_s=0.02, dropped=0)
        times.append(time.perf_counter() - began)
    assert np.median(times) < SHOW_S
    time.sleep(0.2)
    assert viewer._drawer.drawn == 0
    assert viewer.picture is None


def test_the_newest_frame_is_drawn_once_a_page_opens(viewer, monkeypatch):
    sequence, sdf, results = scene()
    for frame, result in zip(sequence, results, strict=True):
        viewer.show(frame, result, latency_s=0.021, dropped=3)
    with watched(viewer, monkeypatch):
        wait_until(lambda: viewer.picture is not None)
        wait_until(lambda: viewer._drawer.drawn == 1)
        assert viewer._drawer.error is None
        expected = st.draw(sequence[5], results[5], sdf, CAMERA, names=["duck"])
        np.testing.assert_array_equal(viewer.picture, expected)
        node = viewer._server.viser.scene.get_handle_by_name("/object_0")
        np.testing.assert_allclose(node.position, results[5].pose[:3, 3], atol=1e-6)
        R = results[5].pose[:3, :3]
        np.testing.assert_allclose(quaternion_matrix(node.wxyz), R, atol=1e-6)
        assert "latency 21 ms, 3 dropped" in viewer._panel._rates.content
        assert len(viewer._history.confidences(1)[0]) == 6  # also those of frames that were not drawn


def test_frames_without_result_lost_objects_and_bad_frames_are_shown(viewer, monkeypatch):
    sequence, _, results = scene()
    lost = told("lost", pose=results[0].pose, reason="gone")
    bad = st.Frame.unreadable("unplugged")
    with watched(viewer, monkeypatch):
        shown = ((sequence[0], None), (sequence[1], lost), (bad, lost), (sequence[2], results[2]))
        for count, (frame, result) in enumerate(shown, 1):
            viewer.show(frame, result)
            drawn(viewer, count)
            if result is lost:
                node = viewer._server.viser.scene.get_handle_by_name("/object_0")
                assert 0 < node.opacity < 1
                assert "gone" in viewer._panel._lines.content
    assert node.opacity is None


def test_an_outline_is_drawn_where_a_mask_is_given(viewer, monkeypatch):
    sequence, sdf, results = scene()
    mask = sdf.silhouette(CAMERA, results[0].pose)
    color = st.Frame(None, sequence[0].color)
    unposed = dict(vars(results[0]), poses=np.full((1, 4, 4), np.nan), covariances=np.full((1, 6, 6), np.nan))
    with watched(viewer, monkeypatch):
        viewer.show(color, st.TrackResult(**unposed), mask=mask)
        drawn(viewer, 1)
        np.testing.assert_array_equal(viewer.picture, draw_outline(color.color, mask, "ok"))
        viewer.show(color, st.TrackResult(**unposed))
        drawn(viewer, 2)


@pytest.fixture
def viewer_of_two():
    _, sdf, _ = scene()
    with Viewer([sdf, BALL], CAMERA, ["duck", "ball"], port=0) as made:
        yield made


def test_a_grown_mesh_replaces_the_model_of_one_of_two(viewer_of_two, monkeypatch):
    sequence, _, results = scene()
    viewer = viewer_of_two
    two = told("ok", "ok", pose=results[0].pose)
    grown = st.SDF.box([0.05, 0.05, 0.05], voxels=16).to_mesh()
    viewer.set_mesh(0, grown)
    with watched(viewer, monkeypatch):
        viewer.show(sequence[0], two)
        drawn(viewer, 1)
        get_node = viewer._server.viser.scene.get_handle_by_name
        assert len(get_node("/object_0").vertices) == len(grown.vertices)
        assert len(get_node("/object_1").vertices) == len(BALL.to_mesh().vertices)
    assert viewer._panel._choice.options == ("duck", "ball")


def test_a_trail_grows_in_its_objects_colour(viewer, monkeypatch):
    sequence, _, results = scene()
    with watched(viewer, monkeypatch):
        for i in range(4):
            viewer.show(sequence[i], results[i])
            drawn(viewer, i + 1)
        trail = viewer._server.viser.scene.get_handle_by_name("/trail_0")
        np.testing.assert_allclose(trail.points[:, 1], [r.pose[:3, 3] for r in results[1:4]], atol=1e-6)
        # One colour, not one per point: browsers draw a line white whose colours change in kind.
        np.testing.assert_array_equal(trail.colors, object_rgb(0))


def test_a_thread_that_fails_to_draw_goes_on(caplog):
    drawn = []

    def draw(item):
        if item == 1:
            raise RuntimeError("no")
        drawn.append(item)

    drawer = Drawer(draw, lambda: True, 1000.0)
    drawer.offer(1)
    wait_until(lambda: drawer.error is not None)
    drawer.offer(2)
    wait_until(lambda: drawn == [2])
    drawer.close()
    assert "not drawn" in caplog.text


def test_drawing_keeps_to_its_rate_and_takes_the_newest():
    drawn = []
    drawer = Drawer(lambda item: drawn.append((time.monotonic(), item)), lambda: True, 20.0)
    end = time.monotonic() + 0.5
    n = 0
    while time.monotonic() < end:
        n += 1
        drawer.offer(n)
        time.sleep(0.001)
    wait_until(lambda: drawn[-1][1] == n)
    drawer.close()
    assert np.diff([t for t, _ in drawn]).min() > 0.045
    assert drawer.replaced == n - len(drawn)


def wrong(**change):
    Viewer(**{"shapes": BALL, "camera": CAMERA, "port": 0, **change})


def view_of(frames=None, results=None, *shapes, **change):
    sequence, _, tracked = scene()
    st.view(
        sequence if frames is None else frames, tracked if results is None else results, *shapes, **change
    )


@refused(
    (lambda: wrong(names=["a", "b"]), ValueError, "names: expected 1, one per shape, got 2"),
    (lambda: wrong(token="a/b"), ValueError, "token: expected letters"),
    # An address of documentation, of no computer.
    (lambda: wrong(host="192.0.2.1"), OSError, r"host and port: http://192\.0\.2\.1:0: expected a name"),
    (lambda: view_of(None, scene()[2][:2], BALL), ValueError, "results: expected 6, one per frame, got 2"),
)
def test_wrong_arguments_are_named(call, error, words):
    assert_refused(call, error, words)


def test_more_poses_than_shapes_and_meshes_of_no_object_are_refused(viewer):
    with pytest.raises(ValueError, match="result: expected at most 1 objects"):
        viewer.show(scene()[0][0], told("lost", "lost"))
    with pytest.raises(ValueError, match=r"k: expected 0\.\.0, got 1"):
        viewer.set_mesh(1, BALL.to_mesh())


# -- Geometry and texts
def test_points_of_the_cloud_project_to_their_pixels():
    sequence, _, _ = scene()
    points, colors = cloud(sequence[0], CAMERA, 10.0)
    assert points.dtype == np.float32
    assert colors.shape == points.shape
    px = CAMERA.project(points.astype(np.float64))
    np.testing.assert_allclose(px, px.round(), atol=1e-3)
    at = px.round().astype(int)
    np.testing.assert_allclose(points[:, 2], sequence[0].depth[at[:, 1], at[:, 0]])
    np.testing.assert_array_equal(colors, sequence[0].color[at[:, 1], at[:, 0]])


def test_the_axes_of_the_ellipsoid_are_three_standard_deviations():
    rng = np.random.default_rng(3)
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    sd = np.array([0.001, 0.002, 0.004])
    C = np.zeros((6, 6))
    C[:3, :3] = R @ np.diag(sd**2) @ R.T
    axes, turned = ellipsoid(C)
    np.testing.assert_allclose(axes, 3 * sd)
    assert np.linalg.det(turned) == pytest.approx(1)
    np.testing.assert_allclose(turned @ np.diag(axes**2) @ turned.T, 9 * C[:3, :3], atol=1e-12)
    assert ellipsoid(np.full((6, 6), np.nan)) is None


def test_a_ray_from_any_point_of_view_meets_the_pixel_that_it_goes_through():
    board = place_board(CAMERA, 0.8)
    for eye in ((0, 0, 0), (0.5, -0.4, -1.2), (-2.0, 1.0, 0.1)):
        np.testing.assert_allclose(board.pixel(eye, board.point(120, 130)), (120, 130))
        assert board.pixel(eye, 2 * np.array(eye) - board.point(120, 130)) is None  # behind


def test_a_trail_is_interrupted_where_the_object_was_lost():
    p = np.array([[0, 0, 1], [0, 0, 2], [np.nan] * 3, [0, 0, 3], [0, 0, 4]], float)
    np.testing.assert_array_equal(trail_segments(p)[:, :, 2], [[1, 2], [3, 4]])
    assert trail_segments([]).shape == (0, 2, 3)


def test_texts_are_escaped_and_unknown_numbers_left_out():
    result = told("weak", reason="a < b")
    text = lines_html(result, ["<script>"], ["click on <the part>"])
    assert "<div>click on &lt;the part&gt;</div>" in text
    assert "&lt;script&gt;" in text
    assert "a &lt; b" in text
    assert "weak 0.25" in text
    assert "30.0 frames/s, latency 12 ms, 3 dropped" in rates_html(30.0, 0.012, 3)
    assert "latency" not in rates_html(30.0, float("nan"), None)


# -- Requests and the end
def test_requests_come_in_order_for_the_chosen_object(viewer_of_two):
    viewer = viewer_of_two
    viewer._pointed(Click, 3.0, 4.0)
    viewer._panel._choice.value = "ball"
    viewer._pointed(Box, 1.0, 2.0, 30.0, 40.0)
    assert viewer.requests() == [Click(0, 3.0, 4.0), Box(1, 1.0, 2.0, 30.0, 40.0)]
    assert viewer.requests() == []


def test_closing_ends_all_threads_keeps_no_viewer_and_says_nothing(capfd):
    _, sdf, _ = scene()
    before = set(threading.enumerate())
    closed = []
    for _ in range(20):
        with Viewer(sdf, CAMERA, port=0) as viewer:
            closed.append(weakref.ref(viewer))
    del viewer
    wait_until(lambda: set(threading.enumerate()) <= before)
    gc.collect()
    assert [viewer for viewer in closed if viewer() is not None] == []
    out, err = capfd.readouterr()
    assert out == ""
    assert "viser" not in err


def test_a_connection_that_says_nothing_does_not_hinder_closing():
    _, sdf, _ = scene()
    viewer = Viewer(sdf, CAMERA, port=0)
    with socket.create_connection(("127.0.0.1", viewer._server.port)):
        time.sleep(0.1)
        began = time.monotonic()
        viewer.close()
        assert time.monotonic() - began < 3
    viewer.close()


# -- st.view and the command
def test_view_moves_to_the_frame_that_is_asked_for(monkeypatch):
    sequence, sdf, results = scene()
    with st.view(sequence, results, sdf, port=0) as viewer, watched(viewer, monkeypatch):
        wait_until(lambda: viewer._drawer.drawn > 0)
        viewer._at_close[0].__self__.go_to(4)
        expected = st.draw(sequence[4], results[4], sdf, CAMERA, names=["object 0"])
        wait_until(lambda: viewer.picture is not None and np.array_equal(viewer.picture, expected))
        assert len(viewer._history.confidences(1)[0]) == 6
        assert not viewer._panel._pause.visible  # nothing runs that could be paused
        assert "frames/s" not in viewer._panel._rates.content
        assert f'src="{viewer.url}"' in viewer._repr_html_()


def test_view_of_one_frame_and_of_a_sequence_alone():
    sequence, sdf, results = scene()
    with st.view(sequence[0], results[0], sdf, camera=CAMERA, port=0):
        pass
    with st.view(sequence, port=0):
        pass
    with st.view(sequence, results, port=0) as viewer:  # shapes: the models of the sequence
        assert len(viewer._shapes) == 1


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """A recording, the mesh in millimetres, and the output folder of track."""
    folder = tmp_path_factory.mktemp("view")
    sequence, _, _ = scene()
    st.save_sequence(folder / "recording", sequence, layout="bop")
    mesh = st.synth.duck_mesh()
    st.Mesh(1000 * mesh.vertices, mesh.faces, mesh.colors).save(folder / "duck.ply")
    arguments = ["track", str(folder / "recording"), "--model", str(folder / "duck.ply"), "--unit", "mm"]
    arguments += ["--voxels", "60", "--no-video", "--quiet", "--stop", "4", "--out", str(folder / "tracked")]
    assert run(arguments) == 0
    return folder


def test_a_result_folder_is_read_as_it_was_tracked(tracked):
    shown = load_recording(tracked / "tracked", None, {"layout": "auto"}, None)
    assert (len(shown.frames), len(shown.results), shown.names) == (4, 4, ["duck"])
    rows = json.loads((tracked / "tracked" / "report.json").read_text())["frames"]
    for row, result in zip(rows, shown.results, strict=True):
        np.testing.assert_allclose(result.pose, row["objects"][0]["pose"])
        assert str(result.status[0]) == row["objects"][0]["status"]
    size = np.ptp(shown.meshes[0].vertices, axis=0)
    np.testing.assert_allclose(size, np.ptp(st.synth.duck_mesh().vertices, axis=0), rtol=1e-4)  # metres
    shown.close()


def test_a_moved_sequence_is_given_and_another_one_refused(tracked, tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        load_recording(tracked / "tracked", str(tmp_path / "nowhere"), {"layout": "auto"}, None)
    sequence, _, _ = scene()
    st.save_sequence(tmp_path / "short", sequence[:2], layout="bop")
    with pytest.raises(ValueError, match="has no"):
        load_recording(tracked / "tracked", str(tmp_path / "short"), {"layout": "auto"}, None)
    shown = load_recording(tracked / "tracked", str(tracked / "recording"), {"layout": "auto"}, None)
    assert len(shown.frames) == 4
    shown.close()


def test_ctrl_c_ends_the_command_with_0(tracked):
    command = f"-m sdftrack view {tracked / 'duck.ply'} --unit mm --port 0".split()
    with subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as running:
        assert "http://localhost:" in running.stdout.readline()
        running.send_signal(2)
        out, err = running.communicate(timeout=30)
    assert (running.returncode, out, err) == (0, "", "")


def test_the_save_button_writes_the_shown_image(tracked, tmp_path, capsys):
    import cv2

    from sdftrack.cli.view import _save
    from sdftrack.viz.viewer import Save

    class Shown:
        picture = np.full((4, 5, 3), (10, 20, 30), np.uint8)

        def requests(self):
            return [Save()]

    (tmp_path / "view_000001.png").write_text("of another run")
    _save(Shown(), tmp_path)
    _save(Shown(), tmp_path)
    _save(Shown(), None)
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"view_00000{n}.png" for n in range(3)]
    assert (tmp_path / "view_000001.png").read_text() == "of another run"
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "view_000002.png"))[0, 0], (30, 20, 10))
    assert "not saved" in capsys.readouterr().out
