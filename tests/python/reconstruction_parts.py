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
