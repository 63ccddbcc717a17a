# SPDX-License-Identifier: MIT
"""The k1 layout: camera.json with K_depth and units, depth/, rgb/ of another camera, mask/, poses_init.json, a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.text_files import contents, read_json, read_text
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.io.datasets import images
from sdftrack.io.datasets.pairing import paired
from sdftrack.io.datasets.sequence import Sequence, register
from sdftrack.io.frames import read_mask

SMALLEST_COMPONENT_PX = 1000


def _detect(root: Path) -> bool:
    path = root / "camera.json"
    return path.is_file() and '"K_depth"' in read_text(path)


@register("k1", "camera.json with K_depth, depth/", _detect)
def open_k1(root: Path) -> Sequence:
    path = root / "camera.json"
    if not path.is_file():
        raise FileNotFoundError(f"{path}: this layout needs the file")
    values = read_json(path)
    with contents(path, "a camera.json of the k1 layout"):
        camera, scale = _camera(values), float(values["depth_scale_m"])
    depth, color = images.depth_files(root), images.color_files(root)
    masks = paired(depth, images.image_files(root / "mask"), "masks")
    ids = images.numbers_of(depth) or list(range(len(depth)))
    entries = [images.Entry(p, image, scale) for p, image in zip(depth, paired(depth, color), strict=True)]
    truth = _ground_truth(root / "poses_init.json", ids)
    instances = 1 + max((k for poses in truth.values() for k in poses), default=-1)

    def read_masks(i: int) -> dict[int, NDArray[np.bool_]]:
        file = masks[i]
        return {} if file is None else components(read_mask(file, f"mask/{file.name}"))

    return images.sequence_of(
        root, "k1", entries, camera, truth, colors=len(color), meshes=sorted(root.glob("*.ply")),
        objects=[1] * instances, ids=ids, masks=read_masks,
    )  # fmt: skip


def components(mask: NDArray[np.bool_]) -> dict[int, NDArray[np.bool_]]:
    import cv2

    count, labels, stats, centroids = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    large = [n for n in range(1, count) if stats[n, cv2.CC_STAT_AREA] >= SMALLEST_COMPONENT_PX]
    return {k: labels == n for k, n in enumerate(sorted(large, key=lambda n: centroids[n][0]))}


def _camera(values: dict[str, Any]) -> RGBDCamera:
    def pinhole(K: dict[str, Any], size: list[int]) -> Camera:
        lens = tuple(K.get("distortion") or ())
        return Camera(K["fx"], K["fy"], K["cx"], K["cy"], int(size[0]), int(size[1]), lens)

    size = values["image_size"]
    depth = pinhole(values["K_depth"], size)
    color = pinhole(values["K_color"], values.get("color_size", size)) if "K_color" in values else None
    if "T_color_depth" in values and color is not None:
        return RGBDCamera(depth, color, T_color_depth=np.array(values["T_color_depth"], dtype=float))
    if "depth_to_color_Pq" in values:
        P, q = (np.array(values["depth_to_color_Pq"][name], dtype=float) for name in "Pq")
        return RGBDCamera(depth, color, projective=(P, q))
    return RGBDCamera(depth)


def _ground_truth(path: Path, ids: list[int]) -> dict[int, dict[int, NDArray[np.float64]]]:
    if not path.is_file():
        return {}
    number = {im_id: i for i, im_id in enumerate(ids)}
    values = read_json(path)
    with contents(path, "frames -> image -> object -> T_cam_obj (4 x 4)"):
        return {
            number[int(im_id)]: {
                int(obj) - 1: np.array(entry["T_cam_obj"], dtype=float) for obj, entry in poses.items()
            }
            for im_id, poses in values["frames"].items()
            if int(im_id) in number
        }
