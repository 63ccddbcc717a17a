# SPDX-License-Identifier: MIT
"""The dominant plane: against synthetic tables with known normal, and the numpy fit."""

import numpy as np
import pytest

import sdftrack as st
from sdftrack.reference import tracking as twin

CAMERA = st.Camera(fx=260, fy=260, cx=159.5, cy=119.5, width=320, height=240)
NORMAL = np.array([0.1, -0.8, -0.6]) / np.linalg.norm([0.1, -0.8, -0.6])  # a table seen from above, facing us
OFFSET_M = 0.55
NOISE_M = 0.003
# Thousands of readings: the fit is far better than these; a plane that leans on the object is off by degrees.
NORMAL_ATOL_RAD, OFFSET_ATOL_M = np.radians(0.2), 1e-3


def table(noise_m=NOISE_M, seed=0, camera=CAMERA):
    """Depth (m) of the plane n . p + d = 0 with Gaussian noise, 0 beyond 3 m; all in the camera frame."""
    rays = camera.back_project(np.ones(camera.shape, np.float32)).astype(np.float64)
    slope = rays @ NORMAL
    with np.errstate(divide="ignore"):
        z = np.where(slope < 0, -OFFSET_M / slope, 0)
    z = np.where(z < 3, z, 0)
    return np.where(z > 0, z + np.random.default_rng(seed).normal(0, noise_m, z.shape), 0)


def with_object(depth):
    """A box of a fifth of the image that stands in front, and a wall behind: (depth, where the box is)."""
    out = depth.copy()
    on_object = np.zeros(depth.shape, bool)
    on_object[110:200, 120:220] = True
    out[on_object] = 0.45
    out[out == 0] = 3.5
    return out, on_object


def frame_of(depth):
    return st.Frame(depth.astype(np.float32))


def assert_plane(found, atol_rad=NORMAL_ATOL_RAD, atol_m=OFFSET_ATOL_M):
    n, d = found
    assert n @ n == pytest.approx(1)
    assert n @ NORMAL > 0  # towards the camera
    assert np.arccos(np.clip(n @ NORMAL, -1, 1)) < atol_rad
    assert d == pytest.approx(OFFSET_M, abs=atol_m)


@pytest.mark.parametrize("seed", range(4))
def test_a_tilted_table_with_an_object_and_noise_is_found(seed):
    depth, on_object = with_object(table(seed=seed))
    mask, plane = st.remove_plane(frame_of(depth), CAMERA)
    assert_plane(plane)
    assert mask.dtype == bool
    assert mask.shape == CAMERA.shape
    assert mask[on_object].mean() > 0.9  # the box crosses the plane somewhere
    on_table = (table(0) > 0) & ~on_object
    assert mask[on_table].mean() < 0.01  # 10 mm are 3 sigma of the noise, at a slant more


def test_a_pixel_on_the_plane_starts_the_fit():
    depth, _ = with_object(table())
    _, plane = st.remove_plane(frame_of(depth), CAMERA, start_px=(60, 220))
    assert_plane(plane)
    # A pixel on the box leads to the box's own front.
    _, (n, d) = st.remove_plane(frame_of(depth), CAMERA, start_px=(170, 150))
    np.testing.assert_allclose(n, [0, 0, -1], atol=0.02)
    assert d == pytest.approx(0.45, abs=0.002)


def test_holes_and_pixels_without_a_reading_are_neither_plane_nor_object():
    depth, _ = with_object(table())
    depth[::2] = 0
    depth[:, ::3] = np.nan
    mask, plane = st.remove_plane(frame_of(depth), CAMERA)
    assert_plane(plane)
    assert not mask[~(depth > 0)].any()


def test_the_frames_own_camera_is_used_where_none_is_given():
    depth, _ = with_object(table())
    frame = st.Frame(depth.astype(np.float32), camera=CAMERA)
    assert_plane(st.remove_plane(frame)[1])


def test_a_distorted_lens_does_not_bend_the_plane():
    camera = st.Camera(260, 260, 159.5, 119.5, 320, 240, distortion=(0.1, -0.05, 1e-3, 1e-3, 0.0))
    assert_plane(st.remove_plane(frame_of(table(camera=camera)), camera)[1])


def test_the_same_frame_gives_the_same_plane():
    depth, _ = with_object(table())
    one, two = (st.remove_plane(frame_of(depth), CAMERA)[1] for _ in range(2))
    np.testing.assert_array_equal(one[0], two[0])
    assert one[1] == two[1]


def test_the_fit_is_that_of_the_twin():
    depth = table()
    points = CAMERA.back_project(depth.astype(np.float32)).astype(np.float64)[depth > 0]
    n, d = twin.fit_plane(points, NORMAL, OFFSET_M, reach=0.01)
    _, (found, offset) = st.remove_plane(frame_of(depth), CAMERA)
    # The core fits every third reading along each axis: its own error is about 0.07 mrad, 0.1 mm; four times that.
    np.testing.assert_allclose(found, n, atol=3e-4)
    assert offset == pytest.approx(d, abs=4e-4)


def rough():
    return np.random.default_rng(1).uniform(0.4, 3, CAMERA.shape)


@pytest.mark.parametrize(
    ("frame", "arguments", "error", "match"),
    [
        (frame_of(rough()), {"camera": CAMERA}, ValueError, "no plane holds a tenth"),
        (frame_of(np.zeros(CAMERA.shape)), {"camera": CAMERA}, ValueError, "no plane"),
        (frame_of(table()), {}, ValueError, "camera: expected the depth camera, got None"),
        (st.Frame(None, np.zeros((*CAMERA.shape, 3), np.uint8)), {"camera": CAMERA}, ValueError, "depth"),
        (frame_of(table()), {"camera": CAMERA, "tolerance": 0}, ValueError, "tolerance"),
        (frame_of(table()), {"camera": CAMERA, "tolerance": float("nan")}, ValueError, "tolerance"),
        (frame_of(table()), {"camera": CAMERA, "start_px": (320, 10)}, ValueError, "start_px"),
        (frame_of(table()), {"camera": CAMERA, "start_px": (-1, 10)}, ValueError, "start_px"),
        (frame_of(table()[:100]), {"camera": CAMERA}, ValueError, "depth"),
        (frame_of(table()), {"camera": np.eye(3)}, TypeError, "camera"),
    ],
    ids=[
        "rough",
        "empty",
        "no camera",
        "no depth",
        "tolerance 0",
        "tolerance nan",
        "right",
        "left",
        "size",
        "type",
    ],
)
def test_without_a_plane_or_with_bad_input_it_says_what_is_wrong(frame, arguments, error, match):
    with pytest.raises(error, match=match):
        st.remove_plane(frame, **arguments)


def test_the_tracker_can_leave_the_table_out():
    shape = st.SDF.box([0.12, 0.09, 0.06], voxels=80)
    y = -NORMAL  # the box stands on the table
    x = np.cross(y, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, y, np.cross(x, y)])
    foot = np.array([0.02, 0.0, 0.6])
    foot -= NORMAL * (foot @ NORMAL + OFFSET_M)
    T[:3, 3] = foot + 0.045 * NORMAL
    body = shape.render(CAMERA, T)[0].astype(np.float64)
    ground = table(noise_m=0.0)
    depth = np.where((body > 0) & ((body < ground) | (ground == 0)), body, ground)
    depth = np.where(depth > 0, depth + np.random.default_rng(0).normal(0, 0.001, depth.shape), 0)
    pixels = {}
    for drop in (False, True):
        result = st.Tracker(shape, CAMERA, threads=1, drop_plane=drop).start(frame_of(depth), poses=[T])
        assert result.ok
        pixels[drop] = result.steps[0][-1].pixels
    assert pixels[True] < 0.95 * pixels[False]  # those of the table beside the box
    assert np.linalg.norm(result.pose[:3, 3] - T[:3, 3]) < 5e-4  # m; a strip along the foot is gone with it
