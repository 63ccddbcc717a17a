# SPDX-License-Identifier: MIT
"""Plain folders: rgb/, depth/ in millimetres, masks/, cam_K.txt, perhaps annotated_poses/ and mesh/."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.text_files import contents
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.camera.files import load_camera
from sdftrack.io.datasets.images import Entry, ImageFrames, image_files, image_size, numbered, numbers_of
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.sequence import LazyModels, Sequence
from sdftrack.io.frames import read_mask

DEPTH_SCALE = 1e-3


@register("folders", "cam_K.txt, depth/, rgb/, masks/", lambda root: (root / "cam_K.txt").is_file())
def open_folders(root: Path) -> Sequence:
    if not (root / "cam_K.txt").is_file():
        raise FileNotFoundError(f"{root / 'cam_K.txt'}: this layout needs the camera's 3 x 3 matrix there")
    depth, color = image_files(root / "depth"), numbered(image_files(root / "rgb"))
    masks = numbered(image_files(root / "masks"))
    camera = load_camera(Camera, root / "cam_K.txt", *image_size(root, depth))
    entries = [Entry(p, color.get(p.stem), DEPTH_SCALE) for p in depth]
    poses = {}
    for i, p in enumerate(depth):
        file = root / "annotated_poses" / f"{p.stem}.txt"
        if file.is_file():
            with contents(file, "the 16 numbers of T_cam_obj, metres"):
                poses[i] = {0: np.array(file.read_text(encoding="utf-8").split(), dtype=float).reshape(4, 4)}
    meshes = sorted(q for q in (root / "mesh").glob("*") if q.suffix in (".obj", ".ply", ".stl", ".glb"))

    def read_masks(i: int) -> dict[int, NDArray[np.bool_]]:
        file = masks.get(depth[i].stem)
        return {} if file is None else {0: read_mask(file, f"masks/{file.name}")}

    return Sequence(
        ImageFrames(root, entries, RGBDCamera(camera)),
        camera,
        poses,
        LazyModels({1: meshes[0]} if len(meshes) == 1 else {}, unit="m"),
        objects=[1] if poses or masks or len(meshes) == 1 else [],
        ids=numbers_of(depth),
        masks=read_masks,
        layout="folders",
        name=root.name,
    )
