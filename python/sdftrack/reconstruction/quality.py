# SPDX-License-Identifier: MIT
"""The surface of a reconstruction as a mesh, its expected accuracy, and its reach beyond the initial mask."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack._internal.array_equality import Compared
from sdftrack.camera import Camera
from sdftrack.device import CPU
from sdftrack.mesh import Mesh

SEEN_SCALE = 256.0
BAND_VOXELS = 8.0
GUESS_BLUR_VOXELS = 2.5
ENCLOSED = 5  # of six directions
MIN_WEIGHT = 0.1  # frames; of less nothing is known
MARGIN_VOXELS = 8


@dataclass(frozen=True, eq=False)
class Quality(Compared):
    """Quality of a reconstruction.

    Attributes
    ----------
    seen_share : float
        Fraction of the surface vertices that were observed (0..1); the rest is guessed.
    expected_error_m : (V,) float32
        Sd of the surface position at each vertex of ``mesh()``: sensor noise divided by the square root of the number
        of observations, at least a fifth of a voxel; infinite where unobserved.
    frames : int
        Number of fused frames.
    summary : str
        One human-readable sentence.
    """

    seen_share: float
    expected_error_m: NDArray[np.float32]
    frames: int
    summary: str


def bodies(phi: NDArray[np.float32]) -> tuple[NDArray[np.int32], int]:
    """Body label of each voxel, 0 outside, and the label of the largest body."""
    from scipy import ndimage

    labels, _ = ndimage.label(phi < 0)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return labels, int(np.argmax(sizes))


def without_cavities(phi: NDArray[np.float32], weight: NDArray[np.float32]) -> NDArray[np.float32]:
    """A copy of the field in which unobserved voxels enclosed by the surface are inside.

    A frame provides evidence only up to a few millimetres behind a surface. Deeper voxels are inside if grid lines in
    at least five of the six directions lead to inside, and not to observed free space.
    """
    inside, unseen = phi <= 0, weight <= MIN_WEIGHT
    open_ = ~inside & unseen
    enclosed = np.zeros(phi.shape, np.uint8)
    for axis in range(3):
        for order in (slice(None), slice(None, None, -1)):
            _count_enclosed(
                np.moveaxis(inside, axis, 0)[order],
                np.moveaxis(open_, axis, 0)[order],
                np.moveaxis(enclosed, axis, 0)[order],
            )
    out = np.array(phi)
    cavity = open_ & (enclosed >= ENCLOSED)
    out[cavity] = -out[cavity]
    return out


def _count_enclosed(inside: NDArray[np.bool_], open_: NDArray[np.bool_], enclosed: NDArray[np.uint8]) -> None:
    """Add 1 where the first known voxel backwards along the first axis is inside."""
    behind = np.zeros(inside.shape[1:], bool)
    for k in range(len(inside)):
        behind = np.where(open_[k], behind, inside[k])
        enclosed[k] += behind


def _smoothed_where_unseen(
    phi: NDArray[np.float32], seen: NDArray[np.uint16], voxel_m: float
) -> NDArray[np.float32]:
    """Smooth the unobserved part of the field, which has no detail; the observed part is unchanged."""
    from scipy import ndimage

    near = np.clip(phi, -BAND_VOXELS * voxel_m, BAND_VOXELS * voxel_m)
    smooth = ndimage.gaussian_filter(near, GUESS_BLUR_VOXELS, truncate=2.0)
    share = np.clip(2 * ndimage.gaussian_filter((seen > 0).astype(np.float32), 1.0, truncate=2.0), 0, 1)
    out: NDArray[np.float32] = share * near + (1 - share) * smooth
    return out


def surface_mesh(core: Any, number: int = CPU) -> Mesh:
    """Watertight mesh of the zero set with mean observed colours; `seen` in equivalent frontal views.

    Marching cubes on GPU `number`.
    """
    boxes = core.surface_boxes
    if not len(boxes):
        raise RuntimeError("mesh: no surface is left, the frames contradict the whole shape; start again")
    low = np.maximum(boxes[:, :3].min(0) - MARGIN_VOXELS, 0)
    high = np.minimum(boxes[:, 3:].max(0) + MARGIN_VOXELS, core.voxels)
    part = tuple(slice(a, b) for a, b in zip(low[::-1], high[::-1], strict=True))
    amount = core.seen[part]
    whole = without_cavities(core.phi[part], core.weight[part])
    phi = _smoothed_where_unseen(whole, amount, core.voxel_m)
    labels, largest = bodies(phi)
    phi[(labels > 0) & (labels != largest)] = np.float32(1e-6)
    for side in (phi[0], phi[-1], phi[:, 0], phi[:, -1], phi[:, :, 0], phi[:, :, -1]):
        np.maximum(side, np.float32(core.voxel_m), out=side)  # closed even where the volume ends
    voxels, faces = _core.zero_mesh(phi, 0, number)
    at = tuple(np.round(voxels[:, ::-1]).astype(np.intp).T)
    seen = (amount[at] / SEEN_SCALE).astype(np.float32)
    colors = (core.rgb_seen[part][at][..., :3] / 256.0 + 0.5).astype(np.uint8)
    known = colors[seen > 0]
    colored = known.any()  # else no frame had any
    if colored:
        colors[seen == 0] = np.median(known, axis=0).astype(np.uint8)
    vertices = (voxels + low) * core.voxel_m + np.array(core.origin)
    return Mesh(vertices, faces, colors if colored else None, seen=seen)


def seen_part(mesh: Mesh, min_seen: float) -> Mesh:
    """The faces whose vertices were all observed at least this often: open where the rest is guessed."""
    assert mesh.seen is not None
    kept = mesh.faces[(mesh.seen >= min_seen)[mesh.faces].all(axis=1)]
    used, faces = np.unique(kept, return_inverse=True)
    return Mesh(
        mesh.vertices[used],
        faces.reshape(-1, 3).astype(np.int32),
        None if mesh.colors is None else mesh.colors[used],
        seen=mesh.seen[used],
    )


def expected_error(seen: NDArray[np.float32], noise_m: float, voxel_m: float) -> NDArray[np.float32]:
    with np.errstate(divide="ignore"):
        error = noise_m / np.sqrt(seen)
    out: NDArray[np.float32] = np.where(seen > 0, np.maximum(error, 0.2 * voxel_m), np.inf).astype(np.float32)
    return out


def quality_of(mesh: Mesh, fused: int, voxel_m: float, noise_m: float, min_seen: float) -> Quality:
    """Quality of the result of `surface_mesh`, from `fused` frames with the sensor's noise (m)."""
    assert mesh.seen is not None
    errors = expected_error(mesh.seen, noise_m, voxel_m)
    share = float((mesh.seen >= min_seen).mean())
    rest = "" if share > 0.9 else "; turn the object further to see the rest"
    frames = f"{fused} frame{'s' * (fused != 1)}"
    text = f"{100 * share:.0f} % of the surface was observed in {frames}{rest}"
    return Quality(share, errors, fused, text)


# -- How far the observed shape extends beyond the initial mask


MAX_BEYOND = 0.15  # of the mask's width or height
FRAMES_BETWEEN = 10  # from one look at the surface to the next
NEAREST_M = 1e-3

Array = NDArray[np.float64]


class MaskExtent:
    """Compare the shape's extent in the first frame's image with that of its mask.

    If the mask covers the whole rigid object, the shape stays within it from that viewpoint, whatever other frames add.
    If it extends beyond, something else was fused into the shape, or the mask covers only a part of the object. Nothing
    is inferred where the mask ends at the image border. `outline` (H, W) is the mask, or the box.
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

        The surface, of voxels observed `least` (in the core's unit) or more, is checked in every tenth of the `fused`
        frames.
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
