# SPDX-License-Identifier: MIT
"""RealSense's .db3: tables of rosbag2 with compressed images, read by time; needs neither ROS nor the SDK."""

from __future__ import annotations

import sqlite3
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack.io.datasets.cdr import CdrReader
from sdftrack.io.datasets.realsense_stream import RealSenseStream
from sdftrack.io.datasets.streams import Stream
from sdftrack.io.frames import decode_color, decode_depth_units

__all__ = ["detect", "read_streams"]

MAGIC = b"SQLite format 3\0"
PREFIX = "/device_0/sensor_"


def detect(path: Path) -> bool:
    """Whether this is a database with RealSense's topics."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            return False
    try:
        database = _connect(path)
        try:
            like = f"{PREFIX}%"
            return database.execute("SELECT 1 FROM topics WHERE name LIKE ?", (like,)).fetchone() is not None
        finally:
            database.close()
    except sqlite3.Error:
        return False


def read_streams(path: Path) -> tuple[dict[str, RealSenseStream], float | None, Callable[[], None]]:
    """{"Depth": ..., "Color": ...}, metres per depth unit, and the function that closes the file."""
    database = _connect(path)
    try:
        topics = {
            name: (number, kind)
            for number, name, kind in database.execute("SELECT id, name, type FROM topics")
        }
        streams: dict[str, RealSenseStream] = {}
        for name in topics:
            sensor_and_stream, found, _ = name.rpartition("/image/data/")
            if not found or not name.startswith(PREFIX):
                continue
            short = sensor_and_stream.rpartition("/")[2].partition("_")[0]  # "Depth_0"
            if short in ("Depth", "Color") and short not in streams:
                reader = _Images(database, topics, sensor_and_stream, name)
                if short == "Depth" or reader.readable(path):
                    T = _pose(_text(database, topics, f"{sensor_and_stream}/tf/"))
                    streams[short] = RealSenseStream(
                        reader.stream, _lens(database, topics, sensor_and_stream), T
                    )
        units = _text(database, topics, PREFIX, "/option/Depth_Units/value")
        return streams, float(units) if units else None, database.close
    except (sqlite3.Error, ValueError, KeyError, IndexError) as error:
        database.close()
        raise ValueError(f"{path}: the recording cannot be read: {error}") from None


class _Images:
    """The compressed images of a topic and the timestamps of their metadata."""

    def __init__(self, database: Any, topics: dict[str, Any], stream: str, topic: str) -> None:
        self._database, self._depth = database, stream.rpartition("/")[2].startswith("Depth")
        rows = database.execute(
            "SELECT id, timestamp FROM messages WHERE topic_id = ? ORDER BY timestamp, id",
            (topics[topic][0],),
        ).fetchall()
        number = topics.get(f"{stream}/image/metadata", (-1,))[0]
        # Each image and its metadata are written with one time.
        known = {
            time: _pairs(CdrReader(data).string())
            for time, data in database.execute(
                "SELECT timestamp, data FROM messages WHERE topic_id = ?", (number,)
            )
        }
        stamps = np.array(
            [
                1e-3 * float(known[time]["timestamp"]) if "timestamp" in known.get(time, ()) else 1e-9 * time
                for _, time in rows
            ]
        )
        order = np.argsort(stamps, kind="stable")
        self._ids = [rows[i][0] for i in order]
        self.stream = Stream(stamps[order], self._read)

    def readable(self, path: Path) -> bool:
        """Whether the colour images have a format that can be decoded; a warning if not."""
        if not self._ids:
            return False
        kind, _ = self._message(0)
        if "png" in kind or "jp" in kind:
            return True
        warnings.warn(
            f"{path}: colour images of format {kind!r} are ignored; record colour as RGB8", stacklevel=5
        )
        return False

    def _message(self, i: int) -> tuple[str, bytes]:
        row = self._database.execute("SELECT data FROM messages WHERE id = ?", (self._ids[i],)).fetchone()
        if row is None:
            raise ValueError("the message is missing")
        message = CdrReader(row[0])
        message.uint32(), message.uint32(), message.string()  # header: seconds, nanoseconds, frame
        return message.string(), message.blob()

    def _read(self, i: int) -> NDArray[Any]:
        try:
            kind, data = self._message(i)
        except sqlite3.Error as error:
            raise ValueError(str(error)) from None
        if not self._depth:
            return decode_color(data, "the colour image")
        if "png" not in kind:
            raise ValueError(f"a depth image of format {kind!r}, expected a PNG of 16 bits")
        return decode_depth_units(data[max(0, data.find(b"\x89PNG")) :], "the depth image")


def _connect(path: Path) -> sqlite3.Connection:
    # Frames are read on the thread of a viewer or of a camera; StreamFrames locks.
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, check_same_thread=False)


def _text(database: Any, topics: dict[str, Any], prefix: str, suffix: str = "") -> str:
    """The first message, a string, of the first topic whose name begins and ends so; "" without one."""
    for name, (number, kind) in topics.items():
        if name.startswith(prefix) and name.endswith(suffix) and kind == "std_msgs/msg/String":
            row = database.execute(
                "SELECT data FROM messages WHERE topic_id = ? ORDER BY timestamp, id", (number,)
            ).fetchone()
            return CdrReader(row[0]).string() if row else ""
    return ""


def _pairs(text: str) -> dict[str, str]:
    """{"fps": "30", ...} of "encoding=Z16;fps=30"."""
    return {name: value for name, _, value in (part.partition("=") for part in text.split(";")) if name}


def _lens(database: Any, topics: dict[str, Any], stream: str) -> dict[str, Any]:
    values = _pairs(_text(database, topics, f"{stream}/camera_info"))
    if not values:
        raise ValueError(f"no intrinsics in {stream}/camera_info")
    numbers: dict[str, Any] = {name: float(values[name]) for name in ("fx", "fy", "ppx", "ppy")}
    return {
        **numbers,
        "width": int(values["width"]),
        "height": int(values["height"]),
        "model": values["model"],
        "coeffs": [float(c) for c in values["coeffs"].split(",")],
    }


def _pose(text: str) -> NDArray[np.float64]:
    """The SDK's extrinsics: rotation column by column, translation in metres, six digits each."""
    T = np.eye(4)
    values = _pairs(text)
    if values:
        T[:3, :3] = np.array(values["rotation"].split(","), dtype=float).reshape(3, 3).T
        T[:3, 3] = np.array(values["translation"].split(","), dtype=float)
    return T
