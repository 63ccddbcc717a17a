# SPDX-License-Identifier: MIT
"""Things on a table, labelled: recorded scenes, and one that is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Scene", "made_scene", "open_scenes", "through"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
# Of `made_scene`; changing these numbers breaks comparisons with tests/bench/bench_planes.py.
ABOVE_M, PITCH_RAD = 0.6, np.radians(45)
BOXES = (
    ((0.12, 0.1, 0.08), -0.15),
    ((0.1, 0.2, 0.1), 0.05),
    ((0.2, 0.05, 0.1), 0.25),
)  # size, place across, m


@dataclass(frozen=True)
class Scene:
    """A frame, its camera, and which readings are the table's and the objects'; `height_m` over the labelled table."""

    name: str
    frame: Any
    camera: Any
    table: Mask
    objects: Mask
    height_m: Array


def open_scenes(folder: Path) -> list[Scene]:
    """The scenes of the Object Segmentation Database in a folder (or in its part `osd`)."""
    import sdftrack as st
    from sdftrack.io.frames import read_depth_units

    folder = folder / "osd" if (folder / "osd").is_dir() else folder
    files = sorted(folder.glob("*_depth.png"))
    if not files:
        raise FileNotFoundError(
            f"data: expected scenes NAME_depth.png and NAME_label.png in {folder}, found none"
        )
    camera: Any = st.Camera.load(folder / "camera.json")
    scenes = []
    for path in files:
        name = path.name.removesuffix("_depth.png")
        frame = st.Frame(read_depth_units(path), depth_scale=0.001)
        labels = _labels(path.with_name(f"{name}_label.png"))
        points = camera.back_project(frame.depth)
        table = (labels >= 1) & (labels <= 9)
        n, d = through(points[table])
        scenes.append(Scene(name, frame, camera, table, labels >= 20, points @ n + d))
    return scenes


def made_scene(seed: int = 0) -> Scene:
    """Three boxes on a table 0.6 m below a camera that looks down by 45 degrees, noise of structured light."""
    import sdftrack as st
    from sdftrack import geometry
    from sdftrack.synth.noise import Kinect
    from sdftrack.synth.surroundings import box_mesh

    camera = st.Camera(525.0, 525.0, 319.5, 239.5, 640, 480)
    n = np.array([0, -np.cos(PITCH_RAD), -np.sin(PITCH_RAD)])
    forward = np.array([0, n[2], -n[1]])
    rays = np.concatenate([camera.rays, np.ones((*camera.shape, 1))], axis=-1)
    along = rays @ n
    depth = np.where(along < 0, -ABOVE_M / np.minimum(along, -1e-6), 0)
    depth[depth > 3] = 0
    cosine, objects = np.clip(-along / np.linalg.norm(rays, axis=-1), 0, 1), np.zeros(depth.shape, bool)
    for size, across in BOXES:
        middle = -ABOVE_M * n + 0.4 * forward + [across, 0, 0] + 0.5 * size[1] * n
        mesh, T = box_mesh(np.array(size)), geometry.pose((PITCH_RAD, 0, 0), middle)
        seen, normals, _ = mesh.raycast(camera, T)
        near = (seen > 0) & ((seen < depth) | (depth == 0))
        depth[near], objects[near] = seen[near], True
        cosine[near] = np.abs((normals * rays).sum(-1) / np.linalg.norm(rays, axis=-1))[near]
    noisy = Kinect()(depth.astype(np.float32), cosine.astype(np.float32), np.random.default_rng(seed))
    height = (depth[..., None] * rays) @ n + ABOVE_M
    read = noisy > 0
    frame = st.Frame(noisy, check_units=False)
    return Scene("boxes", frame, camera, read & ~objects, read & objects, height)


def _labels(path: Path) -> NDArray[np.uint8]:
    import cv2

    labels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if labels is None:
        raise FileNotFoundError(f"data: expected the labels of a scene in {path}, found none")
    return labels.astype(np.uint8)


def through(points: Array) -> tuple[Array, float]:
    """Total least squares plane through all points, normal towards the camera."""
    mean = points.mean(axis=0)
    n = np.linalg.eigh((points - mean).T @ (points - mean))[1][:, 0]
    n = -n if n @ mean > 0 else n
    return n, -float(n @ mean)
