# SPDX-License-Identifier: MIT
"""The reconstruction volume: its grid, its prior, and the frames fused into it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.device import CPU
from sdftrack.reconstruction.initialization import (
    EXTENT_PER_BALL,
    Lattice,
    ball_prior,
    inside_points,
    printed_prior,
    printed_shape,
    shape_prior,
)
from sdftrack.reconstruction.keyframe import Keyframe
from sdftrack.reconstruction.options import ReconstructorOptions
from sdftrack.reconstruction.quality import bodies
from sdftrack.sdf import SDF

BLOCK = 8  # voxels; volumes grow by whole blocks
MAX_VOXELS = 512
BYTES_PER_VOXEL = 20
BLOCKS_GROWN = 4
FRAMES_BETWEEN = 5  # from one look whether the object has come near the border to the next


def lattice_for(
    beginning: _core.Beginning, initial: SDF | None, voxels: int, extent: float | None
) -> Lattice:
    """A cube around the detected object, or around the initial shape."""
    middle, widest = np.zeros(3), 2 * beginning.radius_m
    if initial is not None:
        points = inside_points(initial)
        middle = 0.5 * (points.min(0) + points.max(0))
        widest = max(widest, float(np.ptp(points, axis=0).max()))
    side = extent or EXTENT_PER_BALL * widest
    x, y, z = (middle - 0.5 * side).tolist()
    return Lattice((voxels, voxels, voxels), side / (voxels - 1), (x, y, z))


def _extent_of_largest(phi: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last voxels (x, y, z) of the largest body; smaller ones are not part of the object."""
    from scipy import ndimage

    labels, largest = bodies(phi)
    slices = ndimage.find_objects(labels)[largest - 1][::-1]
    return np.array([s.start for s in slices]), np.array([s.stop for s in slices])


class Volume:
    """Evidence, distances and colours, stored in the core; on a GPU where `device` is the number of one."""

    def __init__(
        self,
        camera: Camera,
        lattice: Lattice,
        beginning: _core.Beginning,
        initial: SDF | None,
        options: ReconstructorOptions,
        threads: int,
        device: int = CPU,
    ) -> None:
        self.camera = camera
        self._made_of = beginning, initial, options, threads, device
        weight = options.prior
        prior = shape = None
        if options.evolution == "printed":
            shape = printed_shape(beginning, initial, lattice)
            prior = printed_prior(shape, lattice.voxel_m)
        elif weight > 0 and initial is not None:
            prior = shape_prior(initial, weight, lattice)
        elif weight > 0:
            prior = ball_prior(beginning, weight, lattice, bounded=beginning.planes is not None)
        core_options = options.to_core(beginning.noise_m)
        view = self._bounds(beginning, beginning.T_cam_obj)
        self.core: Any = _core.Reconstruction(
            lattice.voxels, lattice.voxel_m, lattice.origin, prior, core_options, threads, view, shape, device
        )
        self.fused = self._look_again = 0

    @property
    def lattice(self) -> Lattice:
        return Lattice(tuple(self.core.voxels), self.core.voxel_m, tuple(self.core.origin))

    def emptied(self) -> Volume:
        """An empty volume on the same grid."""
        return Volume(self.camera, self.lattice, *self._made_of)

    def begin_recording(self, beginning: _core.Beginning, T_cam_obj: NDArray[np.float64]) -> None:
        """Bound the following frames by the first frame of their recording, which has this pose."""
        self.core = self.core.continued(self._bounds(beginning, T_cam_obj))

    def _bounds(self, beginning: _core.Beginning, T_cam_obj: NDArray[np.float64]) -> Any:
        return beginning.view(self.camera._core, T_cam_obj)

    def fuse(self, keyframe: Keyframe, depth: NDArray[np.float32]) -> None:
        """Fuse a frame; `depth` is its whole depth image."""
        mask = keyframe.whole(keyframe.mask, self.camera.shape)
        foreground = None if keyframe.mask is not None else keyframe.foreground
        self.core.fuse(
            depth, self.camera._core, keyframe.T_cam_obj, keyframe.region, mask, foreground, keyframe.rgb
        )
        self.fused += 1

    def grow_if_needed(self) -> bool:
        """Enlarge the volume if the surface is within a block of the border; the printed form keeps its volume."""
        if self._made_of[2].evolution == "printed":
            return False
        boxes = self.core.surface_boxes
        if not len(boxes):
            return False
        voxels = np.array(self.core.voxels)
        near = boxes.min() < BLOCK or (boxes[:, 3:].max(0) > voxels - BLOCK).any()
        if not near or self.fused < self._look_again:
            return False
        self._look_again = self.fused + FRAMES_BETWEEN
        first, last = _extent_of_largest(self.core.phi)
        before = (first < BLOCK).astype(int) * BLOCKS_GROWN
        after = (last > voxels - BLOCK).astype(int) * BLOCKS_GROWN
        too_large = voxels + BLOCK * (before + after) > MAX_VOXELS
        before[too_large] = after[too_large] = 0
        grows = bool(before.any() or after.any())
        if grows:
            self.core = self.core.grown(before.tolist(), after.tolist())
        return grows

    def shape(self, least: int) -> SDF:
        """A copy of the current distances and colours; colours observed less than `least` are omitted."""
        rgb_seen = self.core.rgb_seen.reshape(-1, 4)
        seen = np.flatnonzero(rgb_seen[:, 3] >= least)
        colors = None
        if rgb_seen[seen, :3].any():
            colors = np.zeros(rgb_seen.shape, np.uint8)
            colors[seen, :3] = (rgb_seen[seen, :3] + 128) >> 8
            colors[seen, 3] = 255
            colors = colors.reshape(self.core.rgb_seen.shape)
        return SDF(np.array(self.core.phi), self.core.voxel_m, self.core.origin, colors)
