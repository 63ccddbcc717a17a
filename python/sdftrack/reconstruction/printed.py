# SPDX-License-Identifier: MIT
"""Initialisation and tracking with ``evolution="printed"``: first shape, prior, tracker options.

docs/math/reconstruction.md, section 7, states what the thesis specifies and what it leaves open.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.options import TrackerOptions
from sdftrack.reconstruction.initialization import Ball
from sdftrack.sdf import SDF

__all__ = ["SCALE_VOXELS", "first_guess", "first_shape", "tracker_options"]

INFLUENCE = 0.5  # a of thesis Eq. 4.34
FADES_VOXELS = 4.0  # sigma_G
SCALE_VOXELS = 2.0  # s of the tracker's likelihood (below Eq. 4.13)
Field = NDArray[np.float32]


def first_shape(
    ball: Ball,
    initial: SDF | None,
    voxels: tuple[int, int, int],
    voxel_m: float,
    origin: tuple[float, float, float],
) -> Field:
    """Signed distance to the initial shape of the evolution: `initial`, or a ball of the mask's size.

    The thesis does not specify the location of its sphere. Ours has the mean width of the mask, and its front touches
    the object's, because the steps of the first frame move the surface by only about ten voxels.

    Parameters
    ----------
    ball : Ball
        The ball fitted to the mask; the origin of the object frame is its centre.
    voxels, voxel_m, origin
        The lattice: voxel centres are ``origin + voxel_m * (x, y, z)``, m, object frame.

    Returns
    -------
    (nz, ny, nx) float32
        m, negative inside.
    """
    x, y, z = (np.arange(n, dtype=np.float64) * voxel_m + o for n, o in zip(voxels, origin, strict=True))
    if initial is None:
        radius_m = float(np.sqrt(0.5 * ball.shorter_m * ball.radius_m))
        back = (radius_m - ball.behind_m) * ball.centre_cam / ball.centre_cam[2]
        x, y, z = x - back[0], y - back[1], z - back[2]
        away = np.sqrt(z[:, None, None] ** 2 + y[None, :, None] ** 2 + x[None, None, :] ** 2)
        return (away - radius_m).astype(np.float32)
    points = np.stack([a.ravel() for a in np.meshgrid(z, y, x, indexing="ij")[::-1]], axis=1)
    return np.asarray(initial(points), np.float32).reshape(len(z), len(y), len(x))


def first_guess(shape_m: Field, voxel_m: float) -> Field:
    """Prior log ratio of inside to outside from the first shape (thesis Eqs. 4.32 to 4.34), (nz, ny, nx)."""
    inside = INFLUENCE / (1 + np.exp(shape_m / (FADES_VOXELS * voxel_m))) + 0.5 * (1 - INFLUENCE)
    guess: Field = np.log(inside / (1 - inside)).astype(np.float32)
    return guess


def tracker_options() -> TrackerOptions:
    """Options of the thesis' tracker, which does not assess its poses."""
    return TrackerOptions.printed().replace(
        lost_inliers=0.0, weak_inliers=0.0, lost_evidence=0.0, weak_evidence=0.0
    )
