# SPDX-License-Identifier: MIT
import cv2
import numpy as np
import pytest

import sdftrack as st
from sdftrack.sdf import SDF

ROOT_ATOL = 1e-6  # m: the promise; float32 depth at 0.5 m adds 3e-8


def camera(width=64, height=48, distortion=()):
    return st.Camera(70.0, 72.0, 31.3, 23.6, width, height, distortion or None)


def pose(rotation_vector=(0.4, -0.7, 0.2), t=(0.01, -0.02, 0.4)):
    return st.geometry.pose(rotation_vector, t)


def rays(cam):
    xy = cam._core.rays()
    return np.dstack([xy, np.ones(xy.shape[:2])])


def test_a_ball_has_the_depth_and_normals_of_a_ball():
    sdf, cam, centre, radius = SDF.sphere(0.08, voxels=120), camera(), np.array([0.02, -0.01, 0.5]), 0.08
    depth, normals = sdf.render(cam, pose(t=centre))
    r = rays(cam)
    along, square = r @ centre, (r * r).sum(axis=-1)
    root = along**2 - square * (centre @ centre - radius**2)
    sure = root > 0.01 * radius**2  # not the rim, where a ray grazes
    truth = (along - np.sqrt(np.where(root > 0, root, 0))) / square
    assert sure.sum() > 200
    assert np.abs(depth - truth)[sure].max() < 0.15 * sdf.voxel_size  # a trilinear ball is a polyhedron
    assert not depth[root < -0.01 * radius**2].any()
    n = (r * depth[..., None] - centre) / radius
    assert (normals * n).sum(axis=-1)[sure].min() > np.cos(np.radians(2))
    assert np.allclose(np.linalg.norm(normals[depth > 0], axis=-1), 1, atol=1e-5)
    assert not normals[depth == 0].any()


def test_a_facing_box_is_flat():
    depth, normals = SDF.box((0.2, 0.2, 0.1), voxels=61).render(camera(), pose((0, 0, 0), (0, 0, 0.5)))
    inner = np.abs(rays(camera())[..., :2] * 0.45).max(axis=-1) < 0.09
    np.testing.assert_allclose(depth[inner], 0.45, atol=ROOT_ATOL)
    np.testing.assert_allclose(normals[inner], np.tile([0, 0, -1], (inner.sum(), 1)), atol=1e-4)


@pytest.mark.parametrize("distortion", [(), (0.1, -0.05, 0.002, -0.001, 0.01)])
def test_every_hit_is_a_zero_of_the_field_on_its_pixels_ray(distortion):
    sdf, cam, T = SDF.box((0.1, 0.06, 0.08), voxels=50), camera(distortion=distortion), pose()
    depth, _ = sdf.render(cam, T)
    hit = depth > 0
    assert hit.sum() > 100
    assert np.array_equal(sdf.silhouette(cam, T), hit)
    points = (rays(cam)[hit] * depth[hit][:, None] - T[:3, 3]) @ T[:3, :3]
    assert np.abs(sdf(points)).max() < ROOT_ATOL


def test_what_is_behind_or_beside_the_camera_is_not_seen():
    sdf = SDF.sphere(0.05, voxels=30)
    for t in ((0, 0, -0.5), (3, 0, 0.5), (0, 0, 0)):
        assert not sdf.render(camera(), pose(t=t))[0].any()


SHAPES = {
    "thin plate": lambda: st.SDF.box((0.2, 0.15, 0.012), voxels=90),
    "rod": lambda: st.SDF.cylinder(0.008, 0.25, voxels=120),
    "cone": lambda: st.SDF.cone(0.05, 0.15, voxels=60),
}


@pytest.mark.parametrize("lens", [(), (0.2, -0.5, 0.001, 0.002, 0.3)])
@pytest.mark.parametrize("name", SHAPES)
def test_no_tile_that_the_shape_touches_is_left_out(name, lens):
    """A camera of one pixel has tiles of one ray: what it sees is what the whole camera sees there."""
    shape, rng = SHAPES[name](), np.random.default_rng(7)
    whole = st.Camera(260.0, 265.0, 80.3, 59.8, 160, 120, lens)
    hits = 0
    for _ in range(4):
        T = st.geometry.pose(rng.uniform(-2, 2, 3), [*rng.uniform(-0.06, 0.06, 2), rng.uniform(0.4, 0.9)])
        depth = shape.render(whole, T)[0]
        seen = cv2.dilate((depth > 0).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        border = np.argwhere(seen & (cv2.erode((depth > 0).astype(np.uint8), np.ones((3, 3), np.uint8)) == 0))
        for v, u in rng.permutation(border)[:150]:
            one = st.Camera(260.0, 265.0, 80.3 - u, 59.8 - v, 1, 1, lens)
            assert shape.render(one, T)[0][0, 0] == depth[v, u]
            hits += depth[v, u] > 0
    assert hits > 50
