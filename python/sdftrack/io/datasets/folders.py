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
    camera_beside,
    color_files,
    depth_files,
    image_files,
    image_size,
    matching,
    numbers_of,
)
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.pairing import paired, times_of
from sdftrack.io.datasets.sequence import LazyModels, Sequence
from sdftrack.io.frames import read_mask

DEPTH_SCALE = 1e-3


@register(
    "folders",
    "cam_K.txt, depth/, rgb/, masks/",
    lambda root: (root / "cam_K.txt").is_file(),
    ("depth_glob", "color_glob", "camera"),
)
def open_folders(
    root: Path, depth_glob: str | None = None, color_glob: str | None = None, camera: Path | None = None
) -> Sequence:
    """`depth_glob`, `color_glob`: patterns of the files below the folder; `camera`: its file, if not beside them."""
    depth = depth_files(root) if depth_glob is None else matching(root, depth_glob, "depth_glob")
    color = color_files(root) if color_glob is None else matching(root, color_glob, "color_glob")
    file = root / "cam_K.txt" if camera is None and depth_glob is None else camera
    if file is not None and not file.is_file():
        raise FileNotFoundError(f"{file}: this layout needs the camera's 3 x 3 matrix there")
    masks = paired(depth, image_files(root / "masks"), "masks")
    size = image_size(root, depth)
    lens = camera_beside(root, size) if file is None else read_camera(Camera, file, *size)
    if lens is None:
        raise FileNotFoundError(f"camera: no file of the camera in {root}; pass one")
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
        ImageFrames(root, entries, RGBDCamera(lens), len(color)),
        lens,
        poses,
        LazyModels({1: meshes[0]} if len(meshes) == 1 else {}, unit="m"),
        objects=[1] if poses or masks or len(meshes) == 1 else [],
        ids=numbers_of(depth),
        masks=read_masks,
        layout="folders",
        name=root.name,
    )
