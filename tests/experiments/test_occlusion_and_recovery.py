# SPDX-License-Identifier: MIT
"""The measuring commands on synthetic scenes, in small."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.common.pose_errors import Errors
from experiments.common.tracked_scene import Run
from experiments.tracking import recovery
from sdftrack.synth.duck import duck_mesh


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    (folder / "meshes").mkdir()
    duck_mesh().save(folder / "meshes" / "duck.ply")
    return folder


def _run(status, off_frames=()):
    n = len(status)
    metres = np.full(n, 0.001)
    metres[list(off_frames)] = 0.5
    errors = Errors(metres, np.zeros(n), np.zeros((n, 3)), np.zeros(n))
    return Run(errors, list(status), [0.001] * n)


def test_a_trial_is_judged_by_the_truth():
    good = _run(["ok"] * 5 + ["weak", "lost", "lost", "lost"] + ["lost", "ok", "ok"], [5, 6, 7, 8, 9])
    assert recovery.judge(good, 5, 4) == recovery.Trial(flagged=2, found=2, false_frames=0, lost_before=0)
    late = _run(["ok"] * 8 + ["lost"] + ["lost"] * 3, range(5, 12))
    assert recovery.judge(late, 5, 4) == recovery.Trial(flagged=4, found=None, false_frames=0, lost_before=0)
    # A wrong place after it was flagged, sure of it: in view again, and before.
    sure = _run(["ok"] * 5 + ["lost", "lost", "ok", "lost"] + ["ok", "ok", "weak"], [5, 6, 7, 8, 9, 10])
    assert recovery.judge(sure, 5, 4) == recovery.Trial(flagged=1, found=3, false_frames=3, lost_before=0)
    # Sure of a pose with nothing to see, however near the truth it is.
    unseen = _run(["ok"] * 5 + ["lost", "lost", "ok", "ok"] + ["ok"] * 3)
    assert recovery.judge(unseen, 5, 4).false_frames == 2
    assert recovery.judge(_run(["ok", "lost", "ok"] + ["lost"] * 3, [2]), 3, 1).lost_before == 2
