# SPDX-License-Identifier: MIT
"""``foxglove://HOST:PORT``: ROS 2 messages for Foxglove's app while tracking runs."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from typing import Any

from sdftrack._internal.extras import need
from sdftrack._internal.hosts import bound_address, is_local, listen, shown_name
from sdftrack.camera import Camera
from sdftrack.live.streams.messages import RosMessages
from sdftrack.live.streams.stream import PORT, Packet, Receiver, host_and_port, register_stream

CLIENT_WAITING = 8  # frames for one client; the newest are kept
LEAST_BACKLOG = 64  # messages; a client that connects is told about topics through a queue of the same length
CAMERA_EVERY_S = 1.0  # clients come at any time, and nothing is kept for them
# For the last messages: the SDK does not say when they are out, and drops them when it is stopped.
CLOSE_S = 0.3
TRIES = 3  # the port that was free may be taken before the SDK listens
# The SDK logs clients that vanish as errors, which Python prints where nobody has set up logging.
logging.getLogger("foxglove").addHandler(logging.NullHandler())


class FoxgloveServer(Receiver):
    """A server of Foxglove's SDK, whose threads send to clients; a slow one loses its oldest messages. The SDK does not
    say what its clients received: a frame counts as sent if a client subscribes to one of the topics."""

    def __init__(self, host: str, port: int, names: Sequence[str], camera: Camera) -> None:
        need("foxglove.websocket", "foxglove")  # `foxglove` alone may be another distribution
        self._messages = RosMessages(names, camera)
        import foxglove

        self._context = foxglove.Context()  # other servers of the process have their own topics
        backlog = max(LEAST_BACKLOG, CLIENT_WAITING * (len(names) + 2))
        self._server = _started(host, port, self._context, backlog)
        self._channels: dict[str, Any] = {}
        for topic, kind in self._messages.topics():
            self._channel(topic, kind)
        self._camera_due = 0.0
        used = int(self._server.port)
        self.address = f"foxglove://{shown_name(host)}:{used}"
        notes = [] if port in (0, used) else [f"port {port} is in use, the stream is on port {used}"]
        notes.append(f"in Foxglove, open a connection to ws://{shown_name(host)}:{used}")
        self.note = "; ".join(
            notes + ([] if is_local(host) else ["everyone in the network can read the poses"])
        )

    @property
    def subscribed(self) -> bool:
        return any(channel.has_sinks() for channel in self._channels.values())

    def write(self, packet: Packet) -> None:
        if not self.subscribed:
            return
        messages = list(self._messages.of_frame(packet))
        if packet.sent >= self._camera_due:
            messages.insert(0, self._messages.of_camera(packet))
            self._camera_due = packet.sent + CAMERA_EVERY_S
        for topic, kind, data in messages:
            self._channel(topic, kind).log(data, log_time=packet.time_ns)
        self.sent += 1

    def close(self) -> None:
        if self.subscribed:
            time.sleep(CLOSE_S)
        self._server.stop()
        for channel in self._channels.values():
            channel.close()

    def _channel(self, topic: str, kind: str) -> Any:
        if topic not in self._channels:
            from foxglove import Channel, Schema

            text = self._messages.definition(kind).encode()
            schema = Schema(name=kind, encoding="ros2msg", data=text)
            self._channels[topic] = Channel(
                topic, schema=schema, message_encoding="cdr", context=self._context
            )
        return self._channels[topic]


def _started(host: str, port: int, context: Any, backlog: int) -> Any:
    import foxglove

    for _ in range(TRIES):
        with listen(
            host, port, f"foxglove://{host}:{port}"
        ) as free:  # finds the port, and says what is wrong with the host
            found = free.getsockname()[1]
        try:
            return foxglove.start_server(
                name="sdftrack", host=bound_address(host), port=found, context=context, message_backlog_size=backlog
            )  # fmt: skip
        except RuntimeError as error:
            failed = error
    raise OSError(f"foxglove://{host}:{port}: {failed}")


@register_stream("foxglove", "foxglove://HOST:PORT")
def open_foxglove(rest: str, names: Sequence[str], camera: Camera) -> FoxgloveServer:
    """Listen on HOST:PORT (default 127.0.0.1:8765), or the next port that is free."""
    host, port = host_and_port(rest if rest.strip("/") else "//127.0.0.1", "foxglove", PORT)
    return FoxgloveServer(host, port, names, camera)
