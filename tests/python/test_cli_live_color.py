# SPDX-License-Identifier: MIT
"""The command live by colour alone: a webcam with a stand-in for OpenCV's capture, and the colour of other cameras."""

import json
import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import test_webcam
from live_scene import CAMERA, Page, PatientCamera, box_of, recorded
from refusals import error_line

import sdftrack as st
from sdftrack.cli import live as live_module
from sdftrack.cli.app import run
from sdftrack.imaging.pose_hint import moved_into
from sdftrack.io.frames import read_mask
from sdftrack.live.camera import CAMERAS, CameraKind
from sdftrack.synth.objects import duck_mesh
from sdftrack.viz.viewer import Box, Click, Record, Save

FRAMES = 40
LEAST_IOU = 0.85  # of outlines with the true silhouettes; measured 0.95
FARTHEST_M = 0.01  # poses by colour alone, whose distance is uncertain; measured 0.003


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("color"), FRAMES)


@pytest.fixture(scope="module")
def silhouettes(scene):
    """Of the object in each frame."""
    shape = st.SDF.from_mesh(scene[0].models[1], voxels=60)
    return [shape.silhouette(CAMERA, scene[0].ground_truth[i][0]) for i in range(FRAMES)]


def box_option(mask):
    return "box:" + ",".join(str(v) for v in box_of(mask))


class Capture(test_webcam.Capture):
    """Shows the frames of a sequence, then is ended by Ctrl-C."""

    size, frames, shown, page = (320, 240), (), 0, None

    def grab(self):
        mine = type(self)
        if mine.page is None:
            time.sleep(0.02)
        else:
            mine.page.wait_for(mine.shown - 1)
        if mine.shown == len(mine.frames):
            raise KeyboardInterrupt
        mine.shown += 1
        return True

    def retrieve(self):
        return True, np.ascontiguousarray(self.frames[self.shown - 1].color[..., ::-1])


@pytest.fixture
def webcam(monkeypatch, scene):
    class Fresh(Capture):
        frames = tuple(scene[0])

    monkeypatch.setattr(cv2, "VideoCapture", Fresh)
    monkeypatch.setattr("sdftrack.live.webcam._video_devices", lambda: None)
    # Times are those of the frames, however busy the machine is.
    start = time.time()
    clock = SimpleNamespace(time=lambda: start + Fresh.shown / 30)
    monkeypatch.setattr("sdftrack.live.webcam.time", clock)
    return Fresh


@pytest.fixture
def page(monkeypatch):
    def place(does):
        made = Page(does)
        monkeypatch.setattr(live_module, "_page", lambda *_: made)
        monkeypatch.setattr(Capture, "page", made)
        return made

    return place


@pytest.fixture
def rgbd(monkeypatch, page):
    """Registers the camera "faulty:", which has depth as well, and a page."""

    def register(seq):
        made = page({})
        camera = lambda address, **_: PatientCamera(seq, made)  # noqa: E731
        monkeypatch.setitem(CAMERAS, "faulty", CameraKind("faulty", "", camera))
        return made

    return register


def contour(out, *more, camera="webcam:0"):
    return run(["live", "--camera", camera, "--contour", "--out", str(out), *more])


def known(scene, out, *more, camera="webcam:0", init=True):
    start = ["--init", str(scene[1] / "poses.json")] if init else []
    model = ["--model", str(scene[1] / "duck.ply"), "--voxels", "50"]
    arguments = ["--mode", "rgb", "--no-video", "--threads", "1", "--out", str(out), *more]
    return run(["live", "--camera", camera, *model, *start, *arguments])


def rows_of(out):
    return json.loads((out / "result.json").read_text())["frames"]


def objects_of(out):
    return [f["objects"][0] for f in json.loads((out / "report.json").read_text())["frames"]]


def scores(out, silhouettes, first=0):
    """IoU of the masks; a frame is found by the outline that is nearest."""
    masks = [read_mask(out / f"mask/{row['frame']:06d}.png") for row in rows_of(out)]
    return [max(st.metrics.iou(mask, true) for true in silhouettes[first:]) for mask in masks]


# -- outlines
def test_the_outline_in_a_webcams_images_is_written_as_by_contour(
    webcam, scene, silhouettes, tmp_path, capsys
):
    out = tmp_path / "out"
    assert contour(out, "--no-viewer", "--init", box_option(silhouettes[0])) == 0
    assert {p.name for p in out.iterdir()} == {"mask", "overlay.mp4", "result.json"}
    report = json.loads((out / "result.json").read_text())
    rows = report["frames"]
    assert len(rows) > FRAMES / 2
    assert [row["frame"] for row in rows] == list(range(len(rows)))
    assert {row["status"] for row in rows} == {"ok"}
    assert np.all(np.diff([row["timestamp"] for row in rows]) > 0)
    assert min(scores(out, silhouettes)) > LEAST_IOU
    wanted = {"command": "contour", "source": "webcam:0", "warp": "similarity"}
    assert wanted.items() <= report["settings"].items()
    said = capsys.readouterr()
    assert f"{len(rows)} frames" in said.out
    assert "camera: webcam 0" in said.err
    assert "intrinsics" not in said.err  # an outline needs none


def test_a_box_on_the_page_starts_the_outline_and_starts_it_again(webcam, silhouettes, page, tmp_path):
    nowhere = [Box(0, 400.0, 10.0, 20.0, 20.0)]
    does = {
        3: [Click(0, 100.0, 100.0)], 5: [Box(0, *box_of(silhouettes[5]))], 15: nowhere,
        20: [Box(0, *box_of(silhouettes[20]))], 22: [Save(), Record(True)],
    }  # fmt: skip
    made = page(does)
    out = tmp_path / "out"
    assert contour(out, "--init", "view") == 0
    assert made.said[0] == "drag a box around the object: object"
    assert any("a click does not tell its size" in text for text in made.said)
    assert any("expected a box in the 320 x 240 image" in text for text in made.said)
    assert made.said.count("object: started") == 2
    assert any("to record, follow an object by depth" in text for text in made.said)
    assert (out / "picture_1.png").is_file()
    results = [result for _, result, _ in made.shown]
    assert [r is None for r in results[:7]] == [True] * 5 + [False] * 2
    assert all(about["mask"] is not None for _, result, about in made.shown if result is not None)
    assert {str(r.status[0]) for r in results[5:]} == {"ok"}
    assert min(scores(out, silhouettes)) > LEAST_IOU


def test_outlines_of_a_camera_with_depth_are_of_its_colour_image(scene, silhouettes, rgbd, tmp_path):
    """Its colour camera looks from elsewhere, with another size; some frames come without colour."""
    color = st.Camera(131.25, 131.25, 79.5, 59.5, 160, 120)
    rig = st.RGBDCamera(CAMERA, color, T_color_depth=st.geometry.pose([0, 0, 0], [0.02, 0, 0]))
    frames = [f.replace(color=np.ascontiguousarray(f.color[::2, ::2])) for f in scene[0]]
    for i in (0, 12):
        frames[i] = frames[i].replace(color=None)
    made = rgbd(st.Sequence(frames, rig))
    out = tmp_path / "out"
    small = silhouettes[1][::2, ::2]
    assert contour(out, "--init", box_option(small), camera="faulty:") == 0
    rows = rows_of(out)
    bad = [row for row in rows if row["status"] == "bad_frame"]
    assert {row["reason"] for row in bad} == {"this frame has no colour image"}
    assert rows[0]["status"] == rows[-1]["status"] == "ok"
    assert read_mask(out / "mask/000000.png").shape == (120, 160)
    assert st.metrics.iou(read_mask(out / "mask/000000.png"), small) > 0.8
    shown = [frame for frame, _, _ in made.shown if frame.color is not None]
    assert all(frame.depth is None and frame.camera is None for frame in shown)


def test_a_camera_without_colour_is_refused_in_one_line(scene, rgbd, tmp_path, capsys):
    rgbd(st.Sequence([f.replace(color=None) for f in scene[0][:30]], CAMERA))
    assert contour(tmp_path / "out", "--init", "box:9,9,9,9", "-q", camera="faulty:") == 1
    assert "--contour: expected colour images" in error_line(capsys)
    assert not (tmp_path / "out").exists()


# -- known shapes
def check_poses(scene, out):
    """Poses are those of some frame: the camera's times do not tell which. By colour alone they are never "ok"."""
    metres, radians = [], []
    for entry in objects_of(out):
        if entry["status"] == "weak":
            errors = [
                st.metrics.pose_error(np.array(entry["pose"]), scene[0].ground_truth[i][0])
                for i in range(FRAMES)
            ]
            metres.append(min(m for m, _ in errors))
            radians.append(min(r for _, r in errors))
    assert max(metres) < FARTHEST_M
    assert max(radians) < np.radians(5)


def test_a_known_shape_is_followed_in_a_webcams_images(webcam, scene, page, tmp_path, capsys):
    page({})
    out = tmp_path / "out"
    more = ["--intrinsics", str(scene[1] / "cam.json"), "--mode", "auto"]  # without depth: rgb
    assert known(scene, out, *more) == 0
    statuses = [entry["status"] for entry in objects_of(out)]
    assert statuses.count("weak") > 0.8 * len(statuses)
    check_poses(scene, out)
    assert "warning" not in capsys.readouterr().err


def test_a_known_shape_is_started_again_by_a_box(webcam, scene, silhouettes, page, tmp_path):
    """Without depth there is no search: the object is moved as it was at the start into the box."""
    webcam.frames += webcam.frames[::-1]  # some are gone before the shape is loaded
    far = Box(0, 2.0, 2.0, 30.0, 30.0)
    made = page({10: [far], 16: [Box(0, *box_of(silhouettes[30], 0))], 20: [Record(True)]})
    out = tmp_path / "out"
    assert known(scene, out, "--intrinsics", str(scene[1] / "cam.json")) == 0
    assert made.said.count("duck: started") == 2
    assert any("to record" in text for text in made.said)
    results = [result for _, result, _ in made.shown]
    assert np.abs(results[10].poses[0, :3, 3] - results[9].poses[0, :3, 3]).max() > 0.1
    assert str(results[20].status[0]) == "weak"
    errors = [st.metrics.pose_error(results[-1].pose, scene[0].ground_truth[i][0])[0] for i in range(FRAMES)]
    assert min(errors) < FARTHEST_M


def test_mode_rgb_goes_on_after_frames_without_colour(scene, rgbd, tmp_path):
    frames = list(scene[0])
    for i in (0, 28, 29, 30):
        frames[i] = frames[i].replace(color=None)
    rgbd(st.Sequence(frames, CAMERA))
    out = tmp_path / "out"
    assert known(scene, out, "-q", camera="faulty:") == 0
    objects = objects_of(out)
    bad = [entry["reason"] for entry in objects if entry["status"] == "bad_frame"]
    assert set(bad) == {"this frame has no colour image"}
    assert objects[-1]["status"] == "weak"


@pytest.mark.parametrize("distance", [0.3, 0.6, 3.0])
def test_a_shape_is_moved_to_where_it_fills_a_box(distance):
    mesh = duck_mesh()
    T = st.geometry.pose([0.3, -0.4, 0.2], [0.1, -0.05, distance])
    px = CAMERA.project(mesh.vertices @ T[:3, :3].T + T[:3, 3])
    low, high = px.min(axis=0), px.max(axis=0)
    start = T.copy()
    start[:3, 3] = [0.0, 0.0, 0.8]
    moved = moved_into((*low, *(high - low)), start, mesh.vertices, CAMERA)
    np.testing.assert_array_equal(moved[:3, :3], T[:3, :3])
    metres, _ = st.metrics.pose_error(moved, T)
    assert metres < 0.05 * distance


def test_intrinsics_of_another_size_are_one_line_and_leave_nothing(
    webcam, scene, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(scene[1])
    CAMERA.scaled(2).save("big.json")
    line = "live --model duck.ply --camera webcam:0 --no-viewer --voxels 50 -q --init poses.json"
    assert run([*line.split(), "--intrinsics", "big.json", "--out", str(tmp_path / "out")]) == 1
    assert "--intrinsics: these intrinsics are of 640 x" in error_line(capsys)
    assert not (tmp_path / "out").exists()
