# SPDX-License-Identifier: MIT
"""The body that a figure shows: the built-in duck, or a mesh that the user names."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st

VOXELS = 200


@dataclass(frozen=True)
class Body:
    """A mesh with its name, m."""

    mesh: Any
    name: str
    unit: str | None = "m"

    @property
    def middle(self) -> NDArray[np.float64]:
        """Of the bounding box."""
        return np.asarray(self.mesh.bounds.mean(axis=0))

    def sdf(self, voxels: int = VOXELS) -> Any:
        """Its volume; without a unit that the user has named, an implausible size is refused."""
        return st.SDF.from_mesh(self.mesh, voxels=voxels, unit="m" if self.unit == "m" else None)


def body(mesh: Path | None, unit: str | None, scale: float = 1.0) -> Body:
    """The mesh of that file, or the duck times `scale`."""
    from sdftrack.synth.objects import duck_mesh

    if mesh is not None:
        return Body(st.Mesh.load(mesh, unit), mesh.name, unit)  # type: ignore[arg-type]
    duck = duck_mesh()
    half = "" if scale == 1.0 else f", times {scale:g}"
    return Body(st.Mesh(scale * duck.vertices, duck.faces, duck.colors), f"the built-in duck{half}")
