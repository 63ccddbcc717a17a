# SPDX-License-Identifier: MIT
"""The far side that a reconstruction guesses from the first frame."""

from __future__ import annotations

import numpy as np
import pytest

import sdftrack as st
from sdftrack import _core
from tests.reference.guess import guessed_back

CAMERA = st.Camera(200.0, 190.0, 79.5, 59.5, 160, 120)
AWAY_M, RADIUS_M = 0.5, 0.06


def seen(shape, T=None):
    depth, _ = shape.render(CAMERA, np.eye(4) if T is None else T)
    return depth


def ball(x_m=0.0):
    T = np.eye(4)
    T[:3, 3] = x_m, 0.0, AWAY_M
    return seen(st.SDF.sphere(RADIUS_M, voxels=80), T)


def back_of(depth, mask, **options):
    found = _core.find_object(
        depth.astype(np.float32),
        None,
        mask.astype(np.uint8),
        CAMERA._core,
        None,
        st.ReconstructorOptions(**options),
    )
    return -np.asarray(found.from_m)


def tilted_box(turn):
    T = np.eye(4)
    c, s = np.cos(turn), np.sin(turn)
    T[:3, :3] = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    T[:3, 3] = 0.01, -0.01, AWAY_M
    return seen(st.SDF.box((0.06, 0.08, 0.1), voxels=80), T)


def rod():
    """Wider than one cell for each of its pixels."""
    T = np.eye(4)
    T[2, 3] = AWAY_M
    return seen(st.SDF.box((0.36, 0.05, 0.05), voxels=120), T)


@pytest.mark.parametrize("case", ["ball", "box", "noisy", "hole", "cut", "occluded", "long"])
def test_is_what_the_slow_twin_says(case):
    rng = np.random.default_rng(0)
    depth = {"ball": ball, "cut": lambda: ball(0.19), "long": rod}.get(case, lambda: tilted_box(0.6))()
    mask = depth > 0
    if case == "noisy":
        depth = np.where(mask, depth + rng.normal(0, 0.002, depth.shape), 0)
        depth[60, 80] = 2.0  # something else's
    if case == "hole":
        depth[55:62, 75:82] = 0
    if case == "occluded":
        depth[:, 84:] = 0.3
        mask = mask & (np.arange(160) < 84)
    depth = depth.astype(np.float32)
    back = back_of(depth, mask, planes=False, mask_margin_px=0)
    expected = guessed_back(depth.astype(np.float64), mask, CAMERA)
    assert (expected[mask] > 0).mean() > 0.97
    np.testing.assert_allclose(back[mask & (expected > 0)], expected[mask & (expected > 0)], atol=2e-5)


def test_a_ball_is_guessed_to_be_one():
    depth = ball()
    mask = depth > 0
    back = back_of(depth, mask)
    v, u = np.nonzero(mask)
    ray = np.c_[(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(len(u))]
    far = ray * back[mask][:, None] - [0, 0, AWAY_M]
    off = np.linalg.norm(far, axis=1) - RADIUS_M
    assert np.abs(np.median(off)) < 0.004
    assert np.quantile(np.abs(off), 0.9) < 0.01


def test_where_the_image_or_another_thing_cuts_the_object_it_does_not_end():
    whole = back_of(ball(), ball() > 0)[60, 79]
    depth = ball()
    depth[:, 81:] = 0.3  # something before its right half
    mask = (depth > 0.3) & (np.arange(160) < 81)
    assert np.abs(back_of(depth, mask)[60, 79] - whole) < 0.015
    open_side = np.where(np.arange(160) < 81, ball(), 0).astype(np.float32)  # nothing is there: it ends
    assert back_of(open_side, open_side > 0)[60, 79] < whole - 0.02


def slanted(turn=0.5):
    """A cylinder that leads away from the camera, before a wall: deeper than its image is wide."""
    T = np.eye(4)
    c, s = np.cos(turn), np.sin(turn)
    T[:3, :3] = np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    T[2, 3] = AWAY_M
    on = seen(st.SDF.cylinder(0.02, 0.16, voxels=120), T)
    return np.where(on > 0, on, 1.0).astype(np.float32)


def volume_of(star):
    mesh = star.mesh()
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return abs(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6


VOLUME_M3 = np.pi * 0.02**2 * 0.16


@pytest.mark.parametrize("place", ["mask", "box"])
def test_a_cylinder_that_leads_away_is_guessed_whole(place):
    depth = slanted()
    rows, columns = np.nonzero(depth < 1)
    box = (columns.min() - 4, rows.min() - 4, np.ptp(columns) + 9, np.ptp(rows) + 9)
    star = st.Reconstructor(CAMERA, voxels=64, mode="depth", planes=False)
    star.start(st.Frame(depth), **({"mask": depth < 1} if place == "mask" else {"box": box}))
    # As deep as its image is wide, and flat at the back, it would be a third.
    assert 0.7 < volume_of(star) / VOLUME_M3 < 1.2


def test_a_mask_that_is_a_little_too_large_changes_little():
    depth = slanted()
    mask = depth < 1
    wide = mask.copy()
    for _ in range(2):
        wide[1:-1, 1:-1] |= wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
    tight, loose = back_of(depth, mask, planes=False), back_of(depth, wide, planes=False)
    assert np.median(np.abs(loose[mask] - tight[mask])) < 0.006


def test_a_given_shape_is_not_cut():
    depth = np.where(ball() > 0, ball(), 1.0).astype(np.float32)
    deep = st.SDF.box((0.1, 0.1, 0.2), voxels=60)  # to 4 cm behind the ball
    star = st.Reconstructor(CAMERA, voxels=64, mode="depth", initial=deep)
    result = star.start(st.Frame(depth), mask=depth < 1)
    far = (star.mesh().vertices @ result.pose[:3, :3].T + result.pose[:3, 3])[:, 2].max()
    assert far > AWAY_M + RADIUS_M + 0.02


def test_where_nothing_can_be_guessed_the_mask_bounds_it():
    depth = np.full((120, 160), 1.0, np.float32)
    depth[20:100, 79:81] = 0.5  # two pixels wide
    found = back_of(depth, depth < 1)
    assert (found[20:100, 79:81] == 0).all()


def test_beyond_a_mask_that_does_not_bound_it_it_ends_at_its_deepest():
    depth = slanted()
    mask = depth < 1
    found = back_of(depth, mask, keep_to_mask=False, mask_margin_px=0)
    np.testing.assert_array_equal(found[~mask], found[mask].max())
    assert found[mask].max() > depth[mask].max()
