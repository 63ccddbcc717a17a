# SPDX-License-Identifier: MIT
"""``sdftrack track --init``: every way to say where the objects are."""

import json
import shutil

import numpy as np
import pytest
from live_scene import CAMERA, box_of, recorded

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.imaging.pose_hint import connected_region
from sdftrack.io.frames import write_mask
from sdftrack.synth.objects import duck_mesh

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


def masked(folder, mask):
    """The recording of `scene` as a folder with masks, without poses, times and colour."""
    (folder / "rec/masks").mkdir(parents=True)
    np.savetxt(folder / "rec/cam_K.txt", CAMERA.K)
    (folder / "rec/depth").mkdir()
    write_mask(folder / "rec/masks/frame_0.png", mask)
    return folder / "rec"


@pytest.mark.parametrize("init", [(), ("--init", "mask")], ids=["default", "asked for"])
@pytest.mark.parametrize("fps", [(), ("--fps", "20")], ids=["without times", "fps"])
def test_the_masks_of_a_recording_are_where_its_objects_are(scene, tmp_path, init, fps):
    from sdftrack.io.frames import write_depth_units

    folder, seq, mask = scene
    own = masked(tmp_path, mask)
    for i in range(FRAMES):
        write_depth_units(own / f"depth/d_{i}.png", np.round(1000 * seq[i].depth).astype(np.uint16))
    model = str(folder / "duck.ply")
    out = tmp_path / "out"
    assert (
        run(
            ["track", str(own), "--model", model, "--out", str(out), "--no-video", "-q", *VOXELS, *init, *fps]
        )
        == 0
    )
    report = json.loads((out / "report.json").read_text())
    assert report["settings"]["init"] == "mask"
    for i, entry in enumerate(report["frames"]):
        assert (
            st.metrics.pose_error(np.array(entry["objects"][0]["pose"]), seq.ground_truth[i][0])[0]
            < MAX_ERROR_M
        )
    assert (out / "trajectory_0.txt").exists() == bool(fps)
    if fps:
        assert np.allclose(np.loadtxt(out / "trajectory_0.txt")[:, 0], np.arange(FRAMES) / 20)


@pytest.mark.parametrize("damage", ["cut", "gone"])
@pytest.mark.parametrize("kind", ["mask", "box", "click"])
@pytest.mark.filterwarnings("ignore:.*the start is in image 1")
def test_a_first_image_that_cannot_be_read_is_passed_over(scene, tmp_path, kind, damage):
    folder, _, mask = scene
    shutil.copytree(folder, tmp_path / "copy")
    first = sorted((tmp_path / "copy/seq/depth").iterdir())[0]
    first.write_bytes(first.read_bytes()[:900]) if damage == "cut" else first.unlink()
    text = {
        "mask": str(folder / "mask.png"),
        "box": "box:" + ",".join(map(str, box_of(mask))),
        "click": "click:" + ",".join(map(str, middle_of(mask))),
    }[kind]
    report = track(tmp_path / "copy", tmp_path / "out", "--init", text)
    assert [entry["im_id"] for entry in report["frames"]] == list(range(1, FRAMES))
    assert all(entry["objects"][0]["status"] == "ok" for entry in report["frames"])


@pytest.mark.parametrize(
    ("reason", "given", "words"),
    [
        ("ambiguous: another pose explains the view nearly as well", {}, "--symmetry auto"),
        ("another size: 1.3", {}, "--scale free"),
        ("the observed colours do not match those of the object", {}, "--mode depth"),
        ("the depth measurements do not fit the shape well", {}, "--sensor NAME"),
        ("most of the surface that should be visible has no depth measurement", {}, "--mode rgb"),
        ("the depth measurements do not fit the shape well", {"sensor": "kinect_v1"}, None),
        ("the frame has no depth image", {}, None),
    ],
)
@pytest.mark.parametrize("status", ["weak", "lost"])
def test_the_last_line_names_the_option_that_fits_the_reason(reason, given, words, status, capsys):
    from types import SimpleNamespace as Object

    from sdftrack.cli.followed import NEXT, Followed

    job = Object(**({"symmetry": "none", "scale": "known", "mode": "auto", "sensor": None} | given))
    result = Object(status=[status], reason=[reason])
    run_ = Followed(job, "rec", "out", None, range(4), None, results=[result] * 4)
    lines = list(run_.lost_throughout(["cup"], ["mask"]))
    run_.tell_remedies(["cup"], ["mask"])
    lines += capsys.readouterr().out.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(
        "rec: cup is lost in all 4 frames" if status == "lost" else "cup: 4 weak of 4 frames"
    )
    assert (words or NEXT["mask"]) in lines[0].partition("next: ")[2]
