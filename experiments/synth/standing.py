# SPDX-License-Identifier: MIT
"""An object that stands on a table while the camera moves around it, and is then lifted and rotated."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.mesh import Mesh
from sdftrack.synth.noise import noise_of
from sdftrack.synth.surroundings import Layer, plane_layer
from sdftrack.synth.trajectories import orbit

Array = NDArray[np.float64]

TABLE, WOOD = np.array([0.0, 0.0, 1.0]), (150, 120, 90)
LIFT_M, LIFT_FRAMES = 0.15, 15  # how high, and how soon
TURN_RAD = float(np.radians(3))  # per frame, of what was taken up
CAMERA = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
FPS = 30.0


def standing(
    mesh: Mesh,
    n: int,
    noise: Any = 0.001,
    *,
    camera: Camera = CAMERA,
    distance_m: float = 0.6,
    turns: float = 0.5,
    elevation_rad: float = 0.6,
    taken_up_at: int | None = None,
    seed: int = 0,
) -> Sequence:
    """Sequence of an object on a table, with the z axis of its mesh upwards and its lowest point on the table.

    Parameters
    ----------
    mesh : Mesh
        m, z up.
    n : int
        Frames.
    noise : None, float, str or function
        As in :func:`sequence`.
    turns : float
        Revolutions of the camera around the object, over all frames.
    taken_up_at : int, optional
        From this frame on the object rises by 15 cm and rotates about a horizontal axis by 3 deg per frame; table and
        camera stay fixed.

    Returns
    -------
    Sequence
        With masks of what is visible, and the poses ``T_cam_obj``.
    """
    rng = np.random.default_rng(seed)
    low, high = mesh.bounds
    centre = 0.5 * (low + high)
    views = orbit(distance_m=distance_m, turns=turns, elevation_rad=elevation_rad)(n, rng, centre)
    if taken_up_at is not None:
        views[taken_up_at:] = views[taken_up_at]
    poses = np.array([view @ _taken_up(i, taken_up_at, centre) for i, view in enumerate(views)])
    error = noise_of(noise)
    frames, masks = [], []
    for i, (view, pose) in enumerate(zip(views, poses, strict=True)):
        scene, mask = _scene(mesh, camera, view, pose, float(low[2]))
        depth = scene.depth
        if error is not None:
            depth = error(depth, scene.cosine, np.random.default_rng((seed, i)))
        frames.append(Frame(depth, scene.color, timestamp=i / FPS, index=i, check_units=False))
        masks.append({0: mask})
    return Sequence(frames, camera, poses, {1: mesh}, masks=lambda i: masks[i])


def _taken_up(i: int, first: int | None, centre: Array) -> Array:
    """Motion of the object against its place on the table, (4, 4)."""
    if first is None or i <= first:
        return np.eye(4)
    up = LIFT_M * min(1.0, (i - first) / LIFT_FRAMES)
    T = geometry.pose([TURN_RAD * (i - first), 0, 0], [0, 0, up])
    T[:3, 3] += centre - T[:3, :3] @ centre
    return T


def _scene(
    mesh: Mesh, camera: Camera, view: Array, pose: Array, floor_m: float
) -> tuple[Layer, NDArray[np.bool_]]:
    """What the camera looks at, and which of it is the object."""
    normal, point = view[:3, :3] @ TABLE, view[:3, :3] @ (floor_m * TABLE) + view[:3, 3]
    scene = plane_layer(camera, normal, point, WOOD, np.random.default_rng(7))
    depth, normals, colors = mesh.raycast(camera, pose)
    if colors is None:
        colors = np.full((*camera.shape, 3), 170, np.uint8)
    window, nearer = scene.put(Layer.of(camera, depth, normals, lambda window: colors[window]))
    mask = np.zeros(camera.shape, bool)
    mask[window] = nearer
    return scene, mask
