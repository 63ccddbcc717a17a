# SPDX-License-Identifier: MIT
"""``sdftrack contour``: what it writes, and what it refuses."""

import json

import numpy as np
import pytest

from sdftrack.cli.app import run
from sdftrack.io.frames import read_mask, write_color, write_mask
from sdftrack.io.video import write_video
from sdftrack.metrics import iou
from sdftrack.synth.blob import BlobVideo, blob_video

FRAMES = 6
# Soft texture and little noise; in the video file coded colours.
FOLLOWED_IOU, CODED_IOU = 0.9, 0.85


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A folder of frames, one of true masks, a video of the same, and the first box."""
    root = tmp_path_factory.mktemp("blob")
    long = blob_video(frames=40)
    video = BlobVideo(long.images[:FRAMES], long.masks[:FRAMES])
    for name in ("rgb", "mask"):
        (root / name).mkdir()
    for k in range(FRAMES):
        write_color(root / "rgb" / f"{k:06d}.png", video.images[k])
        write_mask(root / "mask" / f"{k:06d}.png", video.masks[k])
    write_video(root / "blob.mp4", video.images, 25)
    y, x = np.nonzero(video.masks[0])
    return root, f"{x.min()},{y.min()},{np.ptp(x) + 1},{np.ptp(y) + 1}", video


def test_a_folder_and_a_box_give_masks_a_video_and_a_report(scene, tmp_path, capsys):
    root, box, video = scene
    out = tmp_path / "out"
    assert (
        run(["contour", str(root / "rgb"), "--box", box, "--masks", str(root / "mask"), "--out", str(out)])
        == 0
    )
    assert "6 frames, 6 ok" in capsys.readouterr().out
    report = json.loads((out / "result.json").read_text())
    assert [f["frame"] for f in report["frames"]] == list(range(FRAMES))
    assert report["mean_iou"] > FOLLOWED_IOU
    for k, frame in enumerate(report["frames"]):
        mask = read_mask(out / "mask" / f"{k:06d}.png")
        assert mask.sum() == frame["area_px"]
        assert iou(mask, video.masks[k]) == pytest.approx(frame["iou"])
        assert np.shape(frame["warp"]) == (3, 3)
    assert (out / "overlay.mp4").stat().st_size > 1000
    assert (out / "iou.png").read_bytes().startswith(b"\x89PNG")


def test_a_video_and_a_mask_do_as_well(scene, tmp_path):
    root, _, video = scene
    out = tmp_path / "out"
    given = [
        "contour",
        str(root / "blob.mp4"),
        "--mask",
        str(root / "mask" / "000000.png"),
        "--out",
        str(out),
    ]
    assert run([*given, "--warp", "affine", "--quiet"]) == 0
    report = json.loads((out / "result.json").read_text())
    assert report["settings"]["warp"] == "affine"
    assert len(report["frames"]) == FRAMES
    assert iou(read_mask(out / "mask" / "000005.png"), video.masks[5]) > CODED_IOU
    assert not (out / "iou.png").exists()


def test_a_part_of_the_frames_keeps_their_numbers(scene, tmp_path):
    root, _, _ = scene
    out = tmp_path / "out"
    mask = str(root / "mask" / "000001.png")
    given = [
        "contour",
        str(root / "rgb"),
        "--mask",
        mask,
        "--out",
        str(out),
        "-q",
        "--start",
        "1",
        "--step",
        "2",
    ]
    assert run(given) == 0
    assert sorted(p.name for p in (out / "mask").iterdir()) == ["000001.png", "000003.png", "000005.png"]


def test_a_folder_with_files_is_refused_and_replaced_when_asked(scene, tmp_path, capsys):
    root, box, _ = scene
    out = tmp_path / "out"
    given = ["contour", str(root / "rgb"), "--box", box, "--out", str(out), "-q"]
    assert run(given) == 0
    assert run(given) == 1
    assert "out: expected a new or empty folder" in capsys.readouterr().err
    assert run([*given, "--overwrite", "--stop", "3"]) == 0
    assert len(list((out / "mask").iterdir())) == 3


@pytest.mark.parametrize(
    ("more", "code", "told"),
    [
        ([], 2, "expected --box or --mask, got none"),
        (["--box", "1,2,3,4", "--mask", "m.png"], 2, "expected --box or --mask, got both"),
        (["--box", "1,2,3"], 2, "box:x,y,w,h"),
        (["--box", "500,2,30,30"], 1, "box: expected a box in the 240 x 160 image"),
        (["--mask", "none.png"], 1, "the file is missing"),
        (["--box", "BOX", "--masks", "nowhere"], 1, "--masks: no such folder"),
        (["--box", "BOX", "--start", "99"], 1, "expected some of the frames"),
        (["--box", "BOX", "--warp", "rigid"], 2, "rigid"),
    ],
)
def test_arguments_that_cannot_be_are_refused(scene, tmp_path, capsys, more, code, told):
    root, box, _ = scene
    more = [box if m == "BOX" else m for m in more]
    assert run(["contour", str(root / "rgb"), "--out", str(tmp_path / "out"), *more]) == code
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_what_is_no_video_is_refused(tmp_path, capsys):
    (tmp_path / "film.mp4").write_text("not a film")
    (tmp_path / "empty").mkdir()
    for name, told in (
        ("film.mp4", "not a readable video"),
        ("empty", "folder of images"),
        ("no.mp4", "no such file"),
    ):
        given = ["contour", str(tmp_path / name), "--box", "1,2,30,40", "--out", str(tmp_path / "out")]
        assert run(given) == 1
        assert told in capsys.readouterr().err


def test_frames_of_another_size_end_the_run_with_one_line(scene, tmp_path, capsys):
    _, box, video = scene
    folder = tmp_path / "rgb"
    folder.mkdir()
    write_color(folder / "000000.png", video.images[0])
    write_color(folder / "000001.png", video.images[1][:-8])
    assert run(["contour", str(folder), "--box", box, "--out", str(tmp_path / "out")]) == 1
    assert "image: expected the size at the start, 240 x 160" in capsys.readouterr().err
