# SPDX-License-Identifier: MIT
"""A duck before a camera, and a page whose user does something at certain frames."""

from __future__ import annotations

import json

import numpy as np

import sdftrack as st
from sdftrack.synth.duck import duck_mesh

CAMERA = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)


def recorded(folder, frames):
    """A duck before a wall: the sequence in memory and in the folder, its mesh, its first pose and the intrinsics."""
    duck = duck_mesh()
    walk = st.synth.random_walk(step_m=0.002, step_rad=0.01)
    seq = st.synth.sequence(duck, frames, walk, 0.001, seed=2, camera=CAMERA, clutter="wall")
    seq = st.Sequence(list(seq), CAMERA, np.stack([seq.ground_truth[i][0] for i in range(frames)]), {1: duck})
    st.save_sequence(folder / "seq", seq)
    duck.save(folder / "duck.ply")
    CAMERA.save(folder / "cam.json")
    (folder / "poses.json").write_text(json.dumps({"T_cam_obj": [seq.ground_truth[0][0].tolist()]}))
    return seq, folder


class Page:
    """A viewer whose user does something at certain frames."""

    url, note, pages = "http://page", "", 1

    def __init__(self, does):
        self.does, self.shown, self.said, self.meshes = does, [], [], []
        self.picture = np.zeros((4, 6, 3), np.uint8)

    def requests(self):
        return self.does.get(len(self.shown), [])

    def show(self, frame, result, **about):
        self.shown.append((frame, result, about))

    def tell(self, text):
        self.said.append(text)

    def set_mesh(self, k, mesh):
        self.meshes.append(mesh)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass
