# SPDX-License-Identifier: MIT
"""A pose without a first pose: the search behind start(masks=, boxes=) and recovery."""

import numpy as np
import pytest
from live_scene import box_of
from test_start_and_recovery import bracket
from tracking_scene import CAMERA, NOISE_M, POSE, SIZE_M, WALL_M, box_mesh, depth_of

import sdftrack as st
from experiments.common.pose_sets import half_turns
from sdftrack import _core, geometry, metrics

FOUND_M = 0.003  # ADD of a found box; noise is 1 mm, a wrong local minimum is beyond 10 mm
AMBIGUOUS = 0.9  # of the first score


def searcher_of(sdf):
    return _core.Searcher((sdf.values, sdf.voxel_size, sdf.origin.tolist()), st.TrackerOptions())


@pytest.fixture(scope="module")
def searcher():
    return searcher_of(st.SDF.box(SIZE_M))


@pytest.fixture(scope="module")
def wedge():
    """A body without any symmetry."""
    return bracket()


def mask_of(T=POSE):
    return (depth_of(T, noise_m=0) < 1).astype(np.uint8)


def scene_of(sdf, T=POSE, seed=0):
    """Noisy depth of a volume before a wall, and its mask."""
    clean, _ = sdf.render(CAMERA, T)
    noisy = clean + np.random.default_rng(seed).normal(0, NOISE_M, clean.shape)
    return np.where(clean > 0, noisy, WALL_M).astype(np.float32), (clean > 0).astype(np.uint8)


def least_add(T):
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * SIZE_M
    return min(metrics.add(T, POSE @ S, corners) for S in half_turns(np.zeros(3)))


def test_every_rotation_comes_once():
    seeds = np.array([_core.seed_rotation(k, 240)[:3, :3].ravel() for k in range(240)])
    assert len(np.unique(np.round(seeds, 9), axis=0)) == 240


@pytest.mark.parametrize(
    ("first", "count", "gap_deg"), [(0, 240, 36), (0, 60, 60), (100, 60, 60), (37, 60, 60)]
)
def test_any_run_of_rotations_leaves_no_large_gap(first, count, gap_deg):
    # Random rotations leave gaps of 40 to 56 degrees at 240 and of 64 to 79 at 60.
    seeds = np.array([_core.seed_rotation(first + k, 240)[:3, :3] for k in range(count)])
    rng = np.random.default_rng(3)
    q, r = np.linalg.qr(rng.normal(size=(500, 3, 3)))
    q *= np.sign(np.einsum("nii->ni", r))[:, None, :]
    q *= np.linalg.det(q)[:, None, None]
    cosine = 0.5 * (np.einsum("aij,bij->ab", q, seeds).max(axis=1) - 1)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < gap_deg


@pytest.mark.parametrize("where", ["mask", "box", "near", "whole image"])
@pytest.mark.parametrize("turn", [[1.71, -1.68, -0.46], [1.87, 0.23, 1.88], [-1.14, 2.2, -0.84]], ids=str)
def test_a_body_without_symmetry_is_found_and_nothing_else_scores_as_much(wedge, where, turn):
    T = geometry.pose(turn, [0.03, -0.02, 0.45])
    depth, mask = scene_of(wedge, T)
    off = T.copy()
    off[:3, 3] += [0.04, -0.03, 0.03]
    query = {
        "mask": {"mask": mask}, "box": {"box": box_of(mask, 2)}, "near": {"near": off, "reach_m": 0.1},
        "whole image": {},
    }[where]  # fmt: skip
    found = searcher_of(wedge).search(depth, CAMERA._core, **query)
    assert metrics.add(found[0]["pose"], T, wedge.to_mesh()) < FOUND_M
    assert len(found) == 1 or found[1]["score"] < AMBIGUOUS * found[0]["score"]


def test_half_of_the_object_may_be_hidden_by_something_nearer(wedge):
    T = POSE.copy()
    depth, mask = scene_of(wedge, T)
    columns = np.flatnonzero(mask.any(axis=0))
    middle = (columns[0] + columns[-1]) // 2
    depth[:, middle : middle + 120] = 0.35
    mask[:, middle : middle + 120] = 0
    found = searcher_of(wedge).search(depth, CAMERA._core, mask=mask)
    assert metrics.add(found[0]["pose"], T, wedge.to_mesh()) < FOUND_M


def test_what_another_object_explains_is_not_searched(searcher):
    depth = depth_of()
    assert searcher.search(depth, CAMERA._core)
    assert searcher.search(depth, CAMERA._core, taken=mask_of()) == []


def test_what_the_colour_excludes_is_not_searched(searcher):
    colour = np.where(mask_of(), np.float32(0.01), np.float32(np.nan))
    assert searcher.search(depth_of(), CAMERA._core, foreground=colour) == []


def test_a_slice_of_the_rotations_is_a_search_of_its_own(searcher):
    slices = [
        searcher.search(depth_of(), CAMERA._core, mask=mask_of(), first_seed=60 * k, seeds=60)
        for k in range(4)
    ]
    assert all(least_add(found[0]["pose"]) < FOUND_M for found in slices)


def test_another_shape_scores_less_than_the_right_one(wedge):
    depth, mask = depth_of(), mask_of()
    right = searcher_of(st.SDF.box(SIZE_M)).search(depth, CAMERA._core, mask=mask)[0]["score"]
    wrong = searcher_of(wedge).search(depth, CAMERA._core, mask=mask)
    assert not wrong or wrong[0]["score"] < AMBIGUOUS * right


@pytest.mark.parametrize("case", ["empty mask", "no depth", "box outside the image", "only a wall"])
def test_nothing_to_look_at_is_an_empty_list(searcher, case):
    depth, query = depth_of(), {"mask": np.zeros(CAMERA.shape, np.uint8)}
    if case == "no depth":
        depth, query = np.zeros_like(depth), {"mask": mask_of()}
    elif case == "box outside the image":
        query = {"box": (CAMERA.width + 10, 10, 50, 50)}
    elif case == "only a wall":
        depth, query = np.full_like(depth, WALL_M), {}
    assert searcher.search(depth, CAMERA._core, **query) == []


def test_a_lens_does_not_hide_the_object(wedge):
    lens = st.Camera(260, 260, 159.5, 119.5, 320, 240, distortion=[-0.1, 0.02, 0, 0, 0])
    mesh = box_mesh()
    depth = mesh.raycast(lens, POSE)[0]
    mask = (depth > 0).astype(np.uint8)
    depth = np.where(depth > 0, depth, WALL_M).astype(np.float32)
    found = searcher_of(st.SDF.box(SIZE_M)).search(depth, lens._core, mask=mask)
    assert least_add(found[0]["pose"]) < FOUND_M
