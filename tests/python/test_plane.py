# SPDX-License-Identifier: MIT
"""The dominant plane: against synthetic tables with known normal, and the numpy fit."""

import numpy as np
import pytest

import sdftrack as st
from reference import plane as twin
from sdftrack import _core
from sdftrack.imaging.plane import KINECT
from sdftrack.synth.noise import Kinect

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
    stripe = (
        np.indices(depth.shape).sum(axis=0) % 16
    )  # narrower holes are those of a registration, and filled
    depth[stripe < 4] = 0
    depth[(stripe >= 8) & (stripe < 11)] = np.nan
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


def rays_of(camera=CAMERA):
    return np.concatenate([camera.rays, np.ones((*camera.shape, 1), np.float32)], axis=-1).astype(np.float64)


def bend_terms(camera=CAMERA):
    v, u = np.mgrid[: camera.height, : camera.width].astype(float)
    half = 0.5 * max(camera.shape)
    return twin.bend_terms((u - 0.5 * (camera.width - 1)) / half, (v - 0.5 * (camera.height - 1)) / half)


@pytest.mark.parametrize("bent", [False, True])
def test_the_fit_is_that_of_the_twin(bent):
    depth = with_object(table())[0].astype(np.float32)
    seen = depth > 0
    first = NORMAL + np.array([0.02, 0.01, 0.0])
    found = _core.fit_plane(depth, CAMERA._core, None, None, first, OFFSET_M, 0.01, KINECT, bent)
    slow = twin.fit(
        rays_of()[seen], depth[seen].astype(float), twin.inverse_plane(first, OFFSET_M), 260, 0.01,
        terms=bend_terms()[seen] if bent else None,
    )  # fmt: skip
    n, d = twin.normal_form(slow.g)
    # Both in double from the same readings; but the camera's ray table, which the twin uses, is float32.
    np.testing.assert_allclose(found[0], n, atol=1e-6)
    assert found[1] == pytest.approx(d, abs=1e-6)
    np.testing.assert_allclose(found[2], slow.bend, atol=1e-6)
    assert found[3] == pytest.approx(slow.scale, rel=1e-3)
    assert bent == bool(np.any(slow.bend))


# Float32 in the core, double in the twin: readings within 1e-6 m of a limit; 3 of 76,800 have been seen.
BORDERLINE_PX = 10


@pytest.mark.parametrize("method", ["rigid", "bent"])
@pytest.mark.parametrize("feet", [False, True])
def test_the_mask_is_that_of_the_twin(method, feet):
    depth = with_object(table())[0].astype(np.float32)
    found = _core.remove_plane(depth, CAMERA._core, None, -1, -1, 0.01, method, KINECT, True, feet, 1)
    mask, n, d, bend, scale = found[:5]
    z, g = depth.astype(float), twin.inverse_plane(n, d)
    out, raised = twin.off_plane(g, rays_of(), z, 260, 0.01, scale=scale, bend=bend_terms() @ bend)
    expected = twin.feet(out, raised, z, 260, 0.01) if feet else out
    assert np.count_nonzero(mask != expected) <= BORDERLINE_PX
    if feet:
        assert np.count_nonzero(expected & ~out) > BORDERLINE_PX  # the box's foot


def test_the_normal_is_as_sure_as_least_squares_can_be():
    """Errors over their theoretical standard error, sigma^2 (sum w r r^T)^-1: 40 pictures, 3 numbers each."""
    clean, rays = table(0), rays_of()
    g, seen = twin.inverse_plane(NORMAL, OFFSET_M), clean > 0
    w = clean[seen] ** 4 / 0.001**2
    covariance = np.linalg.inv(rays[seen].T @ (w[:, None] * rays[seen]))
    whitened = np.linalg.inv(np.linalg.cholesky(covariance))
    errors = []
    for seed in range(40):
        depth = table(0.001, seed).astype(np.float32)
        n, d = _core.fit_plane(depth, CAMERA._core, None, None, NORMAL, OFFSET_M, 0.01, (0.001, 0.0, 0.0))[:2]
        errors.append(whitened @ (twin.inverse_plane(n, d) - g))
    # Tukey's weights cost 5 %; the mean square of 120 numbers scatters by 13 %: three times that.
    assert np.mean(np.square(errors)) == pytest.approx(1.05, abs=0.4)


def test_the_top_of_a_box_is_not_the_table_even_if_it_is_the_larger_plane():
    top_m = 0.12
    low, high = table(seed=1), table(0) * (OFFSET_M - top_m) / OFFSET_M
    on_top = np.zeros(CAMERA.shape, bool)
    on_top[70:, 30:290] = True
    on_top &= high > 0
    depth = np.where(on_top, high + np.random.default_rng(2).normal(0, NOISE_M, high.shape), low)
    assert on_top.sum() > 1.3 * ((depth > 0) & ~on_top).sum()
    mask, plane = st.remove_plane(frame_of(depth), CAMERA)
    assert_plane(plane)
    assert mask[on_top].mean() > 0.99
    # Who starts on the top gets the top.
    _, (_, d) = st.remove_plane(frame_of(depth), CAMERA, start_px=(160, 200))
    assert d == pytest.approx(OFFSET_M - top_m, abs=OFFSET_ATOL_M)


def grazing_floor(seed=0, bend=0.0):
    """A floor 0.6 m below a camera that looks down by 15 degrees, to 4 m, with a Kinect's noise; and a box on it."""
    camera = st.Camera(525, 525, 319.5, 239.5, 640, 480)
    rays = rays_of(camera)
    n = np.array([0, -np.cos(np.radians(15)), -np.sin(np.radians(15))])
    slope = rays @ n
    with np.errstate(divide="ignore"):
        z = np.where(slope < 0, -0.6 / slope, 0)
    z[z > 4] = 0
    box = np.zeros(z.shape, bool)
    box[200:330, 250:400] = True
    depth = np.where(box & (z > 1.5), 1.5, z)
    box = depth != z
    height = (depth[..., None] * rays) @ n + 0.6
    depth = depth * (1 + bend * (rays[..., 0] ** 2 + rays[..., 1] ** 2) / 0.58)
    cosine = np.where(box, 1, np.clip(-slope / np.linalg.norm(rays, axis=-1), 0, 1))
    noisy = Kinect()(depth.astype(np.float32), cosine.astype(np.float32), np.random.default_rng(seed))
    return st.Frame(noisy, check_units=False), camera, box & (noisy > 0), height, n


def test_a_floor_seen_at_a_grazing_angle_is_taken_out_to_its_far_end():
    frame, camera, box, height, n = grazing_floor()
    mask, (found, d) = st.remove_plane(frame, camera)
    floor = (frame.depth > 0) & ~box
    assert frame.depth[floor].max() > 3.4  # beyond, the sensor itself sees nothing at this angle
    assert (~mask[floor]).mean() > 0.99
    assert (~mask[box & (height > 0.01)]).mean() < 0.01
    assert np.degrees(np.arccos(min(1, found @ n))) < 0.05  # 0.005 to 0.02 deg have been seen
    assert d == pytest.approx(0.6, abs=1e-3)


def test_a_sensor_that_bends_planes_needs_the_bent_plane():
    """Depth off by 3 % in the corners: 3 cm at 1 m, up to 10 cm here."""
    frame, camera, box, height, _ = grazing_floor(bend=0.03)
    floor = (frame.depth > 0) & ~box
    taken = {}
    for method in ("rigid", "bent"):
        mask, (_, d) = st.remove_plane(frame, camera, method=method, noise="kinect")
        taken[method] = (~mask[floor]).mean()
    assert taken["rigid"] < 0.98 < taken["bent"]
    assert d == pytest.approx(0.6, abs=2e-3)
    assert (~mask[box & (height > 0.02)]).mean() < 0.01


def test_the_printed_way_extends_the_patch_as_it_is():
    depth, on_object = with_object(table(0.0005))
    mask, plane = st.remove_plane(frame_of(depth), CAMERA, method="printed", start_px=(60, 220))
    assert_plane(plane, np.radians(3), 0.02)  # a patch of 17 pixels: its normal is off by a degree
    n, d = plane
    expected = np.abs(CAMERA.back_project(depth.astype(np.float32)) @ n + d) > 0.01
    assert np.count_nonzero(mask != (expected & (depth > 0))) <= BORDERLINE_PX
    assert mask[on_object].mean() > 0.9


def standing_box():
    """Pose of a box of 120 x 90 x 60 mm that stands on the table, and the box."""
    y = -NORMAL
    x = np.cross(y, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, y, np.cross(x, y)])
    foot = np.array([0.02, 0.0, 0.6])
    foot -= NORMAL * (foot @ NORMAL + OFFSET_M)
    T[:3, 3] = foot + 0.045 * NORMAL
    return st.SDF.box([0.12, 0.09, 0.06], voxels=80), T


def with_box(shape, T):
    """Depth without noise, m, and where the box is."""
    body, ground = shape.render(CAMERA, T)[0].astype(np.float64), table(noise_m=0.0)
    seen = (body > 0) & ((body < ground) | (ground == 0))
    return np.where(seen, body, ground), seen


def test_the_lower_edge_of_an_object_stays_with_it():
    depth, seen = with_box(*standing_box())
    height = CAMERA.back_project(depth.astype(np.float32)) @ NORMAL + OFFSET_M
    foot = seen & (height > 0.004) & (height < 0.009)
    noisy = np.where(depth > 0, depth + np.random.default_rng(0).normal(0, 0.001, depth.shape), 0)
    with_feet, without = (st.remove_plane(frame_of(noisy), CAMERA, feet=f)[0] for f in (True, False))
    assert foot.sum() > 50
    assert without[foot].mean() < 0.1
    assert with_feet[foot].mean() > 0.9
    assert with_feet[~seen].mean() < 0.01


def test_the_tracker_can_leave_the_table_out():
    shape, T = standing_box()
    depth, _ = with_box(shape, T)
    depth = np.where(depth > 0, depth + np.random.default_rng(0).normal(0, 0.001, depth.shape), 0)
    pixels = {}
    for drop in (False, True):
        result = st.Tracker(shape, CAMERA, threads=1, drop_plane=drop).start(frame_of(depth), poses=[T])
        assert result.ok
        pixels[drop] = result.steps[0][-1].pixels
    assert pixels[True] < 0.95 * pixels[False]  # those of the table beside the box
    assert np.linalg.norm(result.pose[:3, 3] - T[:3, 3]) < 5e-4  # m; a strip along the foot is gone with it
