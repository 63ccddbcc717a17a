# SPDX-License-Identifier: MIT
"""Known objects swept before a depth camera: few paths, rendered once, and any number of draws of the noise on them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera
from sdftrack.synth.noise import Noise, noise_of

Array = NDArray[np.float64]
TRUTH = Camera(575.0, 575.0, 319.5, 239.5, 640, 480)
START = Camera(632.5, 632.5, 339.5, 259.5, 640, 480)  # 10 % and 20 px off
BOX_M = 0.2
NOISES: dict[str, Any] = {"1 mm": 0.001, "3.16 mm": np.sqrt(10.0) * 1e-3, "kinect": "kinect"}


def box_mesh(side_m: float = BOX_M) -> Any:
    """A cube, its twelve triangles exact; origin in the middle."""
    import trimesh

    import sdftrack as st

    body = trimesh.creation.box((side_m, side_m, side_m))
    return st.Mesh(np.asarray(body.vertices, np.float64), np.asarray(body.faces, np.int32))


def swept(
    mesh: Any,
    frames: int,
    noise: Any,
    path: int = 0,
    draw: int = 0,
    camera: Camera = TRUTH,
    cache: Path | None = None,
    threads: int = 0,
) -> Any:
    """A synthetic sequence of the object on sweep number `path` with draw number `draw` of the noise.

    The noise-free pictures depend on the path only, so that a `cache` serves all draws.
    """
    import sdftrack as st

    how = noise_of(noise)
    drawn = None if how is None else _Draw(how, draw)
    return st.synth.sequence(
        mesh, frames, "sweep", drawn, seed=path, camera=camera, color=False, threads=threads, cache=cache
    )


class _Draw:
    """A sensor's noise, another one for each number."""

    def __init__(self, noise: Noise, number: int) -> None:
        self._noise, self._number = noise, number

    def __call__(
        self, depth: NDArray[np.float32], cosine: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float32]:
        own = np.random.default_rng([self._number, int(rng.integers(2**32))])
        return self._noise(depth, cosine, own)


def values_of(camera: Camera) -> Array:
    """(4,) fx, fy, cx, cy, px."""
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy])
