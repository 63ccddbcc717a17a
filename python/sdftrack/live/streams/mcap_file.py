# SPDX-License-Identifier: MIT
"""``mcap:FILE.mcap``: ROS 2 messages in a file for ``ros2 bag play``, Foxglove and the like."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar, NoReturn

from sdftrack.camera import Camera
from sdftrack.io.ros2 import McapOutput
from sdftrack.live.streams.messages import RosMessages
from sdftrack.live.streams.stream import Packet, Receiver, register_stream

# Bytes of messages that a crash may lose: about a second of one object at 30 Hz. Larger chunks compress better.
CHUNK = 1 << 14


class McapFile(Receiver):
    """Writes ``FILE.part.mcap``, which becomes ``FILE.mcap`` when the stream is closed. The part stays after a crash or
    on a full disk, and can be read up to its last chunk; a file with the final name is always complete."""

    waiting: ClassVar[int] = 1024  # frames: a file should lose none while a disk pauses

    def __init__(self, path: Path, overwrite: bool, names: Sequence[str], camera: Camera) -> None:
        self._messages = RosMessages(names, camera)
        self._path, self._part = path, path.with_suffix(".part.mcap")
        if path.suffix != ".mcap":
            raise ValueError(f"address: expected mcap:FILE.mcap, got 'mcap:{path}'")
        if not path.parent.is_dir():
            raise FileNotFoundError(f"{path}: the folder {path.parent} does not exist; make it first")
        for old in (path, self._part):
            if old.is_dir() or (old.exists() and not overwrite):
                how = "a file that exists" if old == path else "a part left by a run that was cut off"
                raise FileExistsError(
                    f"{old}: expected a new file, got {how}; move it or pass overwrite=True"
                )
        self.address = f"mcap:{path}"
        self._output = McapOutput(self._part, self._messages.definition, CHUNK)
        self._known_camera = False
        self._failed = ""

    def write(self, packet: Packet) -> None:
        if self._failed:
            raise OSError(self._failed)
        try:
            camera = [] if self._known_camera else [self._messages.of_camera(packet)]
            for message in (*camera, *self._messages.of_frame(packet)):
                # Played at the pace of the camera's clock, however fast the frames were tracked.
                self._output.add(*message, packet.time_ns, packet.index)
            self._known_camera = True
            self._output.mark_whole()
        except OSError as error:
            self._fail(error)
        self.sent += 1

    def close(self) -> None:
        if self._failed:
            self._output.close()
            raise OSError(self._failed)
        try:
            self._output.finish()
            os.replace(self._part, self._path)
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> NoReturn:
        self._failed = f"{self._path}: {error.strerror}; what was written before is in {self._part.name}"
        self._output.cut()
        raise OSError(self._failed) from error


@register_stream("mcap", "mcap:FILE.mcap")
def open_mcap(rest: str, names: Sequence[str], camera: Camera, *, overwrite: bool = False) -> McapFile:
    return McapFile(Path(rest), overwrite, names, camera)
