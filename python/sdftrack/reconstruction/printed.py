# SPDX-License-Identifier: MIT
"""What ``evolution="printed"`` begins and tracks with: the first shape, the guess from it, the tracker's options.

docs/math/reconstruction.md, section 7, says what is the source's and what it leaves open.
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
    """Signed distance to the shape that the evolution begins with: `initial`, or a ball of the mask's size.

    The source does not say where its sphere lies. Ours is as wide as the mask in the mean and has its front at the
    object's: the first frame's steps move the surface by some ten voxels only.

    Parameters
    ----------
    ball : Ball
        As it was fitted to the mask; the object frame has its origin in the middle.
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
    """Log ratio of inside to outside that the first shape gives each voxel (thesis Eqs. 4.32 to 4.34), (nz, ny, nx)."""
    inside = INFLUENCE / (1 + np.exp(shape_m / (FADES_VOXELS * voxel_m))) + 0.5 * (1 - INFLUENCE)
    guess: Field = np.log(inside / (1 - inside)).astype(np.float32)
    return guess


def tracker_options() -> TrackerOptions:
    """Those of the source's tracker, which does not judge its poses."""
    return TrackerOptions.printed().replace(
        lost_inliers=0.0, weak_inliers=0.0, lost_evidence=0.0, weak_evidence=0.0
    )
