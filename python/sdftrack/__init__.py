# SPDX-License-Identifier: MIT
"""Track and reconstruct rigid objects with an RGB-D camera, by signed distance functions."""

from sdftrack import geometry, metrics, synth
from sdftrack._core import __version__
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.device import cuda_available
from sdftrack.frame import Frame
from sdftrack.io.datasets import Sequence, open_sequence
from sdftrack.io.save import save_sequence
from sdftrack.mesh import Mesh
from sdftrack.recorder import Recorder
from sdftrack.sdf import SDF, MeshReport, smooth_union, union
from sdftrack.viz import draw

__all__ = [
    "SDF",
    "Camera",
    "Frame",
    "Mesh",
    "MeshReport",
    "RGBDCamera",
    "Recorder",
    "Sequence",
    "__version__",
    "cuda_available",
    "draw",
    "geometry",
    "metrics",
    "open_sequence",
    "save_sequence",
    "smooth_union",
    "synth",
    "union",
]
