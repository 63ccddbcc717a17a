# SPDX-License-Identifier: MIT
"""The built-in duck and the scene of the demo."""

from __future__ import annotations

import numpy as np
import pytest

from sdftrack.synth.demo_scene import SWEEP, make_scene
from sdftrack.synth.duck import duck_mesh, field

FIELD_ATOL_M = 5e-4  # linear interpolation of a curved field over 2 mm; measured 3.5e-4


@pytest.fixture(scope="module")
def duck():
    return duck_mesh()


def test_the_duck_is_closed_and_lies_on_its_field(duck):
    edges = np.sort(
        np.concatenate([duck.faces[:, [0, 1]], duck.faces[:, [1, 2]], duck.faces[:, [2, 0]]]), axis=1
    )
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    corners = duck.vertices[duck.faces]
    assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0  # outward
    np.testing.assert_allclose(field(duck.vertices), 0, atol=FIELD_ATOL_M)


def test_the_duck_has_no_symmetry(duck):
    """Mirrored and half-turned about its axes it is another body."""
    low, high = duck.bounds
    points = duck.vertices[::50] - (low + high) / 2
    for signs in ([1, -1, 1], [-1, 1, 1], [1, 1, -1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]):
        assert np.abs(field(points * signs + (low + high) / 2)).max() > 0.005


def test_the_same_seed_gives_the_same_colours(duck):
    np.testing.assert_array_equal(duck.colors, duck_mesh().colors)
    assert (duck.colors != duck_mesh(seed=1).colors).any()


def test_demo_frames_are_repeatable_and_a_hand_hides_part_of_the_duck():
    scene = make_scene(30)
    i = round(30 * sum(SWEEP) / 2)
    frame = scene.frame(i)
    np.testing.assert_array_equal(frame.depth, scene.frame(i).depth)
    np.testing.assert_array_equal(frame.color, scene.frame(i).color)

    def hidden(i):
        depth = scene.duck.raycast(scene.camera, scene.poses[i])[0]
        on = depth > 0
        return float(np.mean(scene.frame(i).depth[on] < depth[on] - 0.01))

    assert max(hidden(i) for i in (17, 18, 19)) > 0.4
    assert hidden(0) < 0.1
