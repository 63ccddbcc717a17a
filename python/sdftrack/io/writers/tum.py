# SPDX-License-Identifier: MIT
"""TUM RGB-D: one object, times, a lens; 5000 units per metre."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.files import replacing
from sdftrack.frame import Frame
from sdftrack.io.trajectories import TUM_HEADER, tum_line
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
        if frame.depth is None:
            return {"time": None, "last": self.journal.last["last"] if self.journal.last else None}
        self.check_own_camera(frame)
        last = self.journal.last["last"] if self.journal.last else None
        time = frame.timestamp
        if time is None:
            time = self.count * FRAME_PERIOD_S
            if last is not None and time <= float(last):  # a frame with a time came before
                time = float(last) + FRAME_PERIOD_S
        stamp = f"{time:.6f}"
        if last is not None and float(stamp) <= float(last):  # files are named by it, and poses found by it
            raise ValueError(
                f"timestamp: expected times that increase by 1 us or more in the tum layout, got {stamp} s for frame "
                f"{self.count} after {last} s; sort the frames, or use bop"
            )
        depth = self.folder / "depth" / f"{stamp}.png"
        number = self.count
        color = self.write_images(frame, depth, self.folder / "rgb" / f"{stamp}.png", number)[1]
        if color and self._video is not None:
            color = f"{color} {number}"  # the line in rgb.txt
        elif color:
            color = f"rgb/{color}"
        T = next(iter(poses.values()), None)
        return {
            "time": stamp,
            "last": stamp,
            "color": color,
            "pose": None if T is None else tum_line(float(stamp), geometry.inverse(T)),
        }

    def write_index(self, entries: Iterable[dict[str, Any]]) -> None:
        depth, color, truth = (self.folder / f"{name}.txt" for name in ("depth", "rgb", "groundtruth"))
        any_pose = False
        with (
            replacing(depth) as a,
            replacing(color) as b,
            replacing(truth) as c,
            a.open("w", encoding="utf-8") as depth_list,
            b.open("w", encoding="utf-8") as color_list,
            c.open("w", encoding="utf-8") as poses,
        ):
            print("# timestamp filename", file=depth_list)
            print("# timestamp filename", file=color_list)
            print(TUM_HEADER, file=poses)
            for entry in entries:
                if entry["time"] is None:
                    continue
                print(f"{entry['time']} depth/{entry['time']}.png", file=depth_list)
                if entry["color"]:
                    print(f"{entry['time']} {entry['color']}", file=color_list)
                if entry["pose"]:
                    any_pose = True
                    print(entry["pose"], file=poses)
        if not any_pose:
            truth.unlink()
        self.contents.camera.depth.save(self.folder / "camera.json")
