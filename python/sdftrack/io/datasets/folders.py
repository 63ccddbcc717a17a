# SPDX-License-Identifier: MIT
"""Plain folders: rgb/, depth/ in millimetres, masks/, cam_K.txt, perhaps annotated_poses/ and mesh/."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.text_files import contents, read_text
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.camera.files import read_camera
from sdftrack.io.datasets.images import (
    Entry,
    ImageFrames,
    color_files,
    depth_files,
    image_files,
    image_size,
    numbers_of,
)
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.pairing import paired, times_of
from sdftrack.io.datasets.sequence import LazyModels, Sequence
from sdftrack.io.frames import read_mask

DEPTH_SCALE = 1e-3


@register("folders", "cam_K.txt, depth/, rgb/, masks/", lambda root: (root / "cam_K.txt").is_file())
def open_folders(root: Path) -> Sequence:
    if not (root / "cam_K.txt").is_file():
        raise FileNotFoundError(f"{root / 'cam_K.txt'}: this layout needs the camera's 3 x 3 matrix there")
    depth, color = depth_files(root), color_files(root)
    masks = paired(depth, image_files(root / "masks"), "masks")
    camera = read_camera(Camera, root / "cam_K.txt", *image_size(root, depth))
    times = times_of(depth, str(root / "depth"))
    entries = [
        Entry(p, image, DEPTH_SCALE, None if times is None else float(times[i]))
        for i, (p, image) in enumerate(zip(depth, paired(depth, color), strict=True))
    ]
    poses = {}
    for i, file in enumerate(paired(depth, image_files(root / "annotated_poses", (".txt",)), "poses")):
        if file is not None:
            with contents(file, "the 16 numbers of T_cam_obj, metres"):
                poses[i] = {0: np.array(read_text(file).split(), dtype=float).reshape(4, 4)}
    meshes = sorted(q for q in (root / "mesh").glob("*") if q.suffix in (".obj", ".ply", ".stl", ".glb"))

    def read_masks(i: int) -> dict[int, NDArray[np.bool_]]:
        file = masks[i]
        return {} if file is None else {0: read_mask(file, f"masks/{file.name}")}

    return Sequence(
        ImageFrames(root, entries, RGBDCamera(camera), len(color)),
        camera,
        poses,
        LazyModels({1: meshes[0]} if len(meshes) == 1 else {}, unit="m"),
        objects=[1] if poses or masks or len(meshes) == 1 else [],
        ids=numbers_of(depth),
        masks=read_masks,
        layout="folders",
        name=root.name,
    )
