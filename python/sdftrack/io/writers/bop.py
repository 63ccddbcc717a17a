# SPDX-License-Identifier: MIT
"""BOP scenes: every pose, mask and model, any unit of depth."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.files import write_text
from sdftrack.frame import Frame
from sdftrack.io.frames import write_mask
from sdftrack.io.writers.base import Contents, LayoutWriter

MM_PER_M = 1000.0
Array = NDArray[np.float64]


class BopWriter(LayoutWriter):
    """scene_camera.json, scene_gt.json, depth/, rgb/ or color.mkv, mask_visib/, models/. Times are stored as
    ``timestamp`` (s) of each image in scene_camera.json, and the number of an instance as ``instance`` in scene_gt.json
    where several share an obj_id, neither of which BOP itself defines."""

    name = "bop"
    folders = ("depth", "rgb", "mask_visib", "models")
    units = ((10_000, 1000), (5000, 4000, 8000, 2000))

    @classmethod
    def check_contents(cls, contents: Contents) -> None:
        cls.check_no_lens(contents.camera.depth)

    def write_models(self) -> None:
        for obj_id, mesh in self.contents.models.items():
            type(mesh)(MM_PER_M * np.asarray(mesh.vertices), mesh.faces, mesh.colors).save(
                self.folder / "models" / f"obj_{obj_id:06d}.ply"
            )

    def write_frame(
        self, frame: Frame, poses: dict[int, Array], masks: Mapping[int, NDArray[np.bool_]], im_id: int
    ) -> dict[str, Any]:
        camera = self.camera_of(frame)
        self.check_no_lens(camera)
        self._check_number(im_id)
        file, mm = f"{im_id:06d}.png", 0.1
        color = self.folder / "rgb" / file
        if frame.depth is not None:
            mm = MM_PER_M / self.write_images(frame, self.folder / "depth" / file, color, im_id)[0]
        else:
            self.write_color(frame, color, im_id)
        for place, k in enumerate(poses):
            if k in masks:
                write_mask(self.folder / "mask_visib" / f"{im_id:06d}_{place:06d}.png", masks[k])
        objects = self.contents.objects
        look_alikes = len(set(objects)) < len(objects)
        known_time = {} if frame.timestamp is None else {"timestamp": frame.timestamp}
        return {
            "im_id": im_id,
            "camera": {"cam_K": camera.K.ravel().tolist(), "depth_scale": mm, **known_time},
            "gt": [
                {
                    "obj_id": objects[k],
                    "cam_R_m2c": T[:3, :3].ravel().tolist(),
                    "cam_t_m2c": (MM_PER_M * T[:3, 3]).tolist(),
                    **({"instance": k} if look_alikes else {}),
                }
                for k, T in poses.items()
            ],
        }

    def _check_number(self, im_id: int) -> None:
        """Files are named by it, and frames ordered: a second image of a number would replace the first."""
        last = self.journal.last["im_id"] if self.journal.last else -1
        if im_id <= last:
            raise ValueError(
                f"im_id: expected numbers from 0 on that increase, got {im_id} for frame {self.count}"
                + (f" after {last}" if last >= 0 else "")
            )

    def write_index(self, entries: Iterable[dict[str, Any]]) -> None:
        listed = [*entries]
        for key, name in (("camera", "scene_camera.json"), ("gt", "scene_gt.json")):
            rows = (f'\n  "{entry["im_id"]}": {json.dumps(entry[key], allow_nan=False)}' for entry in listed)
            if key == "camera" or any(entry["gt"] for entry in listed):
                write_text(self.folder / name, "{" + ",".join(rows) + ("\n}\n" if listed else "}\n"))
