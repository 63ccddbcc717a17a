# SPDX-License-Identifier: MIT
"""``sdftrack track --mode rgb`` and ``--outline``: what is followed by the outline in the colour image."""

from __future__ import annotations

import json

import numpy as np
import pytest

import sdftrack as st
from sdftrack.cli.app import run
from sdftrack.geometry import pose
from sdftrack.sdf import SDF

CAMERA = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
FRAMES = 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A red box before a wall, as a BOP scene."""
    path = tmp_path_factory.mktemp("outline")
    box = SDF.box((0.12, 0.09, 0.06), voxels=60).to_mesh()
    red = st.Mesh(box.vertices, box.faces, np.tile([200, 30, 30], (len(box.vertices), 1)).astype(np.uint8))
    red.save(path / "box.ply")
    T = np.array([pose([0.5, 0.3, 0.1 + 0.02 * i], [0.003 * i, 0, 0.5]) for i in range(FRAMES)])
    seq = st.synth.sequence(red, FRAMES, T, noise=0.001, camera=CAMERA, clutter="wall", seed=5)
    st.save_sequence(path / "scene", seq, layout="bop")
    return path


def track(folder, out, *more):
    start = f"track {folder / 'scene'} --model {folder / 'box.ply'} --unit m --out {out}".split()
    return run([*start, "--no-video", "--voxels", "60", "-q", *more])


def report(out):
    return json.loads((out / "report.json").read_text())


def test_by_colour_alone_every_frame_is_weak_and_near(folder, tmp_path):
    assert track(folder, tmp_path / "rgb", "--mode", "rgb") == 0
    assert report(tmp_path / "rgb")["settings"]["mode"] == "rgb"
    with st.open_sequence(folder / "scene") as seq:
        lines = np.loadtxt(tmp_path / "rgb/trajectory_0.txt", ndmin=2)
        assert len(lines) == FRAMES
        for line, i in zip(lines, range(FRAMES), strict=True):
            assert np.linalg.norm(line[1:3] - seq.ground_truth[i][0][:2, 3]) < 0.002


@pytest.mark.parametrize("more", [(), ("--outline",), ("--no-outline",)])
def test_the_outline_is_read_where_it_is_asked_for(folder, tmp_path, more):
    assert track(folder, tmp_path / "out", *more) == 0
    assert report(tmp_path / "out")["settings"]["tracker"]["outline"] is ("--no-outline" not in more)
