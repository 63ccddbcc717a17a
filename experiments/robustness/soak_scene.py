# SPDX-License-Identifier: MIT
"""What the long runs look at: a coloured box that moves there and back before a wall, in images of 64 x 48 pixels."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from sdftrack import geometry

CAMERA = st.Camera(52.5, 52.5, 31.5, 23.5, 64, 48)
SIZE_M = (0.12, 0.09, 0.06)
WALL_M = 1.2
NOISE_M = 0.001
FRAMES = 30  # of the way there; the way back shows the same frames


def there_and_back(k: int) -> int:
    """The frame that step `k` sees: 0, 1, ..., 29, 28, ..., 1, 0, 1, ..."""
    k %= 2 * FRAMES - 2
    return k if k < FRAMES else 2 * FRAMES - 2 - k


@functools.cache
def box(scale: float = 1.0) -> st.SDF:
    return st.SDF.box(scale * np.array(SIZE_M), voxels=32)


@functools.cache
def poses(place: float = 0.0) -> NDArray[np.float64]:
    """(30, 4, 4) poses in the camera's frame; `place` is where the object is, m to the right."""
    parts = np.linspace(0, 1, FRAMES)
    return np.stack([geometry.pose([0.5 + 0.2 * p, -0.6, 0.2], [place + 0.02 * p, 0.02, 0.4]) for p in parts])


@functools.cache
def frames(places: tuple[float, ...] = (0.0,), scale: float = 1.0) -> list[st.Frame]:
    """A frame for each pose: depth with noise, and colours in which objects, wall and noise differ."""
    rng = np.random.default_rng(0)
    made = []
    for k in range(FRAMES):
        depth = np.full(CAMERA.shape, WALL_M, np.float32)
        color = np.full((*CAMERA.shape, 3), (90, 100, 110), np.float64)
        for i, place in enumerate(places):
            seen = box(scale).render(CAMERA, poses(place)[k])[0]
            nearer = (seen > 0) & (seen < depth)
            depth[nearer] = seen[nearer]
            color[nearer] = ((200, 60, 40), (50, 190, 70), (70, 80, 210))[i % 3]
        depth += rng.normal(0, NOISE_M, depth.shape).astype(np.float32)
        color += rng.normal(0, 8, color.shape)
        made.append(st.Frame(depth, np.clip(color, 0, 255).astype(np.uint8), index=k))
    return made


def following(tracker: Any, seen: list[st.Frame]) -> Callable[[int], st.TrackResult]:
    """A step that passes the frame of each step to a tracker that was started."""
    return lambda k: tracker.track(seen[there_and_back(k)].replace(index=k, timestamp=k / 30))
