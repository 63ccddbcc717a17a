# SPDX-License-Identifier: MIT
"""A recorded sponge, unknown, lifted and turned by hands before a Kinect. Skipped where the recording is not there."""

import numpy as np
import pytest

import sdftrack as st

FIRST, END = 46, 125
VOXELS = 200


@pytest.fixture(scope="module")
def sponge(data_dir):
    path = data_dir / "k1"
    if not path.is_dir():
        pytest.skip(f"recorded data absent: {path}")
    with st.open_sequence(path) as seq:
        star = st.Reconstructor(seq.camera, voxels=VOXELS, threads=1)
        results = [star.start(seq[FIRST], mask=seq.masks(FIRST)[0])]
        results += [star.track(seq[i]) for i in range(FIRST + 1, END)]
        yield star, results, {i: seq.ground_truth[i][0] for i in seq.ground_truth}, seq.models[1]


@pytest.mark.slow
def test_it_is_never_lost(sponge):
    _, results, _, _ = sponge
    assert all(r.status[0] in ("ok", "weak") for r in results)
    assert sum(r.ok for r in results) > 0.9 * len(results)


def test_what_was_seen_is_the_sponge_and_no_hand(sponge):
    star, results, reference, model = sponge
    mesh = star.mesh()
    to_model = np.linalg.solve(reference[FIRST], results[0].pose)
    seen = mesh.vertices[mesh.seen >= 1] @ to_model[:3, :3].T + to_model[:3, 3]
    off = np.abs(st.SDF.from_mesh(model, voxels=100)(seen))
    assert len(seen) > 3000
    assert off.mean() < 0.003  # the reference pose and mesh are themselves good to some millimetres
    # A rim of the table and of a thumb stay where they touched; measured 0.983.
    assert (off < 0.008).mean() > 0.97


def test_poses_agree_with_the_references(sponge):
    _, results, reference, _ = sponge
    to_model = np.linalg.solve(results[0].pose, reference[FIRST])
    for i in (64, 80, 90, 98):
        metres, radians = st.metrics.pose_error(results[i - FIRST].pose @ to_model, reference[i])
        assert metres < 0.006
        assert radians < np.radians(4)


def test_two_at_once_are_what_each_is_alone(data_dir):
    path, frames, voxels = data_dir / "k1", 10, 96
    if not path.is_dir():
        pytest.skip(f"recorded data absent: {path}")
    with st.open_sequence(path) as seq:
        masks = seq.masks(0)
        assert len(masks) == 2

        def begun(k):
            star = st.Reconstructor(seq.camera, voxels=voxels, threads=2)
            star.start(seq[0], mask=masks[k])
            return star

        both = [begun(k) for k in sorted(masks)]
        together = [[star.track(seq[i]).pose for star in both] for i in range(1, frames)]
        for n, k in enumerate(sorted(masks)):
            alone = begun(k)
            poses = [alone.track(seq[i]).pose for i in range(1, frames)]
            assert np.array_equal(poses, [p[n] for p in together])
            assert np.array_equal(alone.shape.values, both[n].shape.values)
