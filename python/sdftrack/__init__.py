# SPDX-License-Identifier: MIT
"""Track and reconstruct rigid objects with an RGB-D camera, by signed distance functions."""

from sdftrack._core import __version__
from sdftrack.device import cuda_available

__all__ = ["__version__", "cuda_available"]
