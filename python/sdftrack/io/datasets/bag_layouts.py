# SPDX-License-Identifier: MIT
"""Bags as sequences: the layouts ros1, ros2 (a file, or a folder with metadata.yaml) and mcap."""

from __future__ import annotations

import re
from pathlib import Path

from sdftrack.io.datasets.bags.bag import Bag
from sdftrack.io.datasets.bags.mcap_file import McapFile, profile
from sdftrack.io.datasets.bags.opening import sequence_of
from sdftrack.io.datasets.bags.parts import Part
from sdftrack.io.datasets.bags.rosbag1 import Rosbag1
from sdftrack.io.datasets.bags.sqlite_file import SqliteFile
from sdftrack.io.datasets.layouts import register
from sdftrack.io.datasets.sequence import Sequence

__all__ = ["is_recording", "open_mcap", "open_parts", "open_ros1", "open_ros2"]

TOPICS = ("depth_topic", "color_topic")
METADATA = "metadata.yaml"
MARK = "rosbag2_bagfile_information"


def _is_ros2(path: Path) -> bool:
    if path.is_dir():
        return is_recording(path)
    return path.suffix == ".db3" or (path.suffix == ".mcap" and profile(path) == "ros2")


@register("ros1", "a ROS 1 .bag file", lambda path: path.is_file() and path.suffix == ".bag", TOPICS)
def open_ros1(path: Path, depth_topic: str | None = None, color_topic: str | None = None) -> Sequence:
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: the file is empty")
    return sequence_of(Bag(path, [Rosbag1(path)]), "ros1", depth_topic, color_topic)


@register("ros2", "a ROS 2 folder with metadata.yaml, a .db3 or .mcap file", _is_ros2, TOPICS)
def open_ros2(path: Path, depth_topic: str | None = None, color_topic: str | None = None) -> Sequence:
    return sequence_of(Bag(path, open_parts(path)), "ros2", depth_topic, color_topic)


@register("mcap", "a Foxglove .mcap file", lambda path: path.is_file() and path.suffix == ".mcap", TOPICS)
def open_mcap(path: Path, depth_topic: str | None = None, color_topic: str | None = None) -> Sequence:
    return sequence_of(Bag(path, open_parts(path)), "mcap", depth_topic, color_topic)


def is_recording(folder: Path) -> bool:
    """By metadata.yaml, which an interrupted recording lacks; then by the names of its files, NAME_0, NAME_1, ..."""
    metadata = folder / METADATA
    if metadata.is_file():
        return MARK in metadata.read_text(encoding="utf-8", errors="replace")
    names = [p for p in folder.iterdir() if p.suffix in (".db3", ".mcap")] if folder.is_dir() else []
    return len(names) > 0 and {re.sub(r"_\d+$", "", p.stem) for p in names} == {folder.resolve().name}


def open_parts(path: Path) -> list[Part]:
    """The files of a recording, opened; ValueError if one is missing or of another kind."""
    if path.is_file():
        return [_open(path, "")]
    files, compression = _listed(path)
    parts: list[Part] = []
    try:
        for file in files:
            if not file.is_file():
                raise ValueError(f"{file}: the file is missing, but {METADATA} lists it")
            parts.append(_open(file, compression))
    except BaseException:
        for part in parts:
            part.close()
        raise
    return parts


def _listed(folder: Path) -> tuple[list[Path], str]:
    """Files in their order, and the compression of each message."""
    files = sorted((p for p in folder.iterdir() if p.suffix in (".db3", ".mcap")), key=_number)
    text = ""
    if (folder / METADATA).is_file():
        text = (folder / METADATA).read_text(encoding="utf-8", errors="replace")
        block = re.search(r"relative_file_paths:[ \t]*\n((?:\s*-\s*\S.*\n?)+)", text)
        if block:
            names = re.findall(r"-\s*[\"']?([^\"'\n]+?)[\"']?[ \t]*(?:\n|$)", block[1])
            files = [folder / Path(name).name for name in names]
    mode = (_value(text, "compression_mode") or "none").lower()
    if any(file.suffix == ".zstd" for file in files) or mode == "file":
        packed = [file for file in files if file.suffix == ".zstd" and not file.with_suffix("").is_file()]
        if packed:
            raise ValueError(
                f"{packed[0]}: the file is compressed as a whole, so its messages cannot be read one by one; "
                f"decompress it first: zstd -d {packed[0].name}"
            )
        files, mode = [f.with_suffix("") if f.suffix == ".zstd" else f for f in files], "none"
    if not files:
        raise ValueError(f"{folder}: expected .db3 or .mcap files in a ROS 2 recording, got none")
    return files, (_value(text, "compression_format") or "") if mode == "message" else ""


def _open(path: Path, compression: str) -> Part:
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: the file is empty")
    return McapFile(path) if path.suffix == ".mcap" else SqliteFile(path, compression)


def _number(path: Path) -> tuple[int, str]:
    found = re.search(r"_(\d+)$", path.stem)
    return (int(found[1]) if found else -1), path.name


def _value(text: str, name: str) -> str | None:
    found = re.search(rf"^\s*{name}:\s*[\"']?([\w]+)", text, re.MULTILINE)
    return found[1] if found else None
