# SPDX-License-Identifier: MIT
"""Keyframes cropped to the object, and the result of refining them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.imaging.appearance import color_map

__all__ = ["Keyframe", "Refined", "cut", "masked_keyframe", "region_of"]

MARGIN_PX = 25  # of what is kept around the object
Region = tuple[int, int, int, int]


@dataclass
class Keyframe:
    """A fused frame: its images cropped to the object, and the pose used for fusion."""

    index: int
    region: Region  # x0, y0, x1, y1 of the depth image
    depth: NDArray[np.float32]
    rgb: NDArray[np.uint8] | None
    foreground: NDArray[np.float32]
    T_cam_obj: NDArray[np.float64]
    mask: NDArray[np.uint8] | None = None  # of the region; the first frame has one
    recording: int = 0  # 0: the one that `start` began

    def full_depth(self, height: int, width: int) -> NDArray[np.float32]:
        """The depth image, 0 outside the region."""
        depth = np.zeros((height, width), np.float32)
        x0, y0, x1, y1 = self.region
        depth[y0:y1, x0:x1] = self.depth
        return depth

    def full_color(self, height: int, width: int) -> NDArray[np.uint8] | None:
        """The colours aligned to the depth image, black outside the region."""
        if self.rgb is None:
            return None
        color = np.zeros((height, width, 3), np.uint8)
        x0, y0, x1, y1 = self.region
        color[y0:y1, x0:x1] = self.rgb
        return color

    def full_mask(self, height: int, width: int) -> NDArray[np.uint8] | None:
        if self.mask is None:
            return None
        mask = np.zeros((height, width), np.uint8)
        x0, y0, x1, y1 = self.region
        mask[y0:y1, x0:x1] = self.mask
        return mask

    def frame(self, camera: Camera) -> Frame:
        """Both images, colour aligned to depth; measurements without a colour (black) are removed."""
        depth = self.full_depth(camera.height, camera.width)
        color = self.full_color(camera.height, camera.width)
        if color is None:
            return Frame(depth, camera=camera, check_units=False)
        return Frame(np.where(color.any(axis=2), depth, 0), color, camera=camera, check_units=False)


@dataclass(frozen=True)
class Refined:
    """Result of :meth:`Reconstructor.refine`.

    Attributes
    ----------
    poses : dict of int to (4, 4) float64
        Refined ``T_cam_obj`` of each kept frame, by its index.
    rounds : int
        Number of rounds in which all poses and the shape were re-estimated.
    moved_m, turned_rad : list of float
        RMS change of the object's centre and orientation in each round.
    misfit_m : (float, float)
        Mean distance of the frames' measurements from the shape before and after, m.
    taken : bool
        Whether the refined poses and shape were accepted; otherwise they are unchanged.
    """

    poses: dict[int, NDArray[np.float64]]
    rounds: int
    moved_m: list[float]
    turned_rad: list[float]
    misfit_m: tuple[float, float] = (float("nan"), float("nan"))
    taken: bool = True


def cut(image: NDArray[Any], region: Region) -> NDArray[Any]:
    """Crop a region of an image, contiguous."""
    x0, y0, x1, y1 = region
    return np.ascontiguousarray(image[y0:y1, x0:x1])


def region_of(mask: NDArray[np.bool_], camera: Camera) -> Region:
    """Bounding box of a mask (H, W), with a margin."""
    ys, xs = np.nonzero(mask)
    x0, y0 = max(0, int(xs.min()) - MARGIN_PX), max(0, int(ys.min()) - MARGIN_PX)
    return (
        x0,
        y0,
        min(camera.width, int(xs.max()) + MARGIN_PX + 1),
        min(camera.height, int(ys.max()) + MARGIN_PX + 1),
    )


def masked_keyframe(
    frame: Frame,
    on_object: NDArray[np.bool_],
    T_cam_obj: NDArray[np.float64],
    depth_camera: Camera,
    camera: Any,
) -> Keyframe:
    """A keyframe (index 0) with the object given by a mask; `camera`: that of the colours, None: no colour."""
    assert frame.depth is not None
    region = region_of(on_object, depth_camera)
    rgb = None
    if camera is not None and frame.color is not None:
        rgb = _core.colors_at(frame.depth, frame.color, color_map(camera, frame.color), region)
    nothing = np.empty(0, np.float32)
    mask = cut(on_object.astype(np.uint8), region)
    return Keyframe(0, region, cut(frame.depth, region), rgb, nothing, T_cam_obj, mask)
