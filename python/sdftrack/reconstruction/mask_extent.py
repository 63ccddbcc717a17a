# SPDX-License-Identifier: MIT
"""How far the observed shape extends beyond the initial mask."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.reconstruction.quality import bodies

__all__ = ["MaskExtent"]

MAX_BEYOND = 0.15  # of the mask's width or height
FRAMES_BETWEEN = 10  # from one look at the surface to the next
NEAREST_M = 1e-3

Array = NDArray[np.float64]


class MaskExtent:
    """Compare the shape's extent in the first frame's image with that of its mask.

    If the mask covers the whole rigid object, the shape stays within it from that viewpoint, whatever other frames add.
    If it extends beyond, something else was fused into the shape, or the mask covers only a part of the object. Nothing
    is inferred where the mask ends at the image border.

    Parameters
    ----------
    camera : Camera
    outline : (H, W) bool
        The mask, or the box.
    T_cam_obj : (4, 4) float64
        Pose in the first frame.
    """

    def __init__(self, camera: Camera, outline: NDArray[np.bool_], T_cam_obj: Array) -> None:
        ys, xs = np.nonzero(outline)
        self._low = np.array([xs.min(), ys.min()], float)
        self._high = np.array([xs.max(), ys.max()], float)
        size = np.array([camera.width, camera.height])
        self._cut_low, self._cut_high = self._low <= 0, self._high >= size - 1
        self._camera, self._T = camera, T_cam_obj
        self._looked = -FRAMES_BETWEEN
        self._share = 0.0

    def beyond(self, core: Any, fused: int, least: int) -> float:
        """Relative excess of the observed surface over the mask's width or height, whichever is larger.

        Parameters
        ----------
        core : sdftrack._core.Reconstruction
        fused : int
            Number of frames so far; the surface is checked in every tenth frame.
        least : int
            Minimum observation weight of a voxel, in the core's unit.
        """
        boxes = core.surface_boxes
        if not len(boxes):
            return self._share
        corners = np.stack([boxes[:, (a, b, c)] for a in (0, 3) for b in (1, 4) for c in (2, 5)], axis=1)
        if self._share_of(core, corners.reshape(-1, 3)) <= MAX_BEYOND:
            self._share = 0.0  # blocks hold their surface: no need to look at it
        elif fused >= self._looked + FRAMES_BETWEEN:
            self._looked = fused
            self._share = self._share_of(core, _seen_surface(core, least))
        return self._share

    def forget(self) -> None:
        """Look at the surface anew with the next frame: the volume has been replaced."""
        self._looked, self._share = -FRAMES_BETWEEN, 0.0

    def reason(self, core: Any, fused: int, least: int) -> str:
        """Reason to doubt the shape by its size; empty if there is none."""
        share = self.beyond(core, fused, least)
        if share <= MAX_BEYOND:
            return ""
        return (
            f"the observed shape extends {100 * share:.0f} % beyond the first mask: something else was fused into "
            "it, or the mask shows only a part of the object; start with a complete mask, and keep_to_mask=True"
        )

    def _share_of(self, core: Any, voxels: NDArray[Any]) -> float:
        points = voxels * core.voxel_m + np.array(core.origin)
        in_camera = points @ self._T[:3, :3].T + self._T[:3, 3]
        in_camera = in_camera[in_camera[:, 2] > NEAREST_M]
        if not len(in_camera):
            return 0.0
        uv = self._camera.project(in_camera)
        low = np.where(self._cut_low, self._low, np.minimum(uv.min(0), self._low))
        high = np.where(self._cut_high, self._high, np.maximum(uv.max(0), self._high))
        return float(((high - low + 1) / (self._high - self._low + 1)).max()) - 1


def _seen_surface(core: Any, least: int) -> NDArray[np.intp]:
    """(N, 3) observed surface voxels (x, y, z) of the largest body."""
    phi = core.phi
    labels, largest = bodies(phi)
    on_surface = (labels == largest) & (phi > -core.voxel_m) & (core.seen >= least)
    return np.argwhere(on_surface)[:, ::-1]
