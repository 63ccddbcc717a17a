# SPDX-License-Identifier: MIT
"""The scene of Figure 4.13, in which an object is turned until its whole surface was seen; a reconstructor for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.bodies import VOXELS, Body, body
from experiments.common.truth import motion

Array = NDArray[np.float64]
SEED, EXTENT_PER_SIDE = 0, 1.8
STEP_M, STEP_RAD = 0.005, np.deg2rad(1.5)


@dataclass(frozen=True)
class Scene:
    """A body on its path. `extent` m: side of the volume that is given to every reconstructor."""

    body: Body
    poses: Array
    extent: float
    threads: int
    voxels: int = VOXELS  # along each side of the volume

    @property
    def voxel_m(self) -> float:
        return self.extent / (self.voxels - 1)

    def frames(self, sigma_m: float, cache: str | Path | None = None) -> Any:
        """The sequence with that noise."""
        from sdftrack.synth import sequence

        mesh, n = self.body.mesh, len(self.poses)
        return sequence(
            mesh, n, self.poses, sigma_m, seed=SEED, clutter=True, threads=self.threads, cache=cache
        )

    def along(self, poses: Array) -> Scene:
        """The same body on another path."""
        return replace(self, poses=poses)


def scene_of(mesh: Path | None, unit: str | None, frames: int, threads: int, voxels: int = VOXELS) -> Scene:
    """The built-in duck, or the given mesh, over a cluttered table."""
    it = body(mesh, unit)
    extent = EXTENT_PER_SIDE * float(np.ptp(it.mesh.bounds, axis=0).max())
    return Scene(it, motion(frames, STEP_M, STEP_RAD, SEED, it.middle), extent, threads, voxels)


def reconstructor(scene: Scene, seq: Any, sigma_d_voxels: float | None = None, **more: Any) -> Any:
    """Ours, or with `sigma_d_voxels` the thesis', tracker and all (``evolution="printed"``); `more`: options."""
    from sdftrack.reconstruction import Reconstructor

    if sigma_d_voxels is not None:
        more |= {"evolution": "printed", "sigma_d_voxels": sigma_d_voxels}
    return Reconstructor(seq.camera, voxels=scene.voxels, extent=scene.extent, threads=scene.threads, **more)
