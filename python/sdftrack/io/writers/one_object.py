# SPDX-License-Identifier: MIT
"""Layouts of one object: TUM RGB-D (times, a lens; 5000 units per metre), Open3D and Redwood (no lens; millimetres)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.files import write_json, write_text
from sdftrack.frame import Frame
from sdftrack.io.report_file import TUM_HEADER, log_lines, tum_line
from sdftrack.io.writers.base import FRAME_PERIOD_S, Contents, LayoutWriter

Array = NDArray[np.float64]


class TumWriter(LayoutWriter):
    """depth.txt, rgb.txt, groundtruth.txt, camera.json, depth/, rgb/ or color.mkv; frames without depth are omitted."""

    name = "tum"
    folders = ("depth", "rgb")
    units = ((5000,), ())

    @classmethod
    def check_contents(cls, contents: Contents) -> None:
        cls.check_one_object(contents)

    def write_frame(
        self, frame: Frame, poses: dict[int, Array], masks: Mapping[int, NDArray[np.bool_]], im_id: int
    ) -> dict[str, Any]:
        last = self.journal.last["last"] if self.journal.last else None
        if frame.depth is None:
            return {"time": None, "last": last}
        self.check_own_camera(frame)
        time, number = frame.timestamp, self.count
        if time is None:
            time = number * FRAME_PERIOD_S
            if last is not None and time <= float(last):  # a frame with a time came before
                time = float(last) + FRAME_PERIOD_S
        stamp = f"{time:.6f}"
        if last is not None and float(stamp) <= float(last):  # files are named by it, and poses found by it
            raise ValueError(
                f"timestamp: expected times that increase by 1 us or more in the tum layout, got {stamp} s for frame "
                f"{number} after {last} s; sort the frames, or use bop"
            )
        depth, rgb = (self.folder / name / f"{stamp}.png" for name in ("depth", "rgb"))
        color = self.write_images(frame, depth, rgb, number)[1]
        if color:  # the line in rgb.txt
            color = f"rgb/{color}" if self._video is None else f"{color} {number}"
        T = next(iter(poses.values()), None)
        pose = None if T is None else tum_line(float(stamp), geometry.inverse(T))
        return {"time": stamp, "last": stamp, "color": color, "pose": pose}

    def write_index(self, entries: Iterable[dict[str, Any]]) -> None:
        head = "# timestamp filename"
        files: dict[str, list[str]] = {"depth": [head], "rgb": [head], "groundtruth": [TUM_HEADER]}
        for entry in entries:
            time = entry["time"]
            color = entry["color"] and f"{time} {entry['color']}" if time else None
            lines = (time and f"{time} depth/{time}.png", color, entry["pose"] if time else None)
            for known, line in zip(files.values(), lines, strict=True):
                known += [line] if line else []
        for name, known in files.items():
            if len(known) > 1 or name != "groundtruth":
                write_text(self.folder / f"{name}.txt", "\n".join(known) + "\n")
        self.contents.camera.depth.save(self.folder / "camera.json")


UNITS_PER_M = 1000


class Open3DWriter(LayoutWriter):
    """intrinsic.json, trajectory.log, depth/, color/ or color.mkv; frames without depth are omitted. File names are
    number-microseconds, as Redwood's, where the sequence has times."""

    name = "open3d"
    folders = ("depth", "color")
    units = ((UNITS_PER_M,), ())

    @classmethod
    def check_contents(cls, contents: Contents) -> None:
        cls.check_no_lens(contents.camera.depth)
        cls.check_one_object(contents)

    def write_frame(
        self, frame: Frame, poses: dict[int, Array], masks: Mapping[int, NDArray[np.bool_]], im_id: int
    ) -> dict[str, Any]:
        number = self.journal.last["next"] if self.journal.last else 0
        if frame.depth is None:
            return {"next": number, "pose": None}
        self.check_own_camera(frame)
        time = "" if frame.timestamp is None else f"-{round(1e6 * frame.timestamp):013d}"
        file = f"{number:06d}{time}.png"
        self.write_images(frame, self.folder / "depth" / file, self.folder / "color" / file, number)
        T = next(iter(poses.values()), None)
        return {
            "next": number + 1,
            "pose": None if T is None else "\n".join(log_lines(number, geometry.inverse(T))),
        }

    def write_index(self, entries: Iterable[dict[str, Any]]) -> None:
        camera = self.contents.camera.depth
        about = {
            "width": camera.width, "height": camera.height,
            "intrinsic_matrix": camera.K.T.ravel().tolist(),  # column by column
            "depth_scale": float(UNITS_PER_M),
        }  # fmt: skip
        write_json(self.folder / "intrinsic.json", about)
        poses = [entry["pose"] for entry in entries if entry["pose"]]
        if poses:
            write_text(self.folder / "trajectory.log", "\n".join(poses) + "\n")
