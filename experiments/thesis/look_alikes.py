# SPDX-License-Identifier: MIT
"""Common parts of the figures with several identical objects: the shape, and the tracking variants."""

from __future__ import annotations

from typing import Any

from experiments.synth.contact import Solid
from experiments.thesis import Context

__all__ = ["name_of", "pair_of", "ways"]

VOXELS = 200
SCALE = 0.5  # of the built-in duck, to 0.1 m: two must get around each other in sixteen frames


def pair_of(context: Context) -> tuple[Any, Solid]:
    """The mesh and the solid that it bounds."""
    import sdftrack as st
    from sdftrack.synth.duck import duck_mesh

    if context.mesh is None:
        duck = duck_mesh()
        mesh = st.Mesh(SCALE * duck.vertices, duck.faces, duck.colors)
    else:
        mesh = st.Mesh.load(context.mesh, context.unit)
    return mesh, Solid.of(mesh, st.SDF.from_mesh(mesh, voxels=VOXELS, unit="m"))


def name_of(context: Context) -> str:
    return "the built-in duck, halved" if context.mesh is None else context.mesh.name


def ways(solid: Solid, camera: Any) -> list[str]:
    """Joint tracking with each form of the collision term, and one tracker per object."""
    import sdftrack as st

    try:
        st.Tracker([solid.sdf] * 2, camera, mode="depth", collision="printed")  # type: ignore[arg-type, unused-ignore]
    except (TypeError, ValueError):  # a version without that term
        return ["joint", "single"]
    return ["joint", "joint-none", "joint-printed", "single"]
