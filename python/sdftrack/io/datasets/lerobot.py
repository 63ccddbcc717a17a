# SPDX-License-Identifier: MIT
"""Data sets of LeRobot (v3): an episode's depth, 12-bit video or TIFF, with the colour video beside it; poses out.
Codes 0 and 4095 of a video are what lies outside its range: no measurement. LeRobot stores no intrinsics."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack._internal.files import write_json
from sdftrack._internal.rotations import quaternion
from sdftrack._internal.text_files import contents, read_json
from sdftrack.camera import Camera, RGBDCamera
from sdftrack.camera.files import read_camera
from sdftrack.frame import Frame
from sdftrack.io.datasets.images import camera_beside
from sdftrack.io.datasets.sequence import Sequence, register
from sdftrack.io.frames import decode_color, decode_depth_units

INFO = "meta/info.json"
LAST_CODE = 4095
DEFAULTS = {"depth_min": 0.01, "depth_max": 10.0, "shift": 3.5, "use_log": True}  # LeRobot's, metres
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw", "confidence")
MILLIMETRES = 1e-3  # of whole numbers; floating-point images are in metres


@register(
    "lerobot",
    "meta/info.json of LeRobot v3",
    lambda root: (root / INFO).is_file(),
    ("episode", "depth_key", "camera"),
)
def open_lerobot(
    root: Path, episode: int = 0, depth_key: str | None = None, camera: Path | None = None
) -> Sequence:
    info = read_json(root / INFO)
    with contents(root / INFO, "features with shapes, fps and paths, as of LeRobot v3"):
        features = dict(info["features"])
        depth_keys = [key for key, feature in features.items() if _is_depth(feature)]
        version = str(info.get("codebase_version", ""))
    if not version.startswith("v3"):
        expected = "expected codebase_version v3"
        raise ValueError(f"{root / INFO}: {expected}, got {version!r}; convert it with LeRobot")
    if depth_key is None and len(depth_keys) == 1:
        depth_key = depth_keys[0]
    if depth_key is None or depth_key not in depth_keys:
        known = ", ".join(depth_keys) or "none"
        expected = f"expected one of the depth features of {root} ({known})"
        raise ValueError(f"depth_key: {expected}, got {depth_key!r}")
    where = _episode(root, episode)
    table = _table(_data_file(root, info, where))
    own = [i for i, e in enumerate(table["episode_index"].to_pylist()) if e == episode]
    if not own:
        raise ValueError(f"{root}: episode {episode} has no rows")
    rows = table.slice(own[0], len(own))
    beside = depth_key.removesuffix("_depth")
    color_key = beside if beside != depth_key and beside in features else None
    frames = LeRobotFrames(root, info, where, rows, depth_key, color_key)
    height, width = frames.first_shape()
    file = next((f for f in (camera, root / f"{depth_key}.json") if f is not None and f.is_file()), None)
    lens = camera_beside(root, (width, height)) if file is None else read_camera(Camera, file, width, height)
    if lens is None:
        put = f"put a camera.json of {depth_key} there, or pass camera"
        raise ValueError(f"{root}: LeRobot stores no intrinsics; {put}")
    ids, close = rows["frame_index"].to_pylist(), frames.close
    sequence = Sequence(frames, RGBDCamera(lens), ids=ids, layout="lerobot", name=root.name, close=close)
    sequence.quantization = frames.quantization
    return sequence


def _is_depth(feature: Mapping[str, Any]) -> bool:
    info = {**(feature.get("video_info") or {}), **(feature.get("info") or {})}
    return bool(info.get("is_depth_map") or info.get("video.is_depth_map"))


def _table(path: Path) -> Any:
    parquet = need("pyarrow.parquet", "lerobot")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file of the data set")
    with contents(path, "a table of LeRobot in Parquet"):
        return parquet.read_table(path)


def _episode(root: Path, episode: int) -> dict[str, Any]:
    """The row of an episode in the tables of meta/episodes: where its rows and videos are."""
    files = sorted((root / "meta/episodes").rglob("*.parquet"))
    rows = [row for path in files for row in _table(path).to_pylist()]
    found = next((row for row in rows if row.get("episode_index") == episode), None)
    if found is None:
        known = f"the {len(rows)} episodes of {root}, 0..{len(rows) - 1}"
        raise ValueError(f"episode: expected one of {known}, got {episode}")
    return dict(found)


def _data_file(root: Path, info: Mapping[str, Any], where: Mapping[str, Any]) -> Path:
    chunk, number = where["data/chunk_index"], where["data/file_index"]
    return root / info["data_path"].format(chunk_index=chunk, file_index=number)


class LeRobotFrames:
    def __init__(
        self, root: Path, info: Mapping[str, Any], where: Mapping[str, Any], rows: Any, depth_key: str,
        color_key: str | None,
    ) -> None:  # fmt: skip
        self._times = [float(t) for t in rows["timestamp"].to_pylist()]
        self._images = [_images_of(root, info, where, rows, key) for key in (depth_key, color_key) if key]
        feature = info["features"][depth_key].get("info") or {}
        given = {name: feature.get(f"video.{name}", value) for name, value in DEFAULTS.items()}
        low, high, shift = (float(given[name]) for name in ("depth_min", "depth_max", "shift"))
        log = bool(given["use_log"])
        if not 0 <= low < high or (log and not low + shift > 0):
            expected = "expected depth_min below depth_max, in metres"
            raise ValueError(f"{depth_key}: {expected}, got {low:g} and {high:g}")
        a, b = (math.log(low + shift), math.log(high + shift)) if log else (low, high)
        value = a + np.arange(LAST_CODE + 1) * (b - a) / LAST_CODE
        table = np.exp(value) - shift if log else value
        table[[0, LAST_CODE]] = 0
        self._metres = table.astype(np.float32)
        step = (b - a) / LAST_CODE / math.sqrt(12)
        at_0, at_2 = (step * (z + shift) if log else step for z in (0.0, 2.0))
        video = isinstance(self._images[0], _Video)
        # As a sensor model has the noise: an sd at 0 m, and its growth with the square of the distance, exact at 2 m.
        self.quantization = (at_0, (at_2 - at_0) / 4) if video else None

    def __len__(self) -> int:
        return len(self._times)

    def first_shape(self) -> tuple[int, int]:
        height, width = self._depth(0).shape
        return height, width

    def __getitem__(self, i: int) -> Frame:
        try:
            color = None if len(self._images) == 1 else self._images[1].color(i, self._times[i])
            return Frame(self._depth(i), color, self._times[i], index=i, check_units=False)
        except (ValueError, TypeError, OSError) as error:
            return Frame.unreadable(f"frame {i}: {error}", self._times[i], i)

    def _depth(self, i: int) -> NDArray[np.float32]:
        image = self._images[0].depth(i, self._times[i])
        if isinstance(self._images[0], _Video):
            return np.asarray(self._metres[np.minimum(image, LAST_CODE)])
        scale = MILLIMETRES if image.dtype == np.uint16 else 1.0
        return image.astype(np.float32) * np.float32(scale)

    def close(self) -> None:
        for images in self._images:
            images.close()


def _images_of(root: Path, info: Mapping[str, Any], where: Mapping[str, Any], rows: Any, key: str) -> Any:
    if info["features"][key]["dtype"] != "video":
        return _Stored(root, rows[key].to_pylist())
    chunk, number = where[f"videos/{key}/chunk_index"], where[f"videos/{key}/file_index"]
    path = root / info["video_path"].format(video_key=key, chunk_index=chunk, file_index=number)
    return _Video(path, float(where[f"videos/{key}/from_timestamp"]), float(info["fps"]))


class _Stored:
    """Images in a column of the table, or in files that it names."""

    def __init__(self, root: Path, values: list[Any]) -> None:
        self._root, self._values = root, values

    def _content(self, i: int) -> bytes:
        value = self._values[i] or {}
        return value["bytes"] if value.get("bytes") else (self._root / str(value.get("path"))).read_bytes()

    def depth(self, i: int, _: float) -> NDArray[Any]:
        return decode_depth_units(self._content(i), f"image {i}")

    def color(self, i: int, _: float) -> NDArray[np.uint8]:
        return decode_color(self._content(i), f"image {i}")

    def close(self) -> None:
        pass


class _Video:
    """A video of several episodes; the next image without a search, any other from the key image before it."""

    def __init__(self, path: Path, start_s: float, fps: float) -> None:
        self._path, self._start_s, self._half_s = path, start_s, 0.5 / fps
        self._container: Any = None
        self._images: Any = iter(())
        self._last_s = math.inf

    def _at(self, time_s: float) -> Any:
        av: Any = need("av", "video")
        wanted = self._start_s + time_s
        try:
            if self._container is None:
                self._container = av.open(str(self._path))
            stream = self._container.streams.video[0]
            if not self._last_s < wanted <= self._last_s + 1:
                self._container.seek(max(0, int((wanted - self._half_s) / stream.time_base)), stream=stream)
                self._images = self._container.decode(stream)
            for image in self._images:
                self._last_s = float(image.pts * image.time_base)
                if self._last_s > wanted - self._half_s:
                    return image
        except av.FFmpegError as error:
            self.close()
            raise ValueError(f"{self._path}: cannot be decoded ({error.strerror})") from None
        self.close()
        raise ValueError(f"{self._path}: no image at {wanted:g} s")

    def depth(self, _: int, time_s: float) -> NDArray[np.uint16]:
        image = self._at(time_s)
        if "12" not in image.format.name:
            raise ValueError(f"{self._path}: expected depth in 12 bits, got {image.format.name}")
        return np.asarray(image.reformat(format="gray12le").to_ndarray())

    def color(self, _: int, time_s: float) -> NDArray[np.uint8]:
        return np.ascontiguousarray(self._at(time_s).to_ndarray(format="rgb24"))

    def close(self) -> None:
        if self._container is not None:
            self._container.close()
        self._container, self._last_s, self._images = None, math.inf, iter(())


def write_poses(
    dataset: str | os.PathLike[str],
    out: str | os.PathLike[str],
    trajectories: Mapping[int, Mapping[str, Any]],
) -> list[str]:
    """Copy a data set with the poses of tracked objects as features ``observation.pose.NAME``.

    Parameters
    ----------
    dataset, out : folders
        The data set, and a new folder. Videos are linked where the file system can.
    trajectories : {episode: {name: (poses, confidences)}}
        For each frame of an episode T_cam_obj (n, 4, 4), m, and the confidence (n,); NaN where the object is lost.

    Returns
    -------
    list of str
        The new features: x, y, z, qx, qy, qz, qw of T_cam_obj (m) and the confidence, float64, NaN where not known.
        ValueError if `out` exists, or the numbers of frames differ.
    """
    need("pyarrow", "lerobot")
    source, target = Path(dataset), Path(out)
    if target.exists():
        raise ValueError(f"out: expected a new folder, got {target}, which exists")
    info = read_json(source / INFO)
    names = list(dict.fromkeys(name for objects in trajectories.values() for name in objects))
    shutil.copytree(source, target, copy_function=_linked)
    try:
        _add(source, target, info, trajectories, names)
    except BaseException:
        shutil.rmtree(target)
        raise
    return [f"observation.pose.{name}" for name in names]


def _add(
    source: Path, target: Path, info: dict[str, Any], trajectories: Mapping[int, Mapping[str, Any]],
    names: list[str],
) -> None:  # fmt: skip
    import pyarrow as arrow
    from pyarrow import parquet

    stats = target / "meta/stats.json"
    known = read_json(stats) if stats.is_file() else {}
    values: dict[str, list[NDArray[np.float64]]] = {name: [] for name in names}
    for path in {_data_file(source, info, _episode(source, episode)) for episode in trajectories}:
        table = _table(path)
        episodes = np.array(table["episode_index"].to_pylist())
        for name in names:
            column = np.full((len(episodes), len(POSE)), np.nan)
            for episode, objects in trajectories.items():
                own = episodes == episode
                if name in objects and own.any():
                    column[own] = _column(name, objects[name], int(own.sum()))
            values[name].append(column)
            flat = arrow.FixedSizeListArray.from_arrays(arrow.array(column.ravel()), len(POSE))
            table = table.append_column(f"observation.pose.{name}", flat)
        meta = {k: v for k, v in (table.schema.metadata or {}).items() if k != b"huggingface"}
        new = target / path.relative_to(source)
        new.unlink()  # it may be a link to the original
        parquet.write_table(table.replace_schema_metadata(meta), new)
    for name in names:
        key = f"observation.pose.{name}"
        info["features"][key] = {"dtype": "float64", "shape": [len(POSE)], "names": list(POSE)}
        known[key] = _statistics(np.concatenate(values[name]))
    for path, content in ((target / INFO, info), (stats, known)):
        path.unlink(missing_ok=True)
        write_json(path, json.loads(json.dumps(content)))


def _linked(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def _column(name: str, given: Any, count: int) -> NDArray[np.float64]:
    T, c = (np.asarray(values, np.float64) for values in given)
    if T.shape != (count, 4, 4) or c.shape != (count,):
        expected = f"expected poses ({count}, 4, 4) and {count} confidences"
        raise ValueError(f"{name}: {expected}, got {T.shape}, {c.shape}")
    rows = np.full((count, len(POSE)), np.nan)
    for i in np.flatnonzero(np.isfinite(T).all(axis=(1, 2))):
        rows[i] = [*T[i, :3, 3], *quaternion(T[i, :3, :3]), c[i]]
    return rows


def _statistics(column: NDArray[np.float64]) -> dict[str, Any]:
    rows = column[np.isfinite(column).all(axis=1)]
    rows = rows if len(rows) else np.zeros((1, column.shape[1]))
    found = {"min": rows.min(0), "max": rows.max(0), "mean": rows.mean(0), "std": rows.std(0)}
    return {**{name: v.tolist() for name, v in found.items()}, "count": [len(rows)]}
