# SPDX-License-Identifier: MIT
"""A file .mcap with ROS 2 messages that stays readable up to its last chunk, whatever happens."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sdftrack._internal.extras import need
from sdftrack._internal.files import UnbufferedFile
from sdftrack._internal.text_files import reason_of

LATCHED = """- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""


class McapOutput:
    """Writes messages in chunks of `chunk_size` bytes, which a crash may lose; larger ones compress better.

    `definition` gives the definition of a message type.
    """

    def __init__(self, path: Path, definition: Callable[[str], str], chunk_size: int) -> None:
        need("mcap", "bags")
        from mcap.writer import Writer

        self._definition = definition
        output: Any = UnbufferedFile(path)
        self._file, self._writer = output, Writer(output, chunk_size=chunk_size)
        self._writer.start(profile="ros2", library="sdftrack")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self.counts: dict[str, tuple[str, int]] = {}  # topic -> type, number of messages
        self.times_ns = (0, 0)  # of the first and the last message
        self._whole = self._file.tell()

    def add(
        self, topic: str, kind: str, data: bytes, time_ns: int, sequence: int = 0, *, latched: bool = False
    ) -> None:
        """Add a serialised message; `latched`: for those who come later, as /tf_static."""
        if topic not in self._channels:
            if kind not in self._schemas:
                text = self._definition(kind).encode()
                self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", text)
            qos = LATCHED if latched else ""
            metadata = {"offered_qos_profiles": qos}
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind], metadata)
        self._writer.add_message(
            self._channels[topic], time_ns, data, publish_time=time_ns, sequence=sequence % 2**32
        )
        first, last = self.times_ns if self.counts else (time_ns, time_ns)
        self.times_ns = (min(first, time_ns), max(last, time_ns))
        self.counts[topic] = (kind, self.counts.get(topic, (kind, 0))[1] + 1)

    def attach(self, name: str, data: bytes, media_type: str) -> None:
        self._writer.add_attachment(0, 0, name, media_type, data)

    def flush(self) -> None:
        """End the chunk: what was added is in the file."""
        self._writer.flush()

    def mark_whole(self) -> None:
        """What is in the file now is whole."""
        self._whole = self._file.tell()

    def cut(self) -> None:
        """Take away what was written since `mark_whole`."""
        self._file.truncate(self._whole)

    def finish(self) -> None:
        """Write the summary and close the file."""
        self._writer.finish()
        self._file.close()

    def close(self) -> None:
        """Close the file without a summary."""
        self._file.close()


def copy_whole(path: Path, output: McapOutput, last_topic: str, count: int) -> None:
    """Copy messages in the order of the file up to the `count`-th one on `last_topic`.

    ValueError if the file holds fewer.
    """
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader

    found = 0
    with path.open("rb") as file:
        messages: Any = NonSeekingReader(file).iter_messages(log_time_order=False)
        try:
            while found < count:
                schema, channel, m = next(messages)
                latched = bool(channel.metadata.get("offered_qos_profiles"))
                output.add(channel.topic, schema.name, m.data, m.log_time, m.sequence, latched=latched)
                found += channel.topic == last_topic
        except (McapError, EOFError, StopIteration, ValueError, KeyError, struct.error) as error:
            raise ValueError(
                f"{path}: expected {count} whole frames, got {found} ({reason_of(error)})"
            ) from None
