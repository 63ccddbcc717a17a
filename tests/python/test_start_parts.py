# SPDX-License-Identifier: MIT
"""Parts of a start in the core against numpy and OpenCV: regions that hang together, their extents, their colours."""

import cv2
import numpy as np
import pytest
from start_parts import click_regions, planes_near
from test_start_by_click import CAMERA, SIZE, pixels_of, table_scene

import sdftrack as st
from reference import start as twin
from sdftrack import _core

STEP_M = 0.03


def hilly(seed):
    """Depths with steps and holes, and pixels that are free."""
    rng = np.random.default_rng(seed)
    depth = cv2.blur(rng.uniform(0.5, 1.2, (70, 90)).astype(np.float32), (7, 7))
    depth[:, 50 + seed :] += 0.3
    depth[rng.random(depth.shape) < 0.05] = 0
    return depth, (depth > 0) & (rng.random(depth.shape) < 0.9)


@pytest.mark.parametrize("seed", range(8))
def test_what_hangs_together_is_that_of_numpy_and_of_opencv(seed):
    depth, free = hilly(seed)
    y, x = np.argwhere(free)[np.count_nonzero(free) // 2 + 7 * seed]
    region = _core.joined(depth, free, [int(x), int(y)], STEP_M)
    np.testing.assert_array_equal(region, twin.joined(depth, free, (y, x), STEP_M))
    blocked = np.pad((~free).astype(np.uint8), 1, constant_values=1)
    before = blocked.copy()
    flags = 8 | cv2.FLOODFILL_MASK_ONLY | (2 << 8)
    cv2.floodFill(depth.copy(), blocked, (int(x), int(y)), 0.0, STEP_M, STEP_M, flags)
    np.testing.assert_array_equal(region, (blocked != before)[1:-1, 1:-1])
    assert 30 < region.sum() < 0.9 * free.sum(), "the scene does not test much"


def test_nothing_hangs_together_with_a_pixel_that_is_not_free():
    depth, free = hilly(0)
    free[30, 40] = False
    assert not _core.joined(depth, free, [40, 30], STEP_M).any()


def test_the_first_region_of_a_click_is_what_hangs_together_without_planes():
    frame, _, _, mask = table_scene(other=True)
    for x, y in pixels_of(mask, 3):
        z = float(frame.depth[y, x])
        rows, columns = twin.window(CAMERA, z, (y, x), twin.AROUND * SIZE)
        apart = np.linalg.norm(
            CAMERA.back_project(frame.depth) - CAMERA.back_project(frame.depth)[y, x], axis=-1
        )
        planes = planes_near(frame.depth, CAMERA, apart < twin.AROUND * SIZE, SIZE, (rows, columns))
        assert planes
        free = (frame.depth > 0) & (apart <= SIZE)
        for plane in planes:
            free[rows, columns] &= ~plane.pixels
        seen = twin.joined(frame.depth, free, (y, x), z * (twin.STEP + twin.STEP_PX / CAMERA.fx))
        bare = st.Frame(frame.depth)
        np.testing.assert_array_equal(click_regions(bare, CAMERA, (x, y), SIZE)[0], seen)


def test_the_largest_plane_is_the_table():
    frame, _, _, _ = table_scene()
    found = planes_near(frame.depth, CAMERA, frame.depth > 0, SIZE)
    assert found[0].normal @ [0, -np.cos(0.6), -np.sin(0.6)] > np.cos(np.deg2rad(0.5))  # of the table
    assert found[0].offset == pytest.approx(0.75 * np.sin(0.6), abs=0.003)


@pytest.mark.parametrize("flat", [True, False])
def test_a_slice_through_a_round_thing_is_no_plane(flat):
    """Of a ball of 12 cm radius a slab as thick as a plane's tolerance holds a cap of 10 cm."""
    rays = CAMERA.back_project(np.ones((CAMERA.height, CAMERA.width), np.float32))
    along, square, away, radius = rays[..., 2], (rays**2).sum(axis=-1), 0.62, 0.12
    root = (away * along) ** 2 - square * (away**2 - radius**2)
    depth = np.where(root > 0, (away * along - np.sqrt(np.maximum(root, 0))) / square, 0)
    if flat:
        depth = np.where(depth > 0, away - radius, 0)
    depth += np.random.default_rng(1).normal(0, 0.001, depth.shape) * (depth > 0)
    found = planes_near(depth.astype(np.float32), CAMERA, depth > 0, 0.05)
    assert len(found) == flat


def touching_boxes():
    """Two boxes of one colour each stand side by side on one level: only their colours part them."""
    depth, color = np.full((120, 160), 1.5, np.float32), np.full((120, 160, 3), 120, np.uint8)
    depth[40:80, 40:80] = depth[40:80, 80:120] = 0.8
    color[40:80, 40:80], color[40:80, 80:120] = (200, 40, 30), (40, 60, 190)
    rng = np.random.default_rng(3)
    depth += rng.normal(0, 0.001, depth.shape).astype(np.float32)
    color = np.clip(color + rng.normal(0, 6, color.shape), 0, 255).astype(np.uint8)
    mask = np.zeros(depth.shape, bool)
    mask[40:80, 40:80] = True
    return depth, color, mask


def test_colours_part_what_touches_in_depth_if_they_are_seen_elsewhere_too():
    depth, color, mask = touching_boxes()
    color[:, 125:] = (40, 60, 190)  # more of the second colour behind
    camera = st.Camera(150.0, 150.0, 79.5, 59.5, 160, 120)
    size = 0.5
    alone = click_regions(st.Frame(depth), camera, (55, 60), size)
    assert max(st.metrics.iou(r, mask) for r in alone) < 0.6
    colored = click_regions(st.Frame(depth, color), camera, (55, 60), size)
    assert max(st.metrics.iou(r, mask) for r in colored) > 0.9
