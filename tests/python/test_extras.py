# SPDX-License-Identifier: MIT
"""Without PyAV and Matplotlib everything else is written, and a line says what to install."""

import sys
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from motion_recordings import trajectory

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.io.video import write_video
from sdftrack.live import open_camera
from sdftrack.live.streams import open_stream
from sdftrack.viz.viewer import Viewer

CAMERA = st.Camera(60.0, 60.0, 31.5, 23.5, 64, 48)
C3D = Path(__file__).parents[1] / "fuzz/corpus/motion/analog_channels.c3d"
PICTURES = [np.full((47, 65, 3), (10 * i, 90, 200 - 10 * i), np.uint8) for i in range(12)]


@pytest.fixture
def bare(monkeypatch):
    """An installation without extras."""
    for name in ("av", "matplotlib"):
        monkeypatch.setitem(sys.modules, name, None)  # which makes its import fail as if it were not there


def codec_of(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        return stream.codec_context.name, stream.frames, (stream.width, stream.height)


@pytest.mark.usefixtures("bare")
def test_a_video_is_whole_without_pyav_and_a_warning_says_of_which_kind(tmp_path, monkeypatch):
    with pytest.warns(RuntimeWarning, match=r"v\.mp4 is MPEG-4 Part 2.*pip install 'sdftrack\[video\]'"):
        write_video(tmp_path / "v.mp4", PICTURES, 25)
    assert [p.name for p in tmp_path.iterdir()] == ["v.mp4"]
    video = cv2.VideoCapture(str(tmp_path / "v.mp4"))
    read = [video.read()[1][..., ::-1] for _ in PICTURES]
    assert video.get(cv2.CAP_PROP_FPS) == 25
    for picture, original in zip(read, PICTURES, strict=True):
        assert np.abs(picture.astype(int) - original[:46, :64]).mean() < 4
    monkeypatch.undo()
    assert codec_of(tmp_path / "v.mp4") == ("mpeg4", len(PICTURES), (64, 46))
    write_video(tmp_path / "w.mp4", PICTURES, 25)  # no warning
    assert codec_of(tmp_path / "w.mp4") == ("h264", len(PICTURES), (64, 46))


@pytest.mark.filterwarnings("always")
@pytest.mark.usefixtures("bare")
def test_a_command_writes_the_rest_and_says_so_in_one_line_each(tmp_path, capsys):
    seq = st.synth.sequence(
        st.SDF.sphere(0.06, voxels=24), 2, camera=st.Camera(60, 60, 31.5, 23.5, 64, 48), seed=1
    )
    st.save_sequence(tmp_path / "s", seq)
    seq.models[1].save(tmp_path / "ball.ply")
    arguments = [str(tmp_path / "s"), "--model", str(tmp_path / "ball.ply"), "--init", "gt", "--voxels", "24"]
    assert run(["track", *arguments, "--out", str(tmp_path / "o"), "-q"]) in (0, 3)
    assert capsys.readouterr().err.count("pip install 'sdftrack[video]'") == 1
    assert run(["evaluate", str(tmp_path / "o"), str(tmp_path / "s"), "-q"]) == 0
    assert capsys.readouterr().err.count("pip install 'sdftrack[plots]'") == 1
    written = {p.name for p in (tmp_path / "o").rglob("*")}
    assert {"overlay.mp4", "report.json", "poses.csv", "result.json", "table.txt"} <= written
    assert not any(name.endswith(".png") for name in written)


def stream(address):
    return lambda: open_stream(address, ["duck"], CAMERA)


@pytest.mark.parametrize(
    ("use", "package", "extra"),
    [
        (stream("ws://localhost:0"), "websockets", "stream"),
        (stream("osc://localhost:9"), "pythonosc", "stream"), (stream("mcap:poses.mcap"), "mcap", "bags"),
        (stream("mcap:poses.mcap"), "rosbags", "bags"), (stream("foxglove:"), "foxglove", "foxglove"),
        (stream("foxglove:"), "foxglove.websocket", "foxglove"), (stream("foxglove:"), "rosbags", "bags"),
        (lambda: Viewer(st.SDF.sphere(0.1, voxels=16), CAMERA, port=0), "viser", "viewer"),
        (lambda: open_camera("realsense:"), "pyrealsense2", "realsense"),
        (lambda: st.motion.save("a.c3d", trajectory()), "ezc3d", "motion"),
        (lambda: st.motion.load(C3D), "ezc3d", "motion"),
    ],
)  # fmt: skip
def test_a_missing_extra_is_an_import_error_with_the_pip_line(use, package, extra, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, package, None)
    if package == "foxglove":
        monkeypatch.delitem(sys.modules, "foxglove.websocket", raising=False)
    with pytest.raises(ImportError, match=rf"pip install 'sdftrack\[{extra}\]'"):
        use()
    assert list(tmp_path.iterdir()) == []
