# SPDX-License-Identifier: MIT
"""BOP scenes: scene_camera.json, scene_gt.json, rgb/ or gray/ (or a video), depth/, mask_visib/, models/; mm."""

from __future__ import annotations

import functools
import re
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.rotations import RotationErrors, rigid_pose
from sdftrack._internal.text_files import contents, read_json
from sdftrack._internal.validation import shown
from sdftrack.camera import Camera
from sdftrack.io.datasets import images
from sdftrack.io.datasets.sequence import LazyModels, Sequence, register
from sdftrack.io.datasets.video_images import VideoImage, VideoImages
from sdftrack.io.frames import read_mask
from sdftrack.symmetry import Symmetry

M_PER_MM = 1e-3
NEAREST_M = 0.01  # no depth camera sees an object there


@register("bop", "scene_camera.json, depth/", lambda root: (root / "scene_camera.json").is_file())
def open_bop(root: Path) -> Sequence:
    if not (root / "scene_camera.json").is_file():
        raise FileNotFoundError(f"{root / 'scene_camera.json'}: a BOP scene needs this file")
    cameras = _by_number(root / "scene_camera.json", dict)
    if not cameras:
        raise ValueError(f"{root / 'scene_camera.json'}: expected at least one image, got none")
    ids = sorted(cameras)
    depth_images = images.image_files(root / "depth", images.DEPTH_SUFFIXES)
    color_images = images.color_files(root)
    depth, color = images.by_number(depth_images), images.by_number(color_images)
    video = None if color else VideoImages.of(root)
    size = images.image_size(root, depth_images)
    intrinsics = [_camera(root, i, cameras[i], *size) for i in ids]
    entries = [
        images.Entry(
            depth.get(i, root / "depth" / f"{i:06d}.png"),
            VideoImage(video, i) if video else color.get(i),
            *_scale_and_time(root, i, cameras[i]),
            camera=None if intrinsics[0] == K else K,
        )
        for i, K in zip(ids, intrinsics, strict=True)
    ]
    objects, places, truth = _ground_truth(root, ids)

    @functools.cache
    def mask_files() -> dict[tuple[int, int], Path]:
        """By image and place, however many digits their names have; of what is visible before the whole."""
        files = [*images.image_files(root / "mask"), *images.image_files(root / "mask_visib")]
        names = ((re.fullmatch(r"(\d+)_(\d+)", p.stem), p) for p in files)
        return {(int(name[1]), int(name[2])): p for name, p in names if name}

    def masks(i: int) -> dict[int, NDArray[np.bool_]]:
        found = {k: mask_files().get((ids[i], place)) for k, place in places.get(i, {}).items()}
        return {k: read_mask(f, f"{f.parent.name}/{f.name}") for k, f in found.items() if f is not None}

    unused = len(color_images) - len(color.keys() & set(ids))
    return images.sequence_of(
        root, "bop", entries, intrinsics[0], truth, colors=unused and len(color_images), video=video,
        models=LazyModels(_model_files(root), unit="mm"), symmetries=_symmetries(root), objects=objects, ids=ids,
        masks=masks,
    )  # fmt: skip


def _by_number(path: Path, kind: type) -> dict[int, Any]:
    read = read_json(path)
    try:
        values = {int(i): value for i, value in read.items()}
    except (AttributeError, TypeError, ValueError):
        raise ValueError(f"{path}: expected an object with image numbers as keys") from None
    for i, value in values.items():
        if not isinstance(value, kind):
            what = "an object" if kind is dict else "a list"
            raise ValueError(f"{path}, image {i}: expected {what}, got {shown(value)}")
    return values


def _camera(root: Path, im_id: int, values: dict[str, Any], width: int, height: int) -> Camera:
    with contents(f"{root / 'scene_camera.json'}, image {im_id}", "cam_K, the 9 numbers of a camera"):
        return Camera._from_K(np.reshape(np.asarray(values["cam_K"], dtype=float), (3, 3)), width, height)


def _scale_and_time(root: Path, im_id: int, values: dict[str, Any]) -> tuple[float, float | None]:
    """Metres per unit, and seconds: an addition to BOP's files, which have no times."""
    scale, time_s = values.get("depth_scale", 1.0), values.get("timestamp")
    where = f"{root / 'scene_camera.json'}, image {im_id}"
    if not _is_number(scale) or not scale > 0:
        raise ValueError(f"{where}: depth_scale: expected mm per unit, a number above 0, got {shown(scale)}")
    if time_s is not None and not _is_number(time_s):
        raise ValueError(f"{where}: timestamp: expected s, got {shown(time_s)}")
    return M_PER_MM * float(scale), time_s


def _ground_truth(
    root: Path, ids: list[int]
) -> tuple[list[int], dict[int, dict[int, int]], dict[int, dict[int, NDArray[np.float64]]]]:
    """obj_id of each instance, {i: {k: index in the image's list}} and {i: {k: T_cam_obj}}. The index in an image's
    list does not identify an instance: k follows from its obj_id and its rank among instances of the same obj_id, or
    from ``instance``, an addition to BOP's files."""
    path = root / "scene_gt.json"
    if not path.is_file():
        return [], {}, {}
    listed = _by_number(path, list)
    instances: dict[tuple[int, int], int] = {}
    places: dict[int, dict[int, int]] = {}
    poses: dict[int, dict[int, NDArray[np.float64]]] = {}
    errors, numbered = RotationErrors(), True
    for i, im_id in enumerate(ids):
        seen: dict[int, int] = {}
        for place, entry in enumerate(listed.get(im_id, ())):
            where = f"{path}, image {im_id}, entry {place}"
            with contents(where, "obj_id (a whole number), cam_R_m2c (9), cam_t_m2c (3)"):
                obj_id = _whole(entry["obj_id"])
                instance = _whole(entry["instance"]) if "instance" in entry else None
                T = np.eye(4)
                T[:3, :3] = np.reshape(entry["cam_R_m2c"], (3, 3))
                T[:3, 3] = M_PER_MM * np.reshape(np.asarray(entry["cam_t_m2c"], dtype=float), (3,))
            T = rigid_pose(T, where, errors)
            rank = seen[obj_id] = seen.get(obj_id, -1) + 1
            key = (obj_id, rank if instance is None else instance)
            k = instances.setdefault(key, len(instances))
            if k in poses.get(i, {}):
                raise ValueError(f"{where}: instance {instance} is there twice")
            places.setdefault(i, {})[k] = place
            poses.setdefault(i, {})[k] = T
            numbered &= instance is not None
    errors.tell()
    distances = [float(np.linalg.norm(T[:3, 3])) for found in poses.values() for T in found.values()]
    if distances and max(distances) < NEAREST_M and np.median(distances) > M_PER_MM * NEAREST_M:
        text = f"{path}: read as metres: as millimetres every object is nearer than {1e3 * NEAREST_M:g} mm"
        warnings.warn(text, stacklevel=2)
        for T in (T for found in poses.values() for T in found.values()):
            T[:3, 3] /= M_PER_MM
    if numbered:  # in their own order, whichever is seen first
        order = {instances[key]: n for n, key in enumerate(sorted(instances, key=lambda key: key[1]))}
        places = {i: {order[k]: place for k, place in found.items()} for i, found in places.items()}
        poses = {i: {order[k]: T for k, T in found.items()} for i, found in poses.items()}
        return [obj_id for obj_id, _ in sorted(instances, key=lambda key: key[1])], places, poses
    return [obj_id for obj_id, _ in instances], places, poses


def _whole(value: Any) -> int:
    if not _is_number(value) or value != int(value):
        raise ValueError(f"{shown(value)} is not a whole number")
    return int(value)


def _is_number(value: Any) -> bool:
    """Whether it is one that is finite as a float, which integers of hundreds of digits are not."""
    return (
        isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
    )


def _model_folders(root: Path) -> tuple[Path, ...]:
    return (root / "models", root.parent / "models", root.parent.parent / "models")


def read_symmetries(path: Path) -> dict[int, Symmetry]:
    """{obj_id: Symmetry} of a ``models_info.json``; objects without any are omitted."""
    found = {}
    for obj_id, info in _by_number(path, dict).items():
        try:
            symmetry = Symmetry.from_bop(info)
        except ValueError as error:
            raise ValueError(f"{path}, object {obj_id}: {error}") from None
        if symmetry:
            found[obj_id] = symmetry
    return found


def _symmetries(root: Path) -> dict[int, Symmetry]:
    for folder in _model_folders(root):
        if (folder / "models_info.json").is_file():
            return read_symmetries(folder / "models_info.json")
    return {}


def _model_files(root: Path) -> dict[int, Path]:
    """Models beside the scene, or beside its split as in a whole BOP data set."""
    for folder in _model_folders(root):
        files = {
            int(found.group(1)): p
            for p in (folder.iterdir() if folder.is_dir() else ())
            if (found := re.fullmatch(r"obj_(\d+)\.ply", p.name))
        }
        if files:
            return files
    return {}
