# SPDX-License-Identifier: MIT
"""Frames rendered on access: objects on trajectories, surroundings, occluders, and sensor noise."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.io.datasets.sequence import Sequence
from sdftrack.synth.bodies import Body, Models
from sdftrack.synth.noise import noise_of
from sdftrack.synth.occluders import occluder_of
from sdftrack.synth.rendered import Rendered, World
from sdftrack.synth.surroundings import Table
from sdftrack.synth.trajectories import poses_of

__all__ = ["sequence"]

Array = NDArray[np.float64]
DEFAULT_CAMERA = Camera(525.0, 525.0, 319.5, 239.5, 640, 480)


def sequence(
    shape_or_mesh: Any,
    n: int,
    trajectory: Any = None,
    noise: Any = None,
    occluder: Any = None,
    seed: int = 0,
    *,
    camera: Camera | RGBDCamera | None = None,
    clutter: str | bool | Table | None = None,
    color: bool = True,
    fps: float = 30.0,
    threads: int = 0,
    cache: str | os.PathLike[str] | None = None,
) -> Sequence:
    """Create a synthetic sequence with exact ground truth, rendered on access.

    The same arguments give the same images, bit by bit, in any order of access.

    Parameters
    ----------
    shape_or_mesh : SDF, Mesh, path of a mesh in metres, or a list of these
        Meshes are rendered by exact ray casting. One object given twice is one model with two instances.
    n : int
        Frames.
    trajectory : "random" (default), "orbit", "static", "sweep", a function, or (n, 4, 4) poses T_cam_obj
        `random_walk(step_m=, step_rad=)`, `orbit(...)`, `static(...)`, `sweep(...)` and `leave_and_return(...)`
        make functions;
        (n, M, 4, 4) or a list gives each of M objects its own. By default, several objects stay side by side.
    noise : None, sigma in metres, "kinect", "stereo", `Gaussian(...)`, `Kinect(...)`, `Stereo(...)`, or a function
    occluder : None, True or "hand" (0.3), the fraction (0..0.8) of the first object that a hand hides, or
        `Hand(share)`, an open hand in front of it; "grip" or `Grip(share, color=...)`, fingers wrapped around it, in
        contact; `Cover(first, frames)`, a board that hides all of it for some frames; an object with `ready`
        as these have it (see `sdftrack.synth.stage.Occluder`)
    seed : int
        Seed of everything random: path, noise, clutter, colours.
    camera : Camera, optional
        Default: 640 x 480 with 525 px.
    clutter : None, "wall", "table" (and wall), "objects" (table, and ten things behind) or True for these, or
        "touching": a table under the first object, and boxes and cans on it that touch the object; they move with it;
        or a `Table` at a place of its own, and a wall
    color : bool
        Render colour images: the mesh's own colours, or a random solid texture from `seed`.
    fps : float
        Frames per second of the timestamps.
    threads : int
        0: all cores.
    cache : folder, optional
        Cache of noise-free images, reused by later runs with the same scene.

    Returns
    -------
    Sequence
        `ground_truth` in every frame, `models`, and `masks(i)`: the visible pixels of each object.

    Examples
    --------
    >>> from sdftrack import SDF
    >>> seq = sequence(SDF.box((0.1, 0.14, 0.18)), 2, noise=0.001, seed=3)
    >>> seq[0].depth.shape, sorted(seq.ground_truth)
    ((480, 640), [0, 1])
    """
    if isinstance(n, (bool, str)) or int(n) != n or n < 1:
        raise ValueError(f"n: expected a number of frames above 0, got {n!r}")
    if not fps > 0:
        raise ValueError(f"fps: expected frames per second above 0, got {fps}")
    given = list(shape_or_mesh) if isinstance(shape_or_mesh, list) else [shape_or_mesh]
    if not given:
        raise ValueError("shape_or_mesh: expected at least one shape, got an empty list")
    loaded: dict[int, Any] = {}
    bodies = [loaded.setdefault(id(s), Body(s, k, seed)) for k, s in enumerate(given)]
    eye = DEFAULT_CAMERA if camera is None else depth_camera(camera)
    poses = _all_poses(trajectory, int(n), bodies, seed)
    kind = ("objects" if clutter else None) if isinstance(clutter, bool) else clutter
    world = World(bodies, poses, eye, occluder_of(occluder), kind, color, seed, float(fps))
    frames = Rendered(world, noise_of(noise), threads, None if cache is None else Path(cache))
    distinct = list(dict.fromkeys(bodies))
    return Sequence(
        frames,
        RGBDCamera(eye),
        {i: {k: poses[k, i] for k in range(len(bodies))} for i in range(int(n))},
        Models(distinct),
        objects=[1 + distinct.index(b) for b in bodies],
        masks=frames.masks,
        layout="memory",
        name="synthetic",
    )


def _all_poses(trajectory: Any, n: int, bodies: list[Body], seed: int) -> Array:
    """(M, n, 4, 4)."""
    count = len(bodies)
    own: list[Any]
    if isinstance(trajectory, np.ndarray) and trajectory.ndim == 4:
        if trajectory.shape[:2] != (n, count):
            raise ValueError(f"trajectory: expected shape ({n}, {count}, 4, 4), got {trajectory.shape}")
        own = list(np.moveaxis(trajectory, 1, 0))
    elif isinstance(trajectory, list) and (count > 1 or (len(trajectory) == 1 and callable(trajectory[0]))):
        if len(trajectory) != count:
            raise ValueError(f"trajectory: expected one for each of {count} objects, got {len(trajectory)}")
        own = trajectory
    else:
        own = [trajectory] * count
    poses = np.array(
        [
            poses_of(t, n, np.random.default_rng([seed, 2, k]), body.centre)
            for k, (t, body) in enumerate(zip(own, bodies, strict=True))
        ]
    )
    if count > 1 and own[0] is own[-1] and not isinstance(trajectory, np.ndarray):
        gap = 1.2 * max(b.diameter for b in bodies)
        poses[:, :, 0, 3] += gap * (np.arange(count) - 0.5 * (count - 1))[:, None]
    return poses
