# SPDX-License-Identifier: MIT
"""``sdftrack contour``: what it writes, and what it refuses."""

import itertools
import json
import shutil

import numpy as np
import pytest

from experiments.synth.blob import BlobVideo, blob_video
from sdftrack.cli.app import run
from sdftrack.cli.contour import WRITTEN
from sdftrack.contour.memory import ShapeMemory
from sdftrack.io.frames import read_mask, write_color, write_mask
from sdftrack.io.video import ColorVideo, write_video
from sdftrack.metrics import iou

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


def contour(scene, out, *more, source=None, code=0):
    """Runs the command, quietly, from the box unless a mask is given; returns the report."""
    root, box, _ = scene
    place = [] if "--mask" in more else ["--box", box]
    words = ["contour", str(source or root / "rgb"), *place, "--out", str(out), "-q", *map(str, more)]
    assert run(words) == code
    return json.loads((out / "result.json").read_text()) if (out / "result.json").is_file() else None


def test_a_folder_and_a_box_give_masks_a_video_and_a_report(scene, tmp_path, capsys):
    root, box, video = scene
    out = tmp_path / "out"
    words = ["contour", str(root / "rgb"), "--box", box, "--masks", str(root / "mask"), "--out", str(out)]
    assert run(words) == 0
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


def test_a_video_and_a_mask_do_as_well_and_a_part_of_the_frames_keeps_their_numbers(scene, tmp_path):
    root, _, video = scene
    out = tmp_path / "out"
    part = ["--mask", root / "mask" / "000001.png", "--start", 1, "--step", 2, "--warp", "affine"]
    report = contour(scene, out, *part, source=root / "blob.mp4")
    assert report["settings"]["warp"] == "affine"
    assert [f["frame"] for f in report["frames"]] == [1, 3, 5]
    assert sorted(p.name for p in (out / "mask").iterdir()) == ["000001.png", "000003.png", "000005.png"]
    assert iou(read_mask(out / "mask" / "000005.png"), video.masks[5]) > CODED_IOU
    assert not (out / "iou.png").exists()


def spoilt(scene, tmp_path, spoil):
    """A copy of the frames with the fourth spoilt."""
    folder = tmp_path / "rgb"
    shutil.copytree(scene[0] / "rgb", folder)
    spoil(folder / "000003.png", scene[2])
    return folder


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (
            lambda file, video: file.write_bytes(file.read_bytes()[:900]),
            "000003.png: the image file is truncated",
        ),
        (lambda file, video: file.write_bytes(b""), "empty"),
        (
            lambda file, video: write_color(file, video.images[3][:-8]),
            "the image is 240 x 152, the first one 240 x 160",
        ),
    ],
    ids=["truncated", "empty", "another size"],
)
def test_a_bad_frame_is_told_of_and_the_track_goes_on(scene, tmp_path, spoil, told):
    out = tmp_path / "out"
    source = spoilt(scene, tmp_path, spoil)
    frames = contour(scene, out, "--masks", scene[0] / "mask", source=source)["frames"]
    assert [f["status"] for f in frames] == ["ok", "ok", "ok", "bad_frame", "ok", "ok"]
    assert told in frames[3]["reason"]
    assert frames[3]["iou"] == 0
    assert not read_mask(out / "mask" / "000003.png").any()
    assert iou(read_mask(out / "mask" / "000005.png"), scene[2].masks[5]) > FOLLOWED_IOU
    assert sum(1 for _ in ColorVideo(out / "overlay.mp4")) == FRAMES


def test_a_first_frame_that_cannot_be_read_is_an_error(scene, tmp_path, capsys):
    folder = spoilt(scene, tmp_path, lambda file, video: file.write_bytes(b""))
    contour(scene, tmp_path / "out", "--start", 3, source=folder, code=1)
    assert "000003.png: the image file is empty" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [(KeyboardInterrupt(), 130, "interrupted"), (ValueError("broke off"), 1, "broke off")],
)
def test_what_was_found_before_an_interruption_is_kept(scene, tmp_path, monkeypatch, error, code, told):
    whole = ColorVideo.frames

    def some(self, *part):
        yield from itertools.islice(whole(self, *part), 4)
        raise error

    monkeypatch.setattr(ColorVideo, "frames", some)
    out, film = tmp_path / "out", scene[0] / "blob.mp4"
    report = contour(scene, out, source=film, code=code)
    assert report["stopped"] == told
    assert len(report["frames"]) == 4
    assert sum(1 for _ in ColorVideo(out / "overlay.mp4")) == 4
    monkeypatch.undo()
    contour(scene, out, "--overwrite", source=film)  # what the broken run wrote is its own


def test_files_of_others_are_never_deleted_or_replaced(scene, tmp_path, capsys):
    out = tmp_path / "out"
    (out / "mask").mkdir(parents=True)
    shutil.copy(scene[0] / "mask" / "000002.png", out / "mask" / "000002.png")
    (out / "mask" / "notes.png").write_bytes(b"mine")
    before = (out / "mask" / "000002.png").read_bytes()
    contour(scene, out, "--overwrite", code=1)
    assert "masks of this command alone, got 000002.png" in capsys.readouterr().err
    assert (out / "mask" / "000002.png").read_bytes() == before
    (out / "mask" / "000002.png").unlink()
    contour(scene, out, "--overwrite")
    contour(scene, out, "--overwrite", "--stop", 2)
    assert sorted(p.name for p in (out / "mask").iterdir()) == ["000000.png", "000001.png", "notes.png"]
    assert (out / "mask" / "notes.png").read_bytes() == b"mine"


@pytest.mark.parametrize("which", ["--masks", "--mask", "source", "folder"])
def test_inputs_that_results_would_replace_are_refused(scene, tmp_path, capsys, which):
    root, box, _ = scene
    out = tmp_path / "out"
    shutil.copytree(root / ("rgb" if which == "source" else "mask"), out / "mask")
    source, place = str(root / "rgb"), ["--box", box]
    if which == "--masks":
        place += ["--masks", str(out / "mask")]
    elif which == "--mask":
        place = ["--mask", str(out / "mask" / ".." / "mask" / "000000.png")]
    elif which == "source":
        source = str(out / "mask")
    else:
        shutil.copy(root / "blob.mp4", out / "overlay.mp4")
        source = str(out / "overlay.mp4")
    kept = {p: p.read_bytes() for p in out.rglob("*") if p.is_file()}
    assert run(["contour", source, *place, "--out", str(out), "--overwrite"]) == 1
    assert "choose another --out" in capsys.readouterr().err
    assert {p: p.read_bytes() for p in out.rglob("*") if p.is_file()} == kept


def test_the_tables_options_reach_the_tracker(scene, tmp_path, capsys):
    file = tmp_path / "o.toml"
    file.write_text('[contour]\nwarp = "affine"\nbins = 32\n')
    given = ["--stop", 2, "--config", file]
    settings = contour(scene, tmp_path / "a", *given)["settings"]
    assert (settings["warp"], settings["bins"]) == ("affine", 32)
    assert contour(scene, tmp_path / "b", *given, "--warp", "similarity")["settings"]["warp"] == "similarity"
    assert run(["config"]) == 0
    file.write_text(capsys.readouterr().out)
    contour(scene, tmp_path / "d", *given)


def test_a_memory_is_kept_in_a_file_and_goes_on_from_it(scene, tmp_path, capsys):
    kept = tmp_path / "blob.shapes"
    memory = ["--memory", "--memory-file", kept]
    contour(scene, tmp_path / "a", *memory)
    learnt = ShapeMemory.load(kept).n_learnt
    assert learnt == FRAMES - 1
    contour(scene, tmp_path / "b", *memory, "--burn-in", 60)
    assert ShapeMemory.load(kept).n_learnt == 2 * learnt
    judged = contour(scene, tmp_path / "c", *memory)["frames"][1:]
    # A taught memory judges from the first frame.
    assert all(frame["judgement"] is not None for frame in judged)


def test_masks_of_others_beside_those_of_a_killed_run_are_kept(scene, tmp_path):
    out = tmp_path / "out"
    (out / "mask").mkdir(parents=True)
    (out / WRITTEN).write_text("mask/000000.png\n../other.png\n")
    write_mask(out / "mask" / "000001.png", scene[2].masks[1])
    contour(scene, out, "--overwrite", code=1)
    assert read_mask(out / "mask" / "000001.png").any()
