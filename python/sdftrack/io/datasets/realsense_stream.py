# SPDX-License-Identifier: MIT
"""A stream of a RealSense recording, whichever format it has."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.io.datasets.streams import Stream

__all__ = ["RealSenseStream"]


@dataclass
class RealSenseStream:
    """A stream as a RealSense recording describes it.

    Attributes
    ----------
    stream : Stream
    lens : dict
        width, height, fx, fy, ppx, ppy, model and coeffs, as in the SDK's intrinsics.
    T_stream_ref : (4, 4) float64
        Maps points of the recording's reference stream to this one, m.
    """

    stream: Stream
    lens: dict[str, Any]
    T_stream_ref: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))

    def camera(self) -> Camera:
        return Camera.from_realsense(SimpleNamespace(**self.lens))
