# SPDX-License-Identifier: MIT
"""Initialisation of a reconstruction: the object's pixels, a ball fitted to them, the extent of the volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.imaging.pose_hint import Place
from sdftrack.options import TrackerOptions
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.sdf import SDF

EXTENT_PER_BALL = 1.8  # of its diameter: as in the thesis' section 4.6, with room for what is not seen yet
WIDER = 1.1  # than the ball is what may be guessed, where the mask and planes bound it
GUESS_FADES_VOXELS = 4.0  # sigma_G of thesis Eq. 4.34

Array = NDArray[np.float64]


def find_object(
    depth: NDArray[np.float32],
    place: Place,
    camera: Camera,
    initial: SDF | None,
    options: ReconstructorOptions,
) -> _core.Beginning:
    """The object at a mask, a box, or the pose of the initial shape (see `sdftrack.imaging.pose_hint`)."""
    shape = None if initial is None else initial._core_args
    return _core.find_object(depth, place, camera._core, shape, *_limits(options))


def find_standing(
    depth: NDArray[np.float32], pose: Array, camera: Camera, shape: SDF, options: ReconstructorOptions
) -> _core.Beginning:
    """The object's pixels at the pose of a shape, whose outline is unknown, with the planes that it stands on."""
    return _core.find_standing(depth, pose, camera._core, shape._core_args, *_limits(options))


def _limits(options: ReconstructorOptions) -> tuple[bool, bool, int, float | None]:
    return options.planes, options.keep_to_mask, options.mask_margin_px, options.noise_m


def inside_points(shape: SDF) -> Array:
    """Voxel centres inside a shape, (N, 3), object frame."""
    zyx = np.argwhere(shape.values <= 0)
    points: Array = zyx[:, ::-1] * shape.voxel_size + shape.origin
    return points


@dataclass(frozen=True)
class Lattice:
    """Voxel centres: ``origin + voxel_m * (x, y, z)``, object frame."""

    voxels: tuple[int, int, int]
    voxel_m: float
    origin: tuple[float, float, float]

    def distances(self, shape: SDF) -> NDArray[np.float32]:
        """Signed distances of a shape, in its own object frame, (nz, ny, nx)."""
        zyx = np.indices(self.voxels[::-1], dtype=np.float64)
        points = np.moveaxis(zyx[::-1], 0, -1).reshape(-1, 3) * self.voxel_m + self.origin
        return shape(points).reshape(self.voxels[::-1]).astype(np.float32)


def ball_prior(
    ball: _core.Beginning, weight: float, lattice: Lattice, *, bounded: bool
) -> NDArray[np.float32]:
    """Prior log ratio (z, y, x) of a ball around the object frame's origin.

    If the first view bounds the guess laterally, its depth is the mask's shorter side, and the ball is wider.
    """
    x, y, z = (
        np.arange(n, dtype=np.float32) * np.float32(lattice.voxel_m) + np.float32(o)
        for n, o in zip(lattice.voxels, lattice.origin, strict=True)
    )
    guess: NDArray[np.float32] = z[:, None, None] ** 2 + y[None, :, None] ** 2 + x[None, None, :] ** 2
    np.sqrt(guess, out=guess)
    np.subtract(np.float32(ball.radius_m * (WIDER if bounded else 1)), guess, out=guess)
    if bounded:
        back = np.float32(ball.shorter_m - ball.behind_m) - z
        np.minimum(guess, back[:, None, None], out=guess)
    return _faded(guess, weight, lattice.voxel_m)


def _faded(inside_m: NDArray[np.float32], weight: float, voxel_m: float) -> NDArray[np.float32]:
    """Scale to full weight a few voxels from the surface; in place."""
    inside_m *= np.float32(weight / (GUESS_FADES_VOXELS * voxel_m))
    return np.clip(inside_m, -weight, weight, out=inside_m)


def shape_prior(shape: SDF, weight: float, lattice: Lattice) -> NDArray[np.float32]:
    """Prior log ratio of a given shape."""
    return _faded(-lattice.distances(shape), weight, lattice.voxel_m)


# -- Initialisation and tracking with ``evolution="printed"``: first shape, prior, tracker options


INFLUENCE = 0.5  # a of thesis Eq. 4.34
PRINTED_SCALE_VOXELS = 2.0  # s of the tracker's likelihood (below Eq. 4.13)
Field = NDArray[np.float32]


def printed_shape(ball: _core.Beginning, initial: SDF | None, lattice: Lattice) -> Field:
    """Signed distance to the initial shape of the evolution: `initial`, or a ball of the mask's size.

    The thesis does not specify the location of its sphere. Ours has the mean width of the mask, and its front touches
    the object's, because the steps of the first frame move the surface by only about ten voxels. The origin of the
    object frame is the centre of `ball`.
    """
    if initial is not None:
        return lattice.distances(initial)
    radius_m = float(np.sqrt(0.5 * ball.shorter_m * ball.radius_m))
    back = (radius_m - ball.behind_m) * np.array(ball.centre_cam) / ball.centre_cam[2]
    x, y, z = (
        np.arange(n, dtype=np.float64) * lattice.voxel_m + o - b
        for n, o, b in zip(lattice.voxels, lattice.origin, back, strict=True)
    )
    away = np.sqrt(z[:, None, None] ** 2 + y[None, :, None] ** 2 + x[None, None, :] ** 2)
    return (away - radius_m).astype(np.float32)


def printed_prior(shape_m: Field, voxel_m: float) -> Field:
    """Prior log ratio of inside to outside from the first shape (thesis Eqs. 4.32 to 4.34), (nz, ny, nx)."""
    inside = INFLUENCE / (1 + np.exp(shape_m / (GUESS_FADES_VOXELS * voxel_m))) + 0.5 * (1 - INFLUENCE)
    guess: Field = np.log(inside / (1 - inside)).astype(np.float32)
    return guess


def printed_tracker_options() -> TrackerOptions:
    """Options of the thesis' tracker, which does not assess its poses."""
    return TrackerOptions.printed().replace(
        lost_inliers=0.0, weak_inliers=0.0, lost_evidence=0.0, weak_evidence=0.0
    )
