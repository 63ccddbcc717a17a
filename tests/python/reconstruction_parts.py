# SPDX-License-Identifier: MIT
"""Parts of a reconstruction in the core, as tests call them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from sdftrack import _core

Array = NDArray[np.float64]


def planes_below(
    depth: NDArray[np.float32], on_object: NDArray[np.bool_], camera: st.Camera, size_m: float
) -> Array:
    """Planes that the object is above: (N, 5) normal, offset and half thickness (m)."""
    planes: Array = _core.planes_below(depth, on_object, camera._core, size_m)
    return planes


@dataclass(frozen=True)
class FirstView:
    """Bounds on the object in the first camera's frame: depth at each pixel (m), and planes."""

    from_m: NDArray[np.float32]
    planes: Array

    def to_core(self, camera: st.Camera, T_cam_obj: Array, middle: Array, radius_m: float) -> Any:
        return _core.FirstView(camera._core, T_cam_obj, self.from_m, self.planes, middle.tolist(), radius_m)


def printed_prior(shape_m: NDArray[np.float32], voxel_m: float) -> NDArray[np.float32]:
    """Log odds of inside to outside from the first shape of the printed evolution (m), of any shape."""
    flat = np.ascontiguousarray(shape_m, np.float32).ravel()
    guess: NDArray[np.float32] = _core.printed_prior(flat, voxel_m).reshape(np.shape(shape_m))
    return guess


def without_cavities(phi: NDArray[np.float32], weight: NDArray[np.float32]) -> NDArray[np.float32]:
    """A copy of the field in which unobserved voxels that the surface encloses are inside."""
    filled: NDArray[np.float32] = _core.fill_cavities(phi, weight)
    return filled


class MaskExtent:
    """Comparison of a shape with its first mask."""

    def __init__(self, camera: st.Camera, outline: NDArray[np.bool_], T_cam_obj: Array) -> None:
        self._core = _core.MaskExtent(camera._core, outline, T_cam_obj)
        self.forget = self._core.forget

    def beyond(self, volume: Any, fused: int, least: int) -> float:
        """`volume` has phi, voxel_m, origin, seen and surface_boxes."""
        share: float = self._core.beyond(
            volume.phi, volume.voxel_m, volume.origin, volume.seen, volume.surface_boxes, fused, least
        )
        return share
