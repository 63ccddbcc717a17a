# SPDX-License-Identifier: MIT
"""The loop of contour tracker and shape memory: its colours, and whole videos."""

from itertools import pairwise

import numpy as np
import pytest

import sdftrack as st
from experiments.contour.closed_loop import follow
from experiments.synth.gait import gait
from experiments.synth.gait_video import gait_video
from sdftrack import _core
from sdftrack.metrics import iou

GAIN = 0.1  # of the mean overlap with the whole figure while a bar sweeps over it; measured 0.3 and more for these
NOTHING_LOST = 0.01


def test_colours_that_neither_side_has_are_no_evidence():
    y, x = np.mgrid[:60, :80]
    mask = np.hypot(x - 40, y - 30) < 14
    image = np.where(mask[..., None], [200, 60, 40], [90, 100, 110]).astype(np.uint8)
    core = _core.ContourCore(_core.ContourOptions())
    core.start_mask(image, mask)
    covered = image.copy()
    covered[:, 38:46] = [20, 30, 220]
    observation = core.observe(covered)
    posterior = core.posterior_on_grid(covered)
    cells = np.array([[30, 20], [42, 20], [5, 5]])  # (column, row)
    u, v = np.round((observation.warp @ [*cells.T, [1, 1, 1]])[:2]).astype(int)
    truth = [0.5 if 38 <= a < 46 else float(mask[b, a]) for a, b in zip(u, v, strict=True)]
    assert 0.5 in truth
    np.testing.assert_allclose(posterior[cells[:, 1], cells[:, 0]], truth, atol=0.05)


@pytest.fixture(scope="module")
def videos():
    return {k: gait_video(k, 105, during=(65, 100), size=(240, 180)) for k in ("jumper", "cat")}


@pytest.mark.parametrize("kind", ["jumper", "cat"])
def test_a_memory_gains_while_a_bar_sweeps_over_the_figure_and_loses_nothing_before(kind, videos):
    plain = follow(videos[kind], None, burn_in=50)
    memory = follow(videos[kind], st.contour.ShapeMemory(), burn_in=50)
    assert memory.during > plain.during + GAIN
    assert memory.before > plain.before - NOTHING_LOST
    assert memory.judgements["occluded"] > 5
    assert memory.judged_before["occluded"] == 0


def test_what_a_bar_begins_to_cover_is_not_learned(videos):
    video, memory = videos["jumper"], st.contour.ShapeMemory()
    tracker = st.contour.ContourTracker(memory=memory, burn_in=50)
    tracker.start(video.images[0], mask=video.whole[0])
    learnt = []
    for image in video.images[1:]:
        said = tracker.track(image).judgement
        learnt.append((said, memory.n_learnt))
    while_occluded = [b[1] - a[1] for a, b in pairwise(learnt) if b[0] in ("occluded", "novel")]
    assert len(while_occluded) > 5
    assert sum(while_occluded) == 0


def test_a_fence_or_a_hole_leaves_no_other_shape_behind():
    for thing in ("fence", "window"):
        video = gait_video("hand", 85, thing, during=(65, 80), size=(240, 180))
        tracker = st.contour.ContourTracker(memory=st.contour.ShapeMemory(), burn_in=50)
        tracker.start(video.images[0], mask=video.whole[0])
        for k, image in enumerate(video.images[1:], start=1):
            result = tracker.track(image)
            if result.judgement == "occluded":
                # What was filled in is nearer to the whole than what is seen is.
                assert iou(result.mask, video.whole[k]) > iou(video.seen[k], video.whole[k])


def test_a_memory_that_was_taught_before_serves_another_tracker():
    video = gait_video("jumper", 60, during=(20, 50), size=(240, 180), seed=0)
    memory = st.contour.ShapeMemory()
    for mask in gait("jumper", 120, seed=3):
        memory.learn(mask)
    plain, with_it = follow(video, None, burn_in=5), follow(video, memory, burn_in=5)
    assert with_it.during > plain.during + GAIN
