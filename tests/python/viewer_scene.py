# SPDX-License-Identifier: MIT
"""A small tracked scene for the tests of the viewer: frames of a duck, with their results."""

import contextlib
import time
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

import sdftrack as st

CAMERA = st.Camera(210.0, 210.0, 159.5, 119.5, 320, 240)


@cache
def scene():
    """Sequence, volume and one result per frame."""
    mesh = st.synth.duck_mesh()
    sequence = st.synth.sequence(mesh, 6, noise=0.001, clutter="objects", seed=4, camera=CAMERA)
    sdf = st.SDF.from_mesh(mesh, voxels=60)
    tracker = st.Tracker(sdf, CAMERA)
    results = [tracker.start(sequence[0], poses=[sequence.ground_truth[0][0]])]
    results += [tracker.track(sequence[i]) for i in range(1, len(sequence))]
    return sequence, sdf, results


def wait_until(true, seconds=20.0):
    """Wait for something that another thread or the browser does; an AssertionError if it does not come."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def drawn(viewer, count):
    """Wait until so many frames are drawn, without an error."""
    wait_until(lambda: viewer._drawer.drawn >= count or viewer._drawer.error)
    assert viewer._drawer.error is None


@contextlib.contextmanager
def watched(viewer, monkeypatch):
    """As if a page were open, for tests without a browser."""
    monkeypatch.setattr(viewer._server, "pages", lambda: 1)
    viewer._drawer.again()
    yield
    monkeypatch.undo()


def quaternion_matrix(wxyz):
    return Rotation.from_quat(np.roll(wxyz, -1)).as_matrix()
