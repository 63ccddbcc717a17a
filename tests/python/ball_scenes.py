# SPDX-License-Identifier: MIT
"""Small recordings of a ball, rendered once for all tests."""

from functools import cache

import sdftrack as st
from experiments.synth.ball import ball_scene

DEPTH = st.Camera(262.0, 263.0, 159.0, 120.5, 320, 240)
COLOR = st.Camera(305.0, 306.0, 161.0, 118.0, 320, 240)
RADIUS_M = 0.05


@cache
def recorded(n=24, **setting):
    """(scene, frames) of a small ball scene; frames are rendered and kept."""
    scene = ball_scene(n, RADIUS_M, depth_camera=DEPTH, color_camera=COLOR, fps=7.5, **setting)
    return scene, [scene.sequence[i] for i in range(n)]
