# SPDX-License-Identifier: MIT
"""Plane patches (sheets, signs, table tops) seen by a depth camera: exact ray intersections, as in solids.py."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from experiments.synth.solids import FAR_M, SolidScene, rendered_scene
from sdftrack.camera import Camera

Array = NDArray[np.float64]
VIEWS = ("standing", "lying", "held")
DISTANCE_M = (0.6, 1.2)
LOOK_DOWN_RAD = (np.radians(25), np.radians(55))
YAW_RAD = np.radians(45)  # at most: a sheet seen from its edge shows no width
TILT_RAD = np.radians(60)
FLOOR_M = 0.4  # below a low table's top; seen within 3 m at all these angles
WALL_M = 0.5  # behind a sheet that is held
BOARD_M = 0.15  # how far before a patch something hides a part of it


def patch_scene(
    view: str,
    size: dict[str, float],
    camera: Camera,
    rng: np.random.Generator,
    distance_m: tuple[float, float] = DISTANCE_M,
) -> SolidScene:
    """A patch near the middle of the image, turned at random, its normal along z and towards the camera.

    Parameters
    ----------
    view : {"standing", "lying", "held"}
        Upright on a table, y axis up; horizontal like a low table top, 0.4 m above the floor; or in the air with
        arbitrary rotation and at most 60 degrees of tilt, 0.5 m in front of a wall.
    size : dict of str to float
        ``width``, ``height``, m.

    >>> scene = patch_scene("held", {"width": 0.2, "height": 0.3}, camera, np.random.default_rng(0))  # doctest: +SKIP
    """
    middle = rng.uniform(*distance_m) * np.array([rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 1])
    if view == "held":
        return _before_a_wall(size, middle, rng, camera)
    down = rng.uniform(*LOOK_DOWN_RAD)
    up = np.array([0, -np.cos(down), -np.sin(down)])
    ahead = np.cross([1.0, 0, 0], up)  # level, towards the camera
    if view == "standing":
        yaw = rng.uniform(-YAW_RAD, YAW_RAD)
        z = np.cos(yaw) * ahead + np.sin(yaw) * np.array([1.0, 0, 0])
        return _at(np.column_stack([np.cross(up, z), up, z]), middle, size, up, size["height"] / 2, camera)
    if view != "lying":
        raise ValueError(f"view: expected one of {', '.join(VIEWS)}, got {view!r}")
    turn = rng.uniform(0, 2 * np.pi)
    x = np.cos(turn) * np.array([1.0, 0, 0]) + np.sin(turn) * ahead
    return _at(np.column_stack([x, np.cross(up, x), up]), middle, size, up, FLOOR_M, camera)


def _before_a_wall(
    size: dict[str, float], middle: Array, rng: np.random.Generator, camera: Camera
) -> SolidScene:
    tilt, about, turn = rng.uniform(0, TILT_RAD), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
    z = np.array([np.sin(tilt) * np.cos(about), np.sin(tilt) * np.sin(about), -np.cos(tilt)])
    u = np.cross(z, [0.36, 0.48, 0.8])
    u /= np.linalg.norm(u)
    x = np.cos(turn) * u + np.sin(turn) * np.cross(z, u)
    return _at(np.column_stack([x, np.cross(z, x), z]), middle, size, np.array([0, 0, -1.0]), WALL_M, camera)


def _at(
    R: Array, middle: Array, size: dict[str, float], normal: Array, behind_m: float, camera: Camera
) -> SolidScene:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, middle
    return rendered_scene("plane", size, T, (normal, float(behind_m - normal @ middle)), camera)


def cut_scene(size: dict[str, float], camera: Camera, rng: np.random.Generator) -> SolidScene:
    """A patch whose right end is outside the image: its x axis is along the image's, so the width is unobservable."""
    z = rng.uniform(*DISTANCE_M)
    edge = camera.back_project(np.full(camera.shape, z, np.float32))[camera.height // 2, -1]
    seen = rng.uniform(0.3, 0.7) * size["width"]
    middle = np.array([float(edge[0]) + size["width"] / 2 - seen, rng.uniform(-0.05, 0.05), z])
    turn = rng.uniform(-0.1, 0.1)
    x = np.array([np.cos(turn), np.sin(turn), 0])
    normal = np.array([0, 0, -1.0])
    return _at(np.column_stack([x, np.cross(normal, x), normal]), middle, size, normal, WALL_M, camera)


def hidden_scene(size: dict[str, float], camera: Camera, rng: np.random.Generator) -> SolidScene:
    """A patch whose right end is occluded by a board, so the width is unobservable."""
    scene = cut_scene(size, camera, rng)
    T = scene.T_cam_obj.copy()
    T[0, 3] = rng.uniform(-0.05, 0.05)  # back into the picture
    scene = rendered_scene("plane", size, T, scene.plane, camera)
    columns = np.flatnonzero(scene.mask.any(axis=0))
    first = round(columns[0] + rng.uniform(0.3, 0.7) * (columns[-1] - columns[0]))
    board = np.zeros(camera.shape, bool)
    board[:, first : columns[-1] + 60] = True
    depth = np.where(board, np.float32(T[2, 3] - BOARD_M), scene.depth)
    return replace(scene, depth=np.where(depth < FAR_M, depth, np.float32(0)), mask=scene.mask & ~board)
