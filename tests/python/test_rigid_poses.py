# SPDX-License-Identifier: MIT
"""Rotations that are not quite: projected with a warning up to 0.01, refused beyond."""

import json
import warnings

import numpy as np
import pytest

import sdftrack as st
from sdftrack.geometry import pose, rigid
from sdftrack.io.writers import save_sequence
from sdftrack.sdf import SDF


def off(T, by):
    """T with a rotation for which max |R^T R - I| is about `by`."""
    out = T.copy()
    out[:3, :3] = T[:3, :3] @ np.diag([np.sqrt(1 + by), 1, np.sqrt(1 - by / 2)])
    return out


T = pose([0.3, 0.2, -0.5], [0.01, 0.02, 0.6])


@pytest.mark.parametrize("by", [0.002, 0.003, 0.0099])
def test_a_rotation_that_is_off_is_replaced_by_the_nearest_one_with_a_warning(by):
    with pytest.warns(UserWarning, match=f"pose: R.T R differs from I by {by:.2g}"):
        found = rigid(off(T, by), "pose")
    u, _, vt = np.linalg.svd(off(T, by)[:3, :3])
    np.testing.assert_allclose(found[:3, :3], u @ vt, atol=1e-12)
    np.testing.assert_array_equal(found[:3, 3], T[:3, 3])


def test_rounding_is_silent_and_more_than_a_hundredth_an_error():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rigid(off(T, 9e-4))
    for bad in (off(T, 0.0101), off(T, 0.1), np.diag([1.0, 1, -1, 1])):
        with pytest.raises(ValueError, match=r"not a rotation .*at most 0.01"):
            rigid(bad)


def test_a_sequence_warns_once(tmp_path):
    camera = st.Camera(60, 60, 39.5, 29.5, 80, 60)
    seq = st.synth.sequence(
        SDF.box((0.1, 0.08, 0.06), voxels=30).to_mesh(), 4, np.array([T] * 4), camera=camera
    )
    save_sequence(tmp_path / "s", seq, layout="bop")
    path = tmp_path / "s/scene_gt.json"
    truth = json.loads(path.read_text())
    for i, entries in enumerate(truth.values()):
        entries[0]["cam_R_m2c"] = off(T, 0.003 if i else 0.002)[:3, :3].ravel().tolist()
    path.write_text(json.dumps(truth))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with st.open_sequence(tmp_path / "s") as opened:
            np.testing.assert_allclose(opened.ground_truth[2][0][:3, 3], T[:3, 3], atol=1e-6)
    told = [str(w.message) for w in caught if "R^T R" in str(w.message)]
    assert len(told) == 1
    assert "4 poses, the first of them" in told[0]
    assert "up to 0.003" in told[0]
    assert "scene_gt.json, image 0, entry 0" in told[0]
    with pytest.warns(UserWarning, match="4 poses"):
        st.Sequence([seq[i] for i in range(4)], seq.camera, np.array([off(T, 0.003)] * 4))


def test_a_pose_given_to_a_tracker_may_be_off(tmp_path):
    sdf = SDF.box((0.1, 0.08, 0.06), voxels=40)
    camera = st.Camera(130, 130, 79.5, 59.5, 160, 120)
    seq = st.synth.sequence(sdf.to_mesh(), 1, T[None], camera=camera)
    tracker = st.Tracker(sdf, seq.camera)
    with pytest.warns(UserWarning, match="differs from I by 0.003"):
        result = tracker.start(seq[0], poses=[off(T, 0.003)])
    assert str(result.status[0]) == "ok"
