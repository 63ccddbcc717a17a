# SPDX-License-Identifier: MIT
"""The Cramer-Rao bound against cases with a known answer."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.common.bound import pose_bound, pose_information

SIGMA_M = 1e-3


def plane_image(normal, d_m, n=41):
    """Depth, normals and rays of the plane normal . X = d."""
    xy = np.linspace(-0.1, 0.1, n)
    rays = np.stack(np.meshgrid(xy, xy), axis=-1)
    slope = rays @ normal[:2] + normal[2]
    return d_m / slope, np.broadcast_to(normal, (n, n, 3)), rays


def test_a_plane_alone_does_not_fix_the_pose():
    depth, normals, rays = plane_image(np.array([0.0, 0.0, 1.0]), 1.0)
    with pytest.raises(ValueError, match="six observable directions"):
        pose_bound(depth, normals, rays, np.array([0.0, 0.0, 1.0]), SIGMA_M)


def test_grazing_pixels_do_not_count():
    depth, normals, rays = plane_image(np.array([np.cos(0.1), 0.0, np.sin(0.1)]), 1.0)
    near = np.abs(
        (np.dstack([rays, np.ones(rays.shape[:2])]) / np.sqrt(1 + (rays**2).sum(-1))[..., None])
        @ normals[0, 0]
    )
    _, pixels = pose_information(depth, normals, rays, np.zeros(3))
    assert pixels == np.count_nonzero(near >= np.cos(np.deg2rad(80.0))) < depth.size


def test_information_is_the_slope_of_rendered_depth():
    """Central differences of a corner of three planes, moved by each unknown in turn."""
    rng = np.random.default_rng(1)
    origin, step = np.array([0.02, -0.01, 0.9]), 1e-6
    rays = rng.uniform(-0.1, 0.1, (30, 2))
    r = np.column_stack([rays, np.ones(30)])
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    which = np.arange(30) % 3
    n = q[which] * np.sign(r @ q.T)[np.arange(30), which][:, None]
    through = origin + 0.05 * rng.normal(size=(3, 3))

    def depth(p):
        from experiments.common.truth import _exp

        R = _exp(np.array(p[3:]))
        moved_n = n @ R.T
        moved_x = (through[which] - origin) @ R.T + origin + np.array(p[:3])
        return np.einsum("ij,ij->i", moved_n, moved_x) / np.einsum("ij,ij->i", moved_n, r)

    eye = step * np.eye(6)
    J = np.column_stack([(depth(e) - depth(-e)) / (2 * step) for e in eye])
    keep = np.abs(np.einsum("ij,ij->i", n, r)) / np.linalg.norm(r, axis=1) >= np.cos(np.deg2rad(80.0))
    z = depth(np.zeros(6))
    usable = keep & (z > 0)
    information, _ = pose_information(z * usable, n, rays, origin)
    np.testing.assert_allclose(information, J[usable].T @ J[usable], rtol=1e-5, atol=1e-6)
