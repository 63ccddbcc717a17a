# SPDX-License-Identifier: MIT
"""A hand that holds the object: fingers on its surface, 60 % of it hidden, of the object's own colours."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack.synth import Grip
from sdftrack.synth.objects import duck_mesh

CAMERA = st.Camera(393.75, 393.75, 239.5, 179.5, 480, 360)
FRAMES = 36
# Without the hand 0.03 mm and 0.04 deg; what is left of the object in view knows its pose four times less well.
# A fit that a hand draws along is off by a finger: 18 mm.
MAX_M, MAX_RAD = 0.0015, np.deg2rad(1.5)


@pytest.fixture(scope="module")
def duck():
    mesh = duck_mesh()
    return mesh, st.SDF.from_mesh(mesh, voxels=120)


def follow(tracker, seq):
    """From the true pose, near the truth in every frame."""
    for i in range(FRAMES):
        T = seq.ground_truth[i][0]
        result = tracker.track(seq[i]) if i else tracker.start(seq[i], poses=[T])
        metres, radians = st.metrics.pose_error(result.pose, T)
        assert metres < MAX_M, i
        assert radians < MAX_RAD, i
        assert result.status[0] in ("ok", "weak"), i


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["depth", "rgbd"])
def test_a_hand_on_the_surface_does_not_draw_the_pose_along(duck, mode):
    mesh, sdf = duck
    held = Grip(0.6, "similar", grow=12)
    seq = st.synth.sequence(
        mesh, FRAMES, noise=0.001, occluder=held, camera=CAMERA, clutter="table", seed=1, threads=1
    )
    tracker = st.Tracker(sdf, CAMERA, mode=mode)
    follow(tracker, seq)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.5, 0.6])
def test_an_object_in_a_fist_is_followed_from_the_first_frame(duck, share):
    """Fingers and palm in contact from the start: a coarse fit slides onto them, 15 to 30 mm away."""
    mesh, sdf = duck
    seq = st.synth.sequence(
        mesh, FRAMES, noise=0.001, occluder=Grip(share, "skin"), camera=CAMERA, clutter="table", seed=2,
        threads=1,
    )  # fmt: skip
    tracker = st.Tracker(sdf, CAMERA, mode="depth", threads=1)
    follow(tracker, seq)
