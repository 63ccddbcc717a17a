# SPDX-License-Identifier: MIT
"""Keyframes cropped to the object, as whole images, and the result of refining them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._core import Keyframe, Keyframes
from sdftrack.camera import Camera
from sdftrack.frame import Frame

__all__ = ["Keyframe", "Keyframes", "Refined", "frame_of", "whole"]


def whole(keyframe: Keyframe, part: NDArray[Any] | None, size: tuple[int, int]) -> Any:
    """A keyframe's `depth`, `rgb` or `mask` as an image (height, width) that is 0 elsewhere; None for None."""
    if part is None:
        return None
    image = np.zeros((*size, *part.shape[2:]), part.dtype)
    x0, y0, x1, y1 = keyframe.region
    image[y0:y1, x0:x1] = part
    return image


def frame_of(keyframe: Keyframe, camera: Camera) -> Frame:
    """Both images, colour aligned to depth; measurements without a colour (black) are removed."""
    depth, color = (whole(keyframe, part, camera.shape) for part in (keyframe.depth, keyframe.rgb))
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
