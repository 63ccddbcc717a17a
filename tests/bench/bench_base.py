# SPDX-License-Identifier: MIT
"""The boundary and the camera. Changing these numbers breaks comparisons."""

from collections.abc import Callable

import numpy as np
from harness import benchmark

from sdftrack import _core

POINTS = 100_000


@benchmark("base/project_100k", items=POINTS, unit="point")
def project() -> Callable[[], object]:
    camera = _core.Camera(525.0, 525.0, 319.5, 239.5, 640, 480, [0.1, -0.2, 1e-3, -1e-3, 0.05])
    points = np.random.default_rng(0).uniform((-0.5, -0.5, 0.5), (0.5, 0.5, 2.0), (POINTS, 3))
    return lambda: camera.project(points)


@benchmark("base/ray_table_vga_distorted", items=640 * 480, unit="pixel")
def ray_table() -> Callable[[], object]:
    camera = _core.Camera(525.0, 525.0, 319.5, 239.5, 640, 480, [0.1, -0.2, 1e-3, -1e-3, 0.05])
    return camera.rays
