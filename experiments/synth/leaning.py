# SPDX-License-Identifier: MIT
"""Round bodies on a table that do not stand upright."""

from __future__ import annotations

import numpy as np

from experiments.synth.solids import SolidScene, random_solid, rendered_scene, standing_scene
from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.geometry import pose


def posed_scene(
    kind: str, camera: Camera, rng: np.random.Generator, lean_deg: float, above_m: float
) -> SolidScene:
    """A random solid whose axis leans from the table's normal in a random direction, its lowest point `above_m`."""
    upright = standing_scene(kind, random_solid(kind, rng), camera, rng)
    about = rng.uniform(0, 2 * np.pi)
    turn = np.radians(lean_deg) * np.array([np.cos(about), np.sin(about), 0.0])
    T = upright.T_cam_obj @ pose(turn.tolist(), [0.0, 0.0, 0.0])
    normal, offset = upright.plane
    reach = _core.primitive_reach(
        _core.PrimitiveKind.__members__[kind], list(upright.size.values()), (-(T[:3, :3].T @ normal)).tolist()
    )[0]
    T[:3, 3] += (above_m + reach - (normal @ T[:3, 3] + offset)) * normal
    return rendered_scene(kind, upright.size, T, upright.plane, camera)
