# SPDX-License-Identifier: MIT
"""A duck that turns before a wall, at a quarter of the usual size, for the commands that follow it."""

import numpy as np

import sdftrack as st
from experiments.common.truth import motion

CAMERA = st.Camera(262.0, 262.0, 79.5, 59.5, 160, 120)
FRAMES = 8


def poses(degrees: float) -> np.ndarray:
    """Its true poses, with turns of so many degrees between frames."""
    return motion(FRAMES, 0.004, np.deg2rad(degrees), seed=2)


def scene(mesh: st.Mesh, at: np.ndarray) -> st.Sequence:
    """Frames with 1 mm of noise, masks, truth and the mesh, which is the model."""
    return st.synth.sequence(mesh, FRAMES, at, 0.001, camera=CAMERA, clutter="wall", seed=5)
