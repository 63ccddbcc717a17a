# SPDX-License-Identifier: MIT
"""Bags on the command line and as a replayed camera."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import replace

import pytest
from bag_writers import DEPTH_TOPIC, recording, write
from test_bags import CAMERA, scene

import sdftrack as st
from sdftrack.cli.app import run as run_line
from sdftrack.cli.sources import Layout
from sdftrack.io.datasets import LAYOUTS


def run(*args: str) -> tuple[int, str]:
    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
        return run_line([*args]), text.getvalue()


@pytest.mark.slow
def test_a_bag_is_tracked_from_the_command_line(tmp_path):
    camera = st.Camera(300, 300, 159.5, 119.5, 320, 240)
    mesh = st.SDF.box((0.08, 0.05, 0.12), voxels=60).to_mesh()
    mesh.save(tmp_path / "part.ply")
    seq = st.synth.sequence(mesh, 4, camera=camera, noise=0.001, seed=1)
    messages = recording(seq)
    messages += [replace(m, topic="/other/image") for m in messages if m.topic == DEPTH_TOPIC]
    path = write(tmp_path, messages, "ros1")
    start = tmp_path / "start.json"
    start.write_text(json.dumps({"T_cam_obj": [seq.ground_truth[0][0].tolist()]}))
    arguments = f"track {path} --model {tmp_path / 'part.ply'} --init {start} --no-video".split()
    code, text = run(*arguments, "--out", str(tmp_path / "a"))
    assert code == 1
    assert "--depth-topic: " in text
    code, text = run(
        *arguments, "--depth-topic", DEPTH_TOPIC, "--color-topic", "none", "--out", str(tmp_path / "b")
    )
    assert code == 0, text
    report = json.loads((tmp_path / "b" / "report.json").read_text())
    assert report["settings"]["layout"] == "ros1"
    assert len(report["frames"]) == 4


def test_the_help_names_every_layout():
    text = Layout.__dataclass_fields__["layout"].metadata["more"]["help"]
    assert all(name in text for name in LAYOUTS)
    assert Layout(layout="mcap", depth_topic="a").opening == {
        "layout": "mcap", "depth_topic": "a", "color_topic": None
    }  # fmt: skip


def test_a_bag_is_replayed_as_a_camera(tmp_path):
    path = write(tmp_path, recording(scene()), "db3")
    from sdftrack.live import open_camera

    with open_camera(f"replay:{path}", depth_topic=DEPTH_TOPIC) as camera:
        assert camera.camera == st.RGBDCamera(CAMERA)
        frames = list(camera)
    assert 1 <= len(frames) <= len(scene())
    assert all(frame.error == "" for frame in frames)
