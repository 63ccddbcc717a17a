# SPDX-License-Identifier: MIT
"""Open3D and Redwood: one object, no lens; depth in millimetres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.files import replacing, write_json
from sdftrack.frame import Frame
from sdftrack.io.trajectories import log_lines
from sdftrack.io.writers.base import Contents, LayoutWriter

UNITS_PER_M = 1000
Array = NDArray[np.float64]


class Open3DWriter(LayoutWriter):
    """intrinsic.json, trajectory.log, depth/, color/ or color.mkv; frames without depth are omitted.

    File names are number-microseconds, as Redwood's, where the sequence has times.
    """

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
        write_json(
            self.folder / "intrinsic.json",
            {
                "width": camera.width,
                "height": camera.height,
                "intrinsic_matrix": camera.K.T.ravel().tolist(),  # column by column
                "depth_scale": float(UNITS_PER_M),
            },
        )
        any_pose = False
        with replacing(self.folder / "trajectory.log") as path, path.open("w") as file:
            for entry in entries:
                if entry["pose"]:
                    any_pose = True
                    print(entry["pose"], file=file)
        if not any_pose:
            (self.folder / "trajectory.log").unlink()
