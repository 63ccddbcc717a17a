# SPDX-License-Identifier: MIT
"""Track and reconstruct rigid objects with an RGB-D camera, by signed distance functions."""

from sdftrack import geometry, metrics
from sdftrack._core import __version__
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.device import cuda_available
from sdftrack.frame import Frame
from sdftrack.mesh import Mesh

__all__ = [
    "Camera",
    "Frame",
    "Mesh",
    "RGBDCamera",
    "__version__",
    "cuda_available",
    "geometry",
    "metrics",
]
