# SPDX-License-Identifier: MIT
"""What the first frame leaves for an unknown object: its mask's cone, above the table; and bodies solid inside."""

import numpy as np
import pytest
from reconstruction_scene import begun

import sdftrack as st
from experiments.synth.standing import standing
from sdftrack.reconstruction import reconstructor as module

CAMERA = st.Camera(200.0, 200.0, 79.5, 59.5, 160, 120)
FRAMES, VOXELS, VOXEL_M = 24, 96, 0.004


@pytest.fixture(scope="module")
def duck():
    from sdftrack.synth.objects import duck_mesh

    return duck_mesh()


def on_table(duck, n=FRAMES, **options):
    return standing(duck, n, camera=CAMERA, distance_m=0.45, turns=0.3, seed=2, **options)


@pytest.fixture(scope="module")
def scene(duck):
    return on_table(duck)


def first(seq):
    return seq[0].depth, seq.masks(0)[0]


def off_truth(star, results, seq):
    """Distance (m) of the seen vertices from the true surface."""
    mesh = star.mesh()
    T = np.linalg.solve(seq.ground_truth[0][0], results[0].pose)
    seen = mesh.vertices[mesh.seen >= 0.5] @ T[:3, :3].T + T[:3, 3]
    return np.abs(st.SDF.from_mesh(seq.models[1], voxels=100)(seen))


# --- where the object can be
@pytest.mark.parametrize("where", ["mask", "box"])
def test_a_piece_of_the_table_is_no_object(scene, where):
    depth, mask = first(scene)
    rows = slice(95, 118) if not mask[95:118].any() else slice(0, 20)
    star = st.Reconstructor(CAMERA, voxels=48)
    place = np.zeros(CAMERA.shape, bool)
    place[rows, 20:70] = True
    how = {"mask": place} if where == "mask" else {"box": (20, rows.start, 50, rows.stop - rows.start)}
    with pytest.raises(ValueError, match=r"plane.*planes=False"):
        star.start(st.Frame(depth), **how)
    assert "not started" in repr(star)


# --- whole reconstructions
@pytest.mark.slow
@pytest.mark.parametrize("taken_up_at", [None, 8])
@pytest.mark.parametrize("mode", ["depth", "rgbd"])
def test_an_object_on_a_table_comes_out_alone(duck, taken_up_at, mode):
    seq = on_table(duck, taken_up_at=taken_up_at)
    star, results = begun(len(seq), seq, voxels=VOXELS, mode=mode)
    # A view of the round back alone may not determine a turn, and says so.
    others = [r for r in results if not r.ok]
    assert all(r.reason[0].startswith("undetermined") for r in others)
    assert len(others) < 0.3 * len(results)
    off = off_truth(star, results, seq)
    assert len(off) > 2000
    assert np.median(off) < 0.0006
    assert (off > 2 * VOXEL_M).mean() < 0.005


def test_a_box_around_an_object_on_a_table_takes_the_object(scene):
    _, mask = first(scene)
    rows, columns = np.nonzero(mask)
    box = (columns.min() - 6, rows.min() - 6, np.ptp(columns) + 13, np.ptp(rows) + 13)
    star = st.Reconstructor(CAMERA, voxels=VOXELS)
    star.start(scene[0], box=tuple(int(v) for v in box))
    taken = star._beginning.on_object
    assert (taken & ~mask).sum() < 0.05 * mask.sum()
    assert (taken & mask).sum() > 0.85 * mask.sum()


# --- solid inside
def test_a_body_seen_all_round_has_its_volume():
    """A brick, larger than what frames say of its inside."""
    brick = st.SDF.box((0.12, 0.1, 0.08), voxels=80).to_mesh()
    n = 48
    poses = [
        st.geometry.pose([0, 2 * np.pi * i / 24, 0] if i < 24 else [2 * np.pi * i / 24, 0, 0], [0, 0, 0.45])
        for i in range(n)
    ]
    seq = st.synth.sequence(brick, n, np.array(poses), 0.001, camera=CAMERA, clutter="wall", seed=1)
    star = st.Reconstructor(CAMERA, voxels=80, threads=1)
    star.start(seq[0], mask=seq.masks(0)[0])
    for i in range(1, n):  # the truth, so that nothing but the fusion is judged
        moved = seq.ground_truth[i][0] @ np.linalg.inv(seq.ground_truth[0][0])
        star._add(seq[i], moved @ star._beginning.T_cam_obj)
    corner = star.mesh().vertices[star.mesh().faces]
    volume = np.einsum("ij,ij->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6
    assert volume == pytest.approx(0.12 * 0.1 * 0.08, rel=0.02)


def test_the_seen_part_of_a_mesh_has_nothing_that_is_guessed(scene):
    star, _ = begun(4, scene, voxels=VOXELS)
    whole, part = star.mesh(), star.mesh(seen_only=True)
    assert 0.2 * len(whole.faces) < len(part.faces) < 0.9 * len(whole.faces)
    assert part.seen.min() >= star.options.min_seen
    assert part.colors is not None
    assert set(map(tuple, part.vertices)) <= set(map(tuple, whole.vertices))


# --- refine
def test_a_refinement_that_explains_the_frames_worse_is_not_taken(scene, monkeypatch):
    star, _ = begun(8, scene, voxels=VOXELS)
    shape, poses = star.shape.values.copy(), [k.T_cam_obj.copy() for k in star._kept]

    def worse(keyframes, *arguments):
        for k in keyframes[1:]:
            k.T_cam_obj = k.T_cam_obj @ st.geometry.pose([0.1, 0, 0], [0.004, 0, 0])
        arguments[2](lambda share: None)
        return module.refining.Refined({}, 1, [0.0], [0.0])

    monkeypatch.setattr(module.refining, "refine", worse)
    refined = star.refine()
    assert not refined.taken
    assert refined.misfit_m[1] > refined.misfit_m[0]
    np.testing.assert_array_equal(star.shape.values, shape)
    for k, pose in zip(star._kept, poses, strict=True):
        np.testing.assert_array_equal(k.T_cam_obj, pose)
