# SPDX-License-Identifier: MIT
"""A duck before a camera, and a page whose user does something at certain frames."""

import json
import time

import numpy as np

import sdftrack as st
from sdftrack.synth.objects import duck_mesh
from support.faulty_camera import FaultyCamera

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


def box_of(mask, margin=3):
    """x, y, width and height around a mask."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    more = 2 * margin + 1
    return columns[0] - margin, rows[0] - margin, np.ptp(columns) + more, np.ptp(rows) + more


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

    def wait_for(self, count):
        """Until so many frames are shown: a camera that waits skips none on a busy machine."""
        end = time.monotonic() + 60
        while len(self.shown) < count:
            assert time.monotonic() < end, f"the page shows {len(self.shown)} of {count} frames"
            time.sleep(0.001)


class PatientCamera(FaultyCamera):
    """One that hands a frame out when the page has shown all before it."""

    def __init__(self, sequence, page, **faults):
        super().__init__(sequence, real_time=False, **faults)
        self._page, self._given = page, 0

    def read(self):
        self._page.wait_for(min(self._given, len(self._sequence) - 1))  # the end comes at once
        self._given += 1
        return super().read()
