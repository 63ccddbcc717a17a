# SPDX-License-Identifier: MIT
"""A ROS 2 recording (MCAP): both cameras, any depth, poses and models."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack import geometry
from sdftrack._internal.files import write_text
from sdftrack.camera import RGBDCamera
from sdftrack.frame import Frame
from sdftrack.io.ros2 import COLOR_FRAME, DEPTH_FRAME, INFO, McapOutput, RosTypes, copy_whole
from sdftrack.io.writers.base import FRAME_PERIOD_S, Contents, LayoutWriter

FILE = "sequence.mcap"
DEPTH, DEPTH_INFO = "/camera/depth/image_raw", "/camera/depth/camera_info"
COLOR, COLOR_INFO = "/camera/color/image_raw/compressed", "/camera/color/camera_info"
TRUTH = "/ground_truth"  # the reader knows it: sdftrack.io.datasets.bags.topics
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
CHUNK = 1 << 22
Array = NDArray[np.float64]


class McapWriter(LayoutWriter):
    """sequence.mcap and metadata.yaml, which ``ros2 bag play FOLDER`` takes; frames without depth are omitted. Depth is
    16UC1 in millimetres where that is exact, else 32FC1 in metres; colour is a PNG or JPEG of each image. Colour of a
    camera whose pose is not known has a frame of its own that nothing connects with that of depth. True poses are
    transforms on `/ground_truth` to the frames `object_K_OBJID`; models are attachments."""

    name = "mcap"
    folders = ()
    units = ((1000,), ())
    holds_video = False

    def __init__(self, folder: Path, contents: Contents, color: str = "png", resume: bool = False) -> None:
        self._ros = RosTypes()
        self._output: McapOutput | None = None
        self._cut: McapOutput | None = None
        super().__init__(folder, contents, color, resume)
        if resume:
            self._continue()

    @classmethod
    def lost_of_color(cls, camera: RGBDCamera) -> str:
        if camera.aligned or camera.T_color_depth is not None:
            return ""
        return (
            "the mapping to colour is omitted: the mcap layout holds the pose of the colour camera, not a projective "
            "mapping; colour images are stored without it"
        )

    def write_models(self) -> None:
        self._output = self._begin(self.folder / FILE)

    def _begin(self, path: Path) -> McapOutput:
        output = McapOutput(path, self._ros.definition, CHUNK)
        for obj_id, mesh in self.contents.models.items():
            file = self.folder / f".obj_{obj_id:06d}.ply"
            mesh.save(file)
            output.attach(f"models/obj_{obj_id:06d}.ply", file.read_bytes(), "model/ply")
            file.unlink()
        output.mark_whole()
        return output

    def _continue(self) -> None:
        """Copy the frames that are whole; the file that was cut cannot be appended to."""
        old, new = self.folder / FILE, self.folder / f".{FILE}"
        output = self._begin(new)
        copy_whole(old, output, DEPTH, self.count)
        output.flush()
        output.mark_whole()
        os.replace(new, old)
        self._output = output

    def write_frame(
        self, frame: Frame, poses: dict[int, Array], masks: Mapping[int, NDArray[np.bool_]], im_id: int
    ) -> dict[str, Any]:
        if frame.depth is None:
            return {"written": False}
        self.check_own_camera(frame)
        assert self._output is not None
        time_s = self.count * FRAME_PERIOD_S if frame.timestamp is None else frame.timestamp
        try:
            self._write(self._output, frame, poses, round(1e9 * time_s))
            self._output.flush()
            self._output.mark_whole()
        except BaseException:  # a full disk, or Ctrl-C
            self._output.cut()
            self._output.close()
            self._cut, self._output = self._output, None
            raise
        return {"written": True}

    def _write(self, output: McapOutput, frame: Frame, poses: dict[int, Array], time_ns: int) -> None:
        """Depth comes last: a frame whose depth is in the file is whole."""
        import cv2

        ros, camera, n = self._ros, self.contents.camera, self.count
        header = ros.header(time_ns, DEPTH_FRAME)
        if not n and camera.T_color_depth is not None:
            T_depth_color = geometry.inverse(camera.T_color_depth)
            fixed = [ros.transform(header, COLOR_FRAME, T_depth_color)]
            data = ros.serialized(TRANSFORMS, transforms=fixed)
            output.add("/tf_static", TRANSFORMS, data, time_ns, latched=True)
        if poses:
            objects = self.contents.objects
            known = [ros.transform(header, f"object_{k}_{objects[k]}", T) for k, T in poses.items()]
            output.add(TRUTH, TRANSFORMS, ros.serialized(TRANSFORMS, transforms=known), time_ns, n)
        if frame.color is not None:
            own = header if camera.aligned else ros.header(time_ns, COLOR_FRAME)
            lens = camera.color or (None if self.lost_of_color(camera) else camera.depth)
            if lens is not None:  # a projective mapping needs none
                output.add(COLOR_INFO, INFO, ros.camera_info(own, lens), time_ns, n)
            ok, image = cv2.imencode(self._suffix, np.ascontiguousarray(frame.color[..., ::-1]))
            assert ok
            kind = "jpeg" if self._suffix == ".jpg" else "png"
            data = ros.serialized(COMPRESSED, header=own, format=kind, data=image.reshape(-1))
            output.add(COLOR, COMPRESSED, data, time_ns, n)
        output.add(DEPTH_INFO, INFO, ros.camera_info(header, camera.depth), time_ns, n)
        output.add(DEPTH, IMAGE, self._depth(frame, header), time_ns, n)

    def _depth(self, frame: Frame, header: Any) -> bytes:
        assert frame.depth is not None
        found = self._units.exact(frame)
        pixels: NDArray[Any] = frame.depth if found is None else found[0]
        return self._ros.serialized(
            IMAGE, header=header, height=pixels.shape[0], width=pixels.shape[1],
            encoding="16UC1" if pixels.dtype == np.uint16 else "32FC1", is_bigendian=0,
            step=pixels.strides[0], data=np.ascontiguousarray(pixels).view(np.uint8).reshape(-1),
        )  # fmt: skip

    def write_index(self, entries: Iterable[dict[str, Any]]) -> None:
        if self._output is not None:
            self._output.finish()
        written = self._output or self._cut  # one that was cut is readable up to the last whole frame
        assert written is not None
        write_text(self.folder / "metadata.yaml", metadata_yaml(FILE, written))
        self._output = None

    def close(self) -> None:
        super().close()
        if self._output is not None:
            self._output.close()
            self._output = None


def metadata_yaml(file: str, output: McapOutput) -> str:
    start, end = output.times_ns
    count = sum(n for _, n in output.counts.values())
    topics = "".join(
        f"""    - topic_metadata:
        name: {topic}
        type: {kind}
        serialization_format: cdr
        offered_qos_profiles: ""
      message_count: {n}
"""
        for topic, (kind, n) in output.counts.items()
    )
    return f"""rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  duration:
    nanoseconds: {end - start}
  starting_time:
    nanoseconds_since_epoch: {start}
  message_count: {count}
  topics_with_message_count:
{topics}  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - {file}
  files:
    - path: {file}
      starting_time:
        nanoseconds_since_epoch: {start}
      duration:
        nanoseconds: {end - start}
      message_count: {count}
"""
