# SPDX-License-Identifier: MIT
"""Frames that do not show the moment they claim to: named, and never `ok`."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack.synth.objects import duck_mesh

CAMERA = st.Camera(262.5, 262.5, 159.5, 119.5, 320, 240)
REPEATED, TIME = "repeats the previous one; the pose", "timestamp"
FRAMES = 12


@pytest.fixture(scope="module")
def moving():
    """A duck that moves by some millimetres per frame, with 1 mm of noise; its volume."""
    duck = duck_mesh()
    seq = st.synth.sequence(duck, FRAMES, noise=0.001, camera=CAMERA, clutter="wall", seed=5)
    return seq, st.SDF.from_mesh(duck, voxels=80)


def follow(moving, change=lambda i, frame, before: frame, **options):
    """Results; `change` makes the frame that is given of the recorded one and the one given before."""
    seq, sdf = moving
    tracker = st.Tracker(sdf, CAMERA, threads=1, **options)
    before, results = None, []
    for i in range(FRAMES):
        before = change(i, seq[i], before)
        results.append(tracker.track(before) if i else tracker.start(before, poses=seq.ground_truth[0][0]))
    return results


def test_no_frame_of_a_sound_sequence_is_named(moving):
    assert [r.reason[0] for r in follow(moving)] == [""] * FRAMES


@pytest.mark.parametrize("mode", ["depth", "auto"])
@pytest.mark.parametrize("timed", [True, False])
def test_a_repeated_depth_image_is_weak_and_its_covariance_holds_the_motion(moving, mode, timed):
    repeated = (5, 9)

    def change(i, frame, before):
        depth = before.depth if i in repeated else frame.depth
        return st.Frame(depth, frame.color, timestamp=i / 30 if timed else None)

    results = follow(moving, change, mode=mode, max_systematic_m=0.0)
    for i, result in enumerate(results):
        assert (REPEATED in result.reason[0]) == (i in repeated)
        assert str(result.status[0]) == ("weak" if i in repeated else "ok")
    for i in repeated:
        error_m, error_rad = st.metrics.pose_error(results[i].pose, moving[0].ground_truth[i][0])
        sd = np.sqrt(np.diag(results[i].covariance))
        assert error_m < 3 * sd[:3].max()
        assert error_rad < 3 * sd[3:].max()
        assert sd[:3].max() > 10 * np.sqrt(np.diag(results[i - 1].covariance))[:3].max()


@pytest.mark.parametrize(
    ("times", "bad", "said"),
    [
        ([0, 1, 2, 3, 4, 4, 5, 6, 7, 8, 9, 10], 5, "equals that of the previous"),
        ([0, 1, 2, 3, 4, 1.5, 2, 3, 4, 5, 6, 7], 5, "is earlier than that"),
        ([0, 1, 2, 3, 4, 5, 25, 26, 27, 28, 29, 30], 6, "jumps"),
    ],
)
def test_times_that_do_not_go_on_are_named_once(moving, times, bad, said):
    results = follow(moving, lambda i, f, before: st.Frame(f.depth, f.color, timestamp=times[i] / 30))
    assert [i for i, r in enumerate(results) if TIME in r.reason[0]] == [bad]
    assert said in results[bad].reason[0]
    assert str(results[bad].status[0]) == "weak"
