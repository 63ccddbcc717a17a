# SPDX-License-Identifier: MIT
"""The Cramer-Rao bound against cases with a known answer."""

from __future__ import annotations

import numpy as np

from experiments.common.bound import pose_information


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
