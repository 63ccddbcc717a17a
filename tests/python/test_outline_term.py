# SPDX-License-Identifier: MIT
"""The outline in the colour image as an energy: its twin, its derivative, clean images."""

import numpy as np
import pytest
from test_outline_tracking import AROUND, BOX, OBJECT, VOLUME
from tracking_scene import CAMERA, POSE, increment

import sdftrack as st
from reference.appearance import smoothed
from reference.outline import outline_cost, outline_residuals
from sdftrack import _core, geometry

ALIGNED = _core.ColorMap.aligned(CAMERA.width, CAMERA.height)


def bin_of(rgb):
    return (int(rgb[0]) >> 4) << 8 | (int(rgb[1]) >> 4) << 4 | int(rgb[2]) >> 4


def two_colors():
    counts = np.zeros((2, 4096), np.float32)
    counts[0, bin_of(OBJECT)] = counts[1, bin_of(AROUND)] = 1000
    return counts[0], counts[1]


def picture(T, mesh=BOX, camera=CAMERA):
    return np.where((mesh.raycast(camera, T)[0] > 0)[..., None], OBJECT, AROUND)


def lines_of(T, color, depth=None, sdf=VOLUME, points=200, reach_px=8):
    shape = (sdf.values, sdf.voxel_size, sdf.origin.tolist())
    return _core.outline_lines(
        shape, CAMERA._core, depth, color, ALIGNED, two_colors(), T, points=points, reach_px=reach_px
    )


def linearized(lines, T_cam_obj, noise=1.0, common_sd=0.0, shared=1.0):
    T = np.ascontiguousarray(np.linalg.inv(T_cam_obj))
    return _core.outline_energy(lines, CAMERA._core, ALIGNED, T, noise, common_sd, shared)


def moved(T_cam_obj, delta):
    """T_obj_cam <- increment(v, w) T_obj_cam, as the optimiser moves it."""
    return np.linalg.inv(increment(delta) @ np.linalg.inv(T_cam_obj))


def fitted(T, color, sdf, rounds=5):
    """Gauss-Newton on lines that are made anew; turns that nothing shows stay."""
    for k in range(rounds):
        lines = lines_of(T, color, sdf=sdf, reach_px=16 if k == 0 else 8)
        for _ in range(4):
            _, g, H, _ = linearized(lines, T)
            weak = np.diag([1, 1, 1, 1e4, 1e4, 1e4])
            T = moved(T, -np.linalg.solve(H + weak, g))
    return T, lines


# -- one line
def test_an_edge_between_two_pixels_is_found_there():
    r = np.arange(-12, 13)
    for edge in (-3.5, -0.5, 0.5, 4.5):
        mean, sd, contrast = _core.outline_offset(np.where(r < edge, 0.95, 0.05).astype(np.float32), 8)
        assert abs(mean - edge) < 0.02
        assert sd < 1.5
        assert contrast > 0.85
    mean, sd, contrast = _core.outline_offset(np.full(25, 0.5, np.float32), 8)
    assert abs(mean) < 1e-5
    assert sd == pytest.approx(np.sqrt(24))  # uniform: nothing is known
    assert contrast == 0


# -- the energy
@pytest.mark.parametrize(("common_sd", "shared"), [(0.0, 1.0), (1.0, 6.0), (0.3, 16.0)])
def test_cost_and_gradient_are_the_twins(common_sd, shared):
    common = (1.3, common_sd, shared)
    lines = lines_of(POSE, picture(POSE))
    T = geometry.pose([0.02, -0.01, 0.015], [0.001, -0.002, 0.003]) @ POSE
    cost, gradient, hessian, off = linearized(lines, T, *common)
    assert cost == pytest.approx(outline_cost(lines, CAMERA.K, T, *common), rel=1e-9)
    assert np.allclose(off, outline_residuals(lines, CAMERA.K, T) / lines[:, 8] / 1.3)
    at = lambda d: outline_cost(lines, CAMERA.K, moved(T, d), *common)  # noqa: E731
    h = 1e-6
    slope = np.array([(at(d) - at(-d)) / (2 * h) for d in h * np.eye(6)])
    assert np.allclose(gradient, slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max())
    assert np.linalg.eigvalsh(hessian).min() > 0


def test_an_outline_that_is_too_wide_says_little_of_the_distance():
    lines = lines_of(POSE, picture(POSE))
    near = linearized(lines, POSE)[2]
    wide = linearized(lines, POSE, common_sd=1.0, shared=6.0)[2]
    sd = lambda H: np.sqrt(np.linalg.inv(POSE[:3, :3] @ H[:3, :3] @ POSE[:3, :3].T).diagonal())  # noqa: E731
    wider = sd(wide) / sd(near)
    assert wider[2] > 2.5  # along the ray
    assert (wider[:2] < 0.7 * wider[2]).all()
    lines[:, 7] += 1  # all outwards: the offset takes nearly all of it
    moved_by = lambda out: np.linalg.norm(np.linalg.solve(out[2] + np.eye(6), out[1])[:3])  # noqa: E731
    assert moved_by(linearized(lines, POSE, common_sd=1.0)) < 0.5 * moved_by(linearized(lines, POSE))


@pytest.mark.parametrize("lens", [(), (0.12, -0.2, 0.001, -0.002, 0.05)])
def test_the_gradient_holds_with_a_lens_and_a_second_camera(lens):
    color = st.Camera(fx=300, fy=310, cx=170, cy=118, width=340, height=240, distortion=lens)
    T_color_depth = geometry.pose([0.01, -0.02, 0.005], [0.025, 0.001, 0.002])
    rig = _core.ColorMap.rigid(CAMERA._core, color._core, T_color_depth)
    random = np.random.default_rng(0)
    p = random.uniform(-0.04, 0.04, (40, 3))
    seen = p @ POSE[:3, :3].T + POSE[:3, 3]
    seen = seen @ T_color_depth[:3, :3].T + T_color_depth[:3, 3]
    u = color.project(seen)
    angle = random.uniform(0, 2 * np.pi, 40)
    lines = np.column_stack([p, u, np.cos(angle), np.sin(angle), random.normal(0, 1, 40), np.full(40, 0.8)])
    T = np.ascontiguousarray(np.linalg.inv(POSE))
    cost = lambda T_cam_obj: _core.outline_energy(  # noqa: E731
        lines, CAMERA._core, rig, np.ascontiguousarray(np.linalg.inv(T_cam_obj)), 1.0
    )[0]
    _, gradient, _, off = _core.outline_energy(lines, CAMERA._core, rig, T, 1.0)
    assert np.allclose(off, -lines[:, 7] / 0.8, atol=1e-3)  # the map is in single precision
    for j in range(6):
        d = np.zeros(6)
        d[j] = 1e-6
        slope = (cost(moved(POSE, d)) - cost(moved(POSE, -d))) / 2e-6
        assert gradient[j] == pytest.approx(slope, rel=1e-4, abs=1e-4 * np.abs(gradient).max())


# -- clean images
def test_a_ball_in_two_colours_is_found_to_a_tenth_of_a_pixel():
    sdf = st.SDF.sphere(0.05, voxels=80)
    centre = np.array([0.012, -0.02, 0.5])
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)], -1)
    b = rays @ centre
    seen = b**2 > np.einsum("...i,...i", rays, rays) * (centre @ centre - 0.05**2)
    color = np.where(seen[..., None], OBJECT, AROUND)
    T, _ = fitted(geometry.pose([0, 0, 0], centre + np.array([0.004, -0.003, 0.01])), color, sdf)
    off = (T[:3, 3] - centre) * CAMERA.fx / 0.5
    assert np.abs(off[:2]).max() < 0.1
    assert abs(off[2]) * 0.05 / 0.5 < 0.1  # the radius in the image


def test_what_is_hidden_or_without_contrast_says_nothing():
    color = picture(POSE)
    all_lines = lines_of(POSE, color)
    depth = np.full(CAMERA.shape, 1.2, np.float32)
    depth[:, :160] = 0.3  # something in front of the left part
    seen = lines_of(POSE, color, depth)
    assert 0.2 < len(seen) / len(all_lines) < 0.8
    assert seen[:, 3].min() > 155
    color[:, :160] = OBJECT  # the same colour on both sides there
    seen = lines_of(POSE, color)
    assert 0.2 < len(seen) / len(all_lines) < 0.8
    assert seen[:, 3].min() > 150


def test_local_colours_are_counted_place_by_place_and_older_frames_less():
    """Of 512 coarse colours by the pixels of a place, and of the whole object as if 15 pixels had shown it."""
    rng = np.random.default_rng(3)
    counts = rng.integers(1, 50, (2, 4096)).astype(np.float32)
    whole = [4096 * smoothed(c / c.sum()) for c in counts.astype(float)]
    here, beside = [1.0, 0.1, -0.2], [-1.0, 0.1, -0.2]
    own, other = 0x8A3, 0x35C  # of different coarse bins
    seen = [(True, own, 0)] * 10 + [(False, other, 0)] * 20 + [(True, own, 1)] * 6 + [(True, other, 1)] * 2
    is_object, bins, frames = (list(column) for column in zip(*seen, strict=True))
    points = np.array([here] * len(seen)) + rng.uniform(-0.05, 0.05, (len(seen), 3))
    got = _core.local_color_chances(
        (counts[0], counts[1]), points, is_object, bins, frames, 0.2, np.array([here, here, beside, beside]),
        [own, other, own, other],
    )  # fmt: skip
    # Of the first frame 0.8 counts, for a second one has seen the place.
    of_object = {own: 0.8 * 10 + 6, other: 2.0}
    of_rest = {own: 0.0, other: 0.8 * 20}
    want = []
    for place, color in ((1, own), (1, other), (0, own), (0, other)):
        f, b = (
            (512 * place * found[color] + 15 * whole[side][color]) / (place * sum(found.values()) + 15)
            for side, found in enumerate((of_object, of_rest))
        )
        want.append(f / (f + b))
    assert got == pytest.approx(want, rel=1e-4)
    assert want[0] > 0.9 > 0.2 > want[1]
