# SPDX-License-Identifier: MIT
"""``sdftrack reconstruct``: the files it writes, what is in them, and what becomes of bad input."""

import csv
import json
import shutil
import sys

import cv2
import duck_scene
import numpy as np
import pytest
from duck_scene import CAMERA, FRAMES, scene
from refusals import error_line

import sdftrack as st
from sdftrack.cli.app import run

VOXELS = ["--voxels", "64"]
MAX_ERROR_M, MAX_ERROR_RAD = 0.006, np.deg2rad(5.0)  # the shape is learnt meanwhile, in voxels of 6 mm
POSES = duck_scene.poses(2.0)
TRACK_FILES = {"poses.csv", "trajectory_0.txt", "ground_truth_0.txt", "report.json", "report.html"}
SHAPE_FILES = {"shape.npz", "mesh.ply", "mesh.png"}


def saved(folder, number, mesh, at):
    """A BOP scene with masks, poses and the mesh as its model."""
    root = folder / "ducks" / "test" / number
    root.parent.mkdir(parents=True)
    st.save_sequence(root, scene(mesh, at), layout="bop")
    return root


@pytest.fixture(scope="module")
def duck():
    return st.synth.duck_mesh()


@pytest.fixture(scope="module")
def recording(tmp_path_factory, duck):
    return saved(tmp_path_factory.mktemp("data"), "000003", duck, POSES)


@pytest.fixture(scope="module")
def other(tmp_path_factory, duck):
    """A second recording of the duck, lain down on its side: the scene, and its true poses."""
    middle = st.geometry.pose(t_m=duck.bounds.mean(axis=0))
    lain = middle @ st.geometry.pose([0, 0.5, 0]) @ st.geometry.inverse(middle)
    at = st.geometry.pose([0, 0, np.pi / 2], [0, 0, 0]) @ POSES @ lain
    return saved(tmp_path_factory.mktemp("data"), "000004", duck, at), at


@pytest.fixture(scope="module")
def bare(tmp_path_factory, duck):
    """Depth alone: no colours, no masks, no truth."""
    root = tmp_path_factory.mktemp("data") / "bare"
    st.save_sequence(
        root, st.Sequence([f.replace(color=None) for f in scene(duck, POSES)[:4]], CAMERA), layout="bop"
    )
    return root


@pytest.fixture(scope="module")
def whole(recording, tmp_path_factory):
    """The folder of one full run, with everything."""
    out = tmp_path_factory.mktemp("out") / "whole"
    assert run(["reconstruct", str(recording), "--out", str(out), "--format", "ply,obj", *VOXELS]) == 0
    return out


def report_of(out):
    return json.loads((out / "report.json").read_text())


def poses_of(out):
    with (out / "poses.csv").open() as f:
        rows = list(csv.DictReader(f))
    found = np.tile(np.eye(4), (len(rows), 1, 1))
    for T, row in zip(found, rows, strict=True):
        T[:3, :3] = np.array(row["R"].split(), float).reshape(3, 3)
        T[:3, 3] = 1e-3 * np.array(row["t"].split(), float)
    return [int(r["im_id"]) for r in rows], found


@pytest.mark.slow
def test_it_writes_the_documented_files_and_lists_them(whole):
    files = TRACK_FILES | SHAPE_FILES | {"overlay.mp4", "turntable.mp4", "mesh.obj", "refined_0.txt"}
    assert {p.name for p in whole.iterdir()} == files
    assert set(report_of(whole)["settings"]["files"]) == files


def test_the_mesh_is_closed_coloured_and_that_of_the_shape(whole):
    mesh = st.Mesh.load(whole / "mesh.ply")
    assert mesh.to_trimesh().is_watertight
    assert len(st.Mesh.load(whole / "mesh.obj").faces) == len(mesh.faces)
    shape = st.SDF.load(whole / "shape.npz")
    assert mesh.seen is not None
    assert np.abs(shape(mesh.vertices[mesh.seen > 1])).mean() < 0.1 * shape.voxel_size
    assert mesh.colors is not None
    assert np.ptp(mesh.colors, axis=0).max() > 100  # yellow, blue and white


def test_the_poses_follow_the_truth_from_the_first_image_on(whole):
    ids, found = poses_of(whole)
    assert ids == list(range(FRAMES))
    check_poses(whole, found, POSES @ np.linalg.solve(POSES[0], found[0]), MAX_ERROR_M)


def check_poses(folder, found, true, max_error_m):
    """Poses frame by frame, and the text files beside them, all of the mesh's own frame."""
    metres, radians = st.metrics.pose_error(found, true)
    assert metres.max() < max_error_m
    assert radians.max() < MAX_ERROR_RAD
    names = ("ground_truth", "trajectory", "refined")
    truth, tracked, refined = (np.loadtxt(folder / f"{name}_0.txt", ndmin=2) for name in names)
    np.testing.assert_allclose(truth[:, 1:4], true[:, :3, 3], atol=1e-6)
    np.testing.assert_allclose(tracked[:, 1:4], found[:, :3, 3], atol=1e-6)
    assert set(refined[:, 0]) <= set(tracked[:, 0])
    assert np.linalg.norm(refined[:, 1:4] - truth[: len(refined), 1:4], axis=1).max() < max_error_m


def test_evaluate_compares_them_in_the_frame_of_the_mesh(recording, whole, tmp_path):
    assert run(["evaluate", str(whole), str(recording), "--out", str(tmp_path / "e"), "-q"]) == 0
    (scores,) = json.loads((tmp_path / "e" / "result.json").read_text())["objects"]
    _, found = poses_of(whole)
    metres = np.linalg.norm((found @ np.linalg.solve(found[0], POSES[0]) - POSES)[:, :3, 3], axis=1)
    assert scores["translation_mm"]["max"] == pytest.approx(1e3 * metres.max(), rel=1e-3)
    # of the duck's own origin, 0.1 m from the ball's
    assert scores["translation_mm"]["max"] < 2e3 * MAX_ERROR_M


def test_the_report_says_how_far_the_shape_may_be_trusted(whole):
    report = report_of(whole)
    section = report["reconstruction"]
    assert section["complete"] is True
    assert section["frames_fused"] == FRAMES
    assert 0.1 < section["seen_share"] < 0.9
    assert "% of the surface was observed" in section["summary"]
    assert len(section["surface_change_m"]) == FRAMES
    assert set(section["refined"]["poses"]) == {str(i) for i in range(FRAMES)}
    assert report["settings"]["command"] == "reconstruct"
    assert report["settings"]["instances"] == [0]
    assert [f["objects"][0]["status"] for f in report["frames"]] == ["ok"] * FRAMES


def test_the_pictures_and_videos_are_whole(whole):
    assert cv2.imread(str(whole / "mesh.png")).shape[1] == 4 * 420
    turn = cv2.VideoCapture(str(whole / "turntable.mp4"))
    assert turn.get(cv2.CAP_PROP_FRAME_COUNT) == 90
    overlay = cv2.VideoCapture(str(whole / "overlay.mp4"))
    assert overlay.get(cv2.CAP_PROP_FRAME_COUNT) == FRAMES


def test_it_says_how_it_goes_and_how_it_went(recording, tmp_path, capsys):
    out = tmp_path / "out"
    assert quick(recording, out, quiet=False) == 0
    printed = capsys.readouterr()
    assert "3/3, " in printed.err
    assert ", surface moved" in printed.err
    assert "mean mm" in printed.out
    assert "% of the surface was observed" in printed.out
    assert {p.name for p in out.iterdir()} == TRACK_FILES | SHAPE_FILES
    assert report_of(out)["reconstruction"]["refined"] is None


def quick(seq, out, *more, quiet=True):
    words = ["-q"] if quiet else []
    return run(
        [*f"reconstruct {seq} --out {out} --no-video --no-refine --stop 3".split(), *words, *VOXELS, *more]
    )


def test_a_box_and_a_mask_file_begin_at_the_object(bare, duck, tmp_path):
    seen = duck.raycast(CAMERA, POSES[0])[0] > 0
    ys, xs = np.nonzero(seen)
    box = f"box:{xs.min()},{ys.min()},{np.ptp(xs) + 1},{np.ptp(ys) + 1}"
    cv2.imwrite(str(tmp_path / "mask.png"), 255 * seen.astype(np.uint8))
    assert quick(bare, tmp_path / "a", "--init", box) == 0
    assert quick(bare, tmp_path / "b", "--init", str(tmp_path / "mask.png")) == 0
    for name in "ab":
        _, found = poses_of(tmp_path / name)
        x, y = CAMERA.project(found[0][:3, 3][None])[0].round().astype(int)
        assert seen[y, x]
        assert abs(found[0][2, 3] - POSES[0][2, 3]) < 0.1
    assert not (tmp_path / "a" / "ground_truth_0.txt").exists()


def test_a_first_guess_is_a_ball_a_mesh_or_a_shape_of_before(recording, whole, duck, tmp_path):
    duck.save(tmp_path / "kind.ply")
    assert quick(recording, tmp_path / "a", "--shape", "sphere:0.08", "--extent", "0.4") == 0
    assert report_of(tmp_path / "a")["reconstruction"]["voxel_m"] == pytest.approx(0.4 / 63, rel=1e-3)
    assert quick(recording, tmp_path / "b", "--shape", str(tmp_path / "kind.ply"), "--init", "gt") == 0
    _, found = poses_of(tmp_path / "b")
    np.testing.assert_allclose(found[0], POSES[0], atol=1e-6)  # the object frame is that of the guess
    assert quick(recording, tmp_path / "c", "--shape", str(whole / "shape.npz")) == 0


def test_the_quality_is_a_number_of_voxels_and_the_mesh_may_have_few_faces(recording, tmp_path):
    out = tmp_path / "o"
    arguments = ["--out", str(out), "-q", "--no-refine", "--no-video", "--stop", "2", "--faces", "500"]
    more = ["--texture", "128", "--format", "obj,glb,stl", "--quality", "quick"]
    assert run(["reconstruct", str(recording), *arguments, *more]) == 0
    pictures = {"mesh_texture.png", "mesh.mtl"}
    written = TRACK_FILES | SHAPE_FILES | pictures | {"mesh.obj", "mesh.glb", "mesh.stl"}
    assert {p.name for p in out.iterdir()} == written == set(report_of(out)["settings"]["files"])
    assert cv2.imread(str(out / "mesh_texture.png")).shape == (128, 128, 3)
    assert report_of(out)["settings"]["voxels"] == 96
    mesh = st.Mesh.load(out / "mesh.ply")
    assert 250 < len(mesh.faces) <= 500
    assert mesh.seen is not None
    assert st.Mesh.load(out / "mesh.stl").to_trimesh().process(validate=True).is_watertight


def test_a_missing_package_is_told_before_any_work(recording, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "fast_simplification", None)
    monkeypatch.setitem(sys.modules, "xatlas", None)
    for asked in (["--faces", "500"], ["--texture", "64"]):
        assert quick(recording, tmp_path / "o", *asked) == 1
        assert "pip install 'sdftrack[export]'" in error_line(capsys)
    assert not (tmp_path / "o").exists()


def test_a_further_recording_continues_the_shape(recording, other, whole, tmp_path, capsys):
    folder, at = other
    out = tmp_path / "o"
    common = ["--out", str(out), "--no-video", *VOXELS]
    assert run(["reconstruct", str(recording), "--then", str(folder), *common]) == 0
    assert capsys.readouterr().out.count("mean mm") == 2  # a table for each recording
    assert {p.name for p in out.iterdir()} == TRACK_FILES | SHAPE_FILES | {"refined_0.txt", "recording_2"}
    later = out / "recording_2"
    assert {p.name for p in later.iterdir()} == TRACK_FILES | {"refined_0.txt"}
    assert report_of(out)["settings"]["then"] == [str(folder)]
    assert report_of(out)["reconstruction"]["frames_fused"] == 2 * FRAMES
    assert report_of(out)["reconstruction"]["seen_share"] > report_of(whole)["reconstruction"]["seen_share"]
    _, first = poses_of(out)
    ids, found = poses_of(later)
    assert ids == list(range(FRAMES))
    check_poses(later, found, at @ np.linalg.solve(POSES[0], first[0]), 2 * MAX_ERROR_M)


def test_a_recording_by_another_camera_is_told_before_the_first_one_is_followed(
    recording, duck, tmp_path, capsys
):
    nearer = st.Camera(0.9 * CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy, CAMERA.width, CAMERA.height)
    folder, out = tmp_path / "nearer", tmp_path / "o"
    st.save_sequence(folder, st.Sequence(list(scene(duck, POSES)), nearer), layout="bop")
    assert quick(recording, out, "--then", str(folder), "--then-init", "box:40,20,80,80") == 1
    assert "expected the camera of the first recording" in (text := error_line(capsys))
    assert str(folder) in text
    assert not out.exists()


def test_a_recording_of_something_else_is_an_error_that_leaves_the_first_one(recording, tmp_path, capsys):
    box = st.SDF.box((0.1, 0.16, 0.12), voxels=48).to_mesh()
    grey = st.Mesh(box.vertices, box.faces, np.full(box.vertices.shape, 90, np.uint8))
    folder, out = tmp_path / "boxes", tmp_path / "o"
    st.save_sequence(folder, scene(grey, POSES), layout="bop")
    assert quick(recording, out, "--then", str(folder), "--then-init", "mask") == 1
    text = error_line(capsys)
    assert "not found reliably in image 0" in text or "size" in text
    assert "boxes" in text
    assert {p.name for p in out.iterdir()} >= SHAPE_FILES
    assert report_of(out)["reconstruction"]["frames_fused"] == 3
    assert not (out / "recording_2").exists()


def test_options_are_taken_from_a_file_and_the_sources_evolution_brings_its_tracker(bare, tmp_path):
    config = tmp_path / "o.toml"
    config.write_text("[tracker]\nmax_pixels = 1500\n[reconstruct]\nkept_frames = 2\nevidence = 'printed'\n")
    start = ["--init", "box:40,20,80,80"]
    assert quick(bare, tmp_path / "file", *start, "--config", str(config)) == 0
    settings = report_of(tmp_path / "file")["settings"]
    assert settings["tracker"]["max_pixels"] == 1500
    assert (settings["reconstructor"]["kept_frames"], settings["reconstructor"]["evidence"]) == (2, "printed")
    assert quick(bare, tmp_path / "printed", *start, "--evolution", "printed") == 0
    settings = report_of(tmp_path / "printed")["settings"]
    assert settings["reconstructor"]["evolution"] == "printed"
    assert settings["tracker"]["stop_rule"] == "printed"


def test_a_bad_frame_in_the_middle_is_reported_and_adds_nothing(recording, tmp_path):
    shutil.copytree(recording, tmp_path / "seq")
    image = sorted((tmp_path / "seq" / "depth").iterdir())[2]
    image.write_bytes(image.read_bytes()[:200])
    out = tmp_path / "out"
    arguments = ["--out", str(out), "-q", "--no-video", "--stop", "5", *VOXELS]
    assert run(["reconstruct", str(tmp_path / "seq"), *arguments]) == 0
    report = report_of(out)
    status = [f["objects"][0]["status"] for f in report["frames"]]
    assert status == ["ok", "ok", "bad_frame", "ok", "ok"]
    assert poses_of(out)[0] == [0, 1, 3, 4]
    assert report["reconstruction"]["frames_fused"] == 4
    assert report["reconstruction"]["surface_change_m"][2] is None
    assert set(report["reconstruction"]["refined"]["poses"]) == {"0", "1", "3", "4"}  # numbers of the images


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (RuntimeError("no memory"), 1)])
def test_what_stands_is_kept_when_the_end_comes_early(recording, tmp_path, monkeypatch, capsys, error, code):
    track, seen = st.Reconstructor.track, []

    def ends(self, frame):
        seen.append(frame)
        if len(seen) == 3:
            raise error
        return track(self, frame)

    monkeypatch.setattr(st.Reconstructor, "track", ends)
    out = tmp_path / "out"
    assert run(["reconstruct", str(recording), "--out", str(out), *VOXELS]) == code
    printed = capsys.readouterr()
    assert "ended after 3 of 8 frames" in printed.out
    assert "sdftrack: error: " in printed.err
    assert {p.name for p in out.iterdir()} == TRACK_FILES | SHAPE_FILES | {"overlay.mp4"}
    assert st.Mesh.load(out / "mesh.ply").to_trimesh().is_watertight
    assert report_of(out)["reconstruction"]["complete"] is False
    assert poses_of(out)[0] == [0, 1, 2]


def test_a_refinement_that_fails_takes_nothing_away(recording, tmp_path, monkeypatch, capsys):
    def fails(self, progress):
        self._core = None  # a shape that is half made
        raise RuntimeError("out of luck")

    monkeypatch.setattr(st.Reconstructor, "refine", fails)
    out = tmp_path / "out"
    arguments = ["--out", str(out), "-q", "--no-video", "--stop", "3", *VOXELS]
    assert run(["reconstruct", str(recording), *arguments]) == 1
    assert "out of luck" in error_line(capsys)
    assert {p.name for p in out.iterdir()} == TRACK_FILES | SHAPE_FILES
    assert report_of(out)["reconstruction"]["refined"] is None
