# SPDX-License-Identifier: MIT
"""Primitives in the tracker and on the command line."""

import json
import pickle

import cv2
import numpy as np
import pytest

import sdftrack as st
from experiments.synth.solids import standing_scene
from sdftrack.cli.app import run
from sdftrack.synth.noise import Gaussian

CAMERA = st.Camera(262, 262, 159.5, 119.5, 320, 240)
SIZE = {"radius": 0.04, "height": 0.11}
RTOL = 0.02  # of a size by a quarter of the usual readings, of 1 mm noise
POSE_ATOL_M = 0.002


def frames(count=3, kind="cylinder", size=None):
    """A still solid on a table, new noise in each frame: frames, truth."""
    truth = standing_scene(kind, size or SIZE, CAMERA, np.random.default_rng(1), (0.6, 0.65))
    noise = Gaussian(0.001)
    depths = [noise(truth.depth, truth.cosine, np.random.default_rng(i)) for i in range(count)]
    return [st.Frame(d, timestamp=i / 30, index=i) for i, d in enumerate(depths)], truth


def cloud_file(folder):
    rng = np.random.default_rng(0)
    v = rng.normal(size=(2000, 3))
    points = 0.05 * v / np.linalg.norm(v, axis=1, keepdims=True) + [0.1, 0.2, 0.7]
    path = folder / "cloud.ply"
    head = "ply\nformat ascii 1.0\nelement vertex 2000\n" + "".join(f"property float {c}\n" for c in "xyz")
    head += "end_header\n"
    path.write_text(head + "\n".join(" ".join(f"{c:.6f}" for c in p) for p in points) + "\n")
    return path


def sequence_folder(folder, count=2):
    many, truth = frames(count)
    st.save_sequence(folder / "000001", st.Sequence(many, CAMERA), layout="bop")
    return folder / "000001", truth


def test_a_tracker_takes_a_primitive_and_finds_its_size():
    many, truth = frames(7)
    tracker = st.Tracker(st.Primitive("cylinder", voxels=64), CAMERA, threads=1)
    assert tracker.sizes == [None]
    result = tracker.start(many[0], masks=truth.mask)
    assert result.ok, result.reason
    for frame in many[1:]:
        result = tracker.track(frame)
    assert result.ok, result.reason
    fit = tracker.sizes[0]
    assert fit.kind == "cylinder"
    np.testing.assert_allclose(list(fit.size.values()), list(SIZE.values()), rtol=RTOL)
    assert np.linalg.norm(result.pose[:3, 3] - truth.T_cam_obj[:3, 3]) < POSE_ATOL_M
    again = pickle.loads(pickle.dumps(tracker))  # a copy knows the size, and goes on with it
    assert again.sizes[0].size == fit.size
    assert again.track(many[-1]).ok


def test_beside_a_known_shape_its_size_is_its_own_and_it_can_be_removed():
    many, truth = frames(1)
    tracker = st.Tracker([st.SDF.sphere(0.03, voxels=24), st.Primitive(voxels=64)], CAMERA, threads=1)
    pose = truth.T_cam_obj.copy()
    pose[0, 3] += 0.3
    tracker.start(many[0], masks=[truth.mask, truth.mask])
    assert tracker.sizes[0] is None
    assert tracker.sizes[1].kind == "cylinder"
    tracker.remove(0)
    assert tracker.sizes[0].kind == "cylinder"


def test_a_primitive_that_comes_into_view_later_is_found_then():
    many, truth = frames(4)
    empty = st.Frame(np.where(truth.mask, 0, many[0].depth))
    for searching in (True, False):
        tracker = st.Tracker(st.Primitive("cylinder", voxels=64), CAMERA, threads=1, recover=searching)
        assert tracker.start(empty, masks=truth.mask).status == ["lost"]
        assert tracker.track(empty).status == ["lost"]
        assert tracker.track(np.zeros_like(empty.depth)).status == ["bad_frame"]
        assert tracker.track(many[0]).ok == searching
        if not searching:
            assert tracker.recover(many[0], mask=truth.mask).ok
        result = tracker.track(many[1])
        assert result.ok, result.reason
        assert np.linalg.norm(result.pose[:3, 3] - truth.T_cam_obj[:3, 3]) < POSE_ATOL_M
        np.testing.assert_allclose(list(tracker.sizes[0].size.values()), list(SIZE.values()), rtol=2 * RTOL)


@pytest.mark.parametrize("where", ["pose", "mask", "box", None])
def test_a_primitive_can_be_added_to_a_running_tracker(where):
    many, truth = frames(4)
    v, u = np.nonzero(truth.mask)
    box = (u.min(), v.min(), np.ptp(u) + 1, np.ptp(v) + 1)
    place = {"pose": truth.T_cam_obj, "mask": truth.mask, "box": box}
    tracker = st.Tracker(st.SDF.sphere(0.03, voxels=24), CAMERA, threads=1, recover=False)
    pose = truth.T_cam_obj.copy()
    pose[0, 3] += 0.3  # where no sphere is
    tracker.start(many[0], poses=pose)
    k = tracker.add(
        st.Primitive("cylinder", voxels=64), **({} if where is None else {where: place[where]}), name="can"
    )
    if where is None:
        tracker.recover_lost = True
    for frame in many[1:]:
        result = tracker.track(frame)
    assert result.status[k] == "ok", result.reason
    np.testing.assert_allclose(list(tracker.sizes[k].size.values()), list(SIZE.values()), rtol=2 * RTOL)


def test_a_cloud_gives_its_three_files(tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["fit", str(cloud_file(tmp_path)), "--kind", "auto", "--out", str(out)]) == 0
    assert {p.name for p in out.iterdir()} == {"result.json", "fit.png", "primitive.ply"}
    result = json.loads((out / "result.json").read_text())
    assert result["kind"] == "sphere"
    assert result["size"]["radius"] == pytest.approx(0.05, rel=1e-3)
    mesh = st.Mesh.load(out / "primitive.ply")
    np.testing.assert_allclose(mesh.vertices.mean(axis=0), [0.1, 0.2, 0.7], atol=2e-3)
    assert cv2.imread(str(out / "fit.png")) is not None
    assert "sphere" in capsys.readouterr().out


def test_a_sequence_gives_the_size_of_what_is_in_the_box(tmp_path, monkeypatch):
    folder, truth = sequence_folder(tmp_path / "seq")
    out = tmp_path / "out"
    y, x = np.nonzero(truth.mask)
    box = f"{x.min() - 5},{y.min() - 5},{np.ptp(x) + 10},{np.ptp(y) + 10}"
    written = []
    monkeypatch.setattr("sdftrack.viz.overlay.write_panel", lambda picture, lines: written.extend(lines))
    assert run(["fit", str(folder), "--kind", "cylinder", "--box", box, "--out", str(out), "-q"]) == 0
    result = json.loads((out / "result.json").read_text())
    assert len(result["per_frame"]) == 2
    (radius, height), [(text, _)] = (1e3 * v for v in result["size"].values()), written
    assert text == f"cylinder: radius {radius:.1f} mm, height {height:.1f} mm"  # in fit.png
    np.testing.assert_allclose(list(result["size"].values()), list(SIZE.values()), rtol=RTOL)
    assert run(["fit", str(folder), "--frame", "1", "--out", str(out), "-q"]) == 1  # not empty
    assert run(["fit", str(folder), "--frame", "1", "--out", str(out), "-q", "--overwrite"]) == 0


@pytest.mark.parametrize("suffix", [".png", ".npy"])
@pytest.mark.parametrize("by", ["--camera", "--intrinsics"])
def test_a_single_depth_image_gives_the_size_of_what_is_on_the_table(tmp_path, suffix, by):
    frame, truth = frames(1)[0][0], frames(1)[1]
    source, camera, mask = tmp_path / f"depth{suffix}", tmp_path / "camera.json", tmp_path / "mask.png"
    if suffix == ".npy":
        np.save(source, frame.depth)
    else:
        cv2.imwrite(str(source), np.round(1e4 * frame.depth).astype(np.uint16))
    CAMERA.save(camera)
    cv2.imwrite(str(mask), 255 * truth.mask.astype(np.uint8))
    numbers = {"--camera": str(camera), "--intrinsics": f"{CAMERA.fx},{CAMERA.fy},{CAMERA.cx},{CAMERA.cy}"}
    scale = [] if suffix == ".npy" else ["--depth-scale", "0.0001"]
    arguments = ["fit", str(source), by, numbers[by], "--kind", "cylinder", *scale, "--mask", str(mask), "-q"]
    assert run([*arguments, "--out", str(tmp_path / "out")]) == 0
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    np.testing.assert_allclose(list(result["size"].values()), list(SIZE.values()), rtol=RTOL)
    assert cv2.imread(str(tmp_path / "out" / "fit.png")) is not None
