# SPDX-License-Identifier: MIT
"""Common parts of the figures on reconstruction: the scene of Figure 4.13, a reconstructor started from a ball."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.thesis import Context
from experiments.thesis.scenes.truth import motion

__all__ = ["VOXELS", "Scene", "reconstructor", "scene_of"]

Array = NDArray[np.float64]
FRAMES, SEED, VOXELS = 300, 0, 200
STEP_M, STEP_RAD = 0.005, np.deg2rad(1.5)  # of Figure 4.13 (a)
EXTENT_PER_SIDE = 1.8


@dataclass(frozen=True)
class Scene:
    """A mesh on its path. `extent` m: side of the volume that is given to every reconstructor."""

    mesh: Any
    name: str
    poses: Array
    extent: float
    threads: int

    @property
    def middle(self) -> Array:
        middle: Array = self.mesh.bounds.mean(axis=0)
        return middle

    @property
    def voxel_m(self) -> float:
        return self.extent / (VOXELS - 1)

    def frames(self, sigma_m: float, cache: str | Path | None = None) -> Any:
        """The sequence with that noise."""
        from sdftrack.synth import sequence

        return sequence(
            self.mesh, len(self.poses), self.poses, sigma_m, seed=SEED, clutter=True, threads=self.threads,
            cache=cache,
        )  # fmt: skip


def scene_of(context: Context, frames: int = FRAMES) -> Scene:
    """The built-in duck, or the given mesh, rotated until its whole surface has been observed."""
    from sdftrack.mesh import Mesh
    from sdftrack.synth.duck import duck_mesh

    mesh = duck_mesh() if context.mesh is None else Mesh.load(context.mesh, context.unit)
    n = frames if context.frames is None else context.frames
    poses = motion(n, STEP_M, STEP_RAD, SEED, mesh.bounds.mean(axis=0))
    extent = EXTENT_PER_SIDE * float(np.ptp(mesh.bounds, axis=0).max())
    name = "the built-in duck" if context.mesh is None else context.mesh.name
    return Scene(mesh, name, poses, extent, int(context.options.get("threads", 0)))


def reconstructor(scene: Scene, seq: Any, sigma_d_voxels: float | None = None) -> Any:
    """Ours, or with `sigma_d_voxels` the thesis', tracker and all (``evolution="printed"``)."""
    from sdftrack.reconstruction import Reconstructor

    more: dict[str, Any] = {}
    if sigma_d_voxels is not None:
        more = {"evolution": "printed", "sigma_d_voxels": sigma_d_voxels}
    return Reconstructor(seq.camera, voxels=VOXELS, extent=scene.extent, threads=scene.threads, **more)
