# SPDX-License-Identifier: MIT
"""``sdftrack track --init``: every way to say where the objects are."""

import json
import shutil

import numpy as np
import pytest
from live_scene import CAMERA, box_of, recorded

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.imaging.click_regions import connected_region
from sdftrack.io.frames import write_mask
from sdftrack.synth.duck import duck_mesh

FRAMES = 3
MAX_ERROR_M, MAX_ERROR_RAD = 0.003, np.deg2rad(3.0)  # 1 mm noise, about 2,500 px: bound 0.05 mm, 0.05 deg
VOXELS = ["--voxels", "80"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A duck on its way before a wall as a BOP scene without masks, and the sequence; its mask in the first image."""
    seq, folder = recorded(tmp_path_factory.mktemp("init"), FRAMES)
    mask = duck_mesh().raycast(CAMERA, seq.ground_truth[0][0])[0] > 0
    write_mask(folder / "mask.png", mask)
    return folder, seq, mask


def middle_of(mask):
    v, u = np.nonzero(mask)
    inside = np.argmin((v - v.mean()) ** 2 + (u - u.mean()) ** 2)
    return u[inside], v[inside]


def track(folder, out, *more, code=0):
    common = f"track {folder / 'seq'} --model {folder / 'duck.ply'} --out {out} --no-video".split()
    assert run([*common, *VOXELS, *more]) == code
    return json.loads((out / "report.json").read_text()) if code in (0, 3) else None


@pytest.mark.parametrize("kind", ["gt", "mask", "box", "click", "poses"])
def test_every_start_finds_the_object(scene, tmp_path, kind):
    folder, seq, mask = scene
    if kind == "poses":
        (tmp_path / "poses.json").write_text(json.dumps({"T_cam_obj": [seq.ground_truth[0][0].tolist()]}))
    text = {
        "gt": "gt",
        "mask": str(folder / "mask.png"),
        "box": "box:" + ",".join(map(str, box_of(mask))),
        "click": "click:" + ",".join(map(str, middle_of(mask))),
        "poses": str(tmp_path / "poses.json"),
    }[kind]
    report = track(folder, tmp_path / "out", "--init", text, "-q")
    assert report["settings"]["init"] == text
    for i, entry in enumerate(report["frames"]):
        (found,) = entry["objects"]
        assert found["status"] in ("ok", "weak"), found["reason"]
        metres, radians = st.metrics.pose_error(np.array(found["pose"]), seq.ground_truth[i][0])
        assert metres < MAX_ERROR_M
        assert radians < MAX_ERROR_RAD


def test_auto_starts_from_the_masks_of_the_sequence(scene, tmp_path):
    folder, seq, mask = scene
    shutil.copytree(folder / "seq", tmp_path / "seq")
    shutil.copy(folder / "duck.ply", tmp_path)
    (tmp_path / "seq" / "mask_visib").mkdir()
    write_mask(tmp_path / "seq" / "mask_visib" / "000000_000000.png", mask)
    report = track(tmp_path, tmp_path / "out", "--init", "auto", "--mode", "depth", "-q")
    assert report["settings"]["mode"] == "depth"
    found = np.array(report["frames"][-1]["objects"][0]["pose"])
    assert st.metrics.pose_error(found, seq.ground_truth[FRAMES - 1][0])[0] < MAX_ERROR_M


def test_another_mesh_is_drawn_at_the_pose(scene, tmp_path):
    import av

    folder, *_ = scene
    st.SDF.box((0.03, 0.3, 0.3)).to_mesh().save(tmp_path / "sword.ply")

    def video(out, *more):
        common = ["track", str(folder / "seq"), "--model", str(folder / "duck.ply"), "--out", str(out)]
        assert run([*common, *VOXELS, *more, "-q"]) == 0
        with av.open(str(out / "overlay.mp4")) as file:
            return next(file.decode(video=0)).to_ndarray(format="rgb24").astype(int)

    plain = video(tmp_path / "a")
    drawn = video(tmp_path / "b", "--overlay-mesh", str(tmp_path / "sword.ply"))
    assert (np.abs(drawn - plain).max(axis=-1) > 60).sum() > 300


def test_two_objects_are_started_from_two_masks_in_their_order(tmp_path):
    duck = duck_mesh()
    duck.save(tmp_path / "duck.ply")
    seq = st.synth.sequence([duck, duck], 2, noise=0.001, camera=CAMERA, clutter="wall", seed=2)
    kept = st.Sequence([seq[i] for i in range(2)], CAMERA)
    st.save_sequence(tmp_path / "seq", kept, layout="bop")
    for k in (0, 1):
        write_mask(tmp_path / f"{k}.png", seq.masks(0)[k])
    masks = ["--init", str(tmp_path / "1.png"), "--init", str(tmp_path / "0.png")]
    report = track(tmp_path, tmp_path / "out", "--model", str(tmp_path / "duck.ply"), *masks, "-q")
    for k, j in ((0, 1), (1, 0)):
        found = np.array(report["frames"][1]["objects"][k]["pose"])
        assert st.metrics.pose_error(found, seq.ground_truth[1][j])[0] < MAX_ERROR_M
    assert report["settings"]["init"] == masks[1::2]


def test_a_click_takes_what_hangs_together_and_leaves_the_table():
    box = st.SDF.box((0.09, 0.12, 0.1)).to_mesh()
    seq, bare = (
        st.synth.sequence(box, 1, "static", camera=CAMERA, clutter=clutter, seed=3, noise=0.001)
        for clutter in ("touching", "wall")
    )
    x, y = middle_of(seq.masks(0)[0])
    region = connected_region(seq[0], CAMERA, (x, y), 0.18)
    assert region[y, x]
    points = CAMERA.back_project(seq[0].depth)
    assert np.linalg.norm(points[region] - points[y, x], axis=1).max() <= 0.18
    alone = connected_region(bare[0], CAMERA, middle_of(bare.masks(0)[0]), 0.18)
    assert st.metrics.iou(alone, bare.masks(0)[0]) > 0.97


def test_a_click_on_nothing_says_what_is_there():
    speck = np.zeros(CAMERA.shape, np.float32)
    speck[5, 5] = 1
    for frame, words in (
        (st.Frame(0 * speck), "none there"),
        (st.Frame.unreadable("cut short"), "depth image"),
        (st.Frame(speck), "1 connected pixels"),
    ):
        with pytest.raises(ValueError, match=words):
            connected_region(frame, CAMERA, (5, 5), 0.1)
