# SPDX-License-Identifier: MIT
"""``osc://HOST:PORT``: OSC messages by UDP, one bundle per frame, for TouchDesigner, Max, Unity and the like."""

from __future__ import annotations

import socket
from collections.abc import Sequence

import numpy as np

from sdftrack._internal.extras import need
from sdftrack.camera import Camera
from sdftrack.live.streams.messages import name_of, position_and_quaternion
from sdftrack.live.streams.stream import Packet, Receiver, host_and_port, register_stream, safe_names
from sdftrack.results import TrackResult


class OscReceiver(Receiver):
    """Sends ``/sdftrack/NAME/pose``, ``/status`` and ``/confidence`` of every object, numbers as 32-bit floats. The
    socket is connected, so that the operating system reports a receiver on this computer that is not there."""

    def __init__(self, host: str, port: int, names: Sequence[str]) -> None:
        need("pythonosc", "stream")
        self._names = safe_names(names)
        try:
            family, _, _, _, target = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except socket.gaierror as error:
            raise OSError(
                f"osc://{host}:{port}: the host is not known ({error.strerror}); check its name"
            ) from None
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._socket.setblocking(False)
        self._socket.connect(target)
        self.address = f"osc://{host}:{port}"

    def write(self, packet: Packet) -> None:
        data = self._bundle(packet.result)
        try:
            self._socket.send(data)
        except OSError as error:
            raise OSError(f"{self.address}: {error.strerror}") from error
        self.sent += 1

    def close(self) -> None:
        self._socket.close()

    def _bundle(self, result: TrackResult) -> bytes:
        from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
        from pythonosc.osc_message_builder import OscMessageBuilder

        # A time in the bundle would make receivers wait whose clock differs from this one.
        bundle = OscBundleBuilder(IMMEDIATELY)

        def add(address: str, values: Sequence[float | str], kind: str) -> None:
            message = OscMessageBuilder(address)
            for value in values:
                message.add_arg(value, kind)
            bundle.add_content(message.build())

        for k, T in enumerate(result.poses):
            start = f"/sdftrack/{name_of(self._names, k)}"
            if np.isfinite(T).all():
                position, rotation = position_and_quaternion(T)
                add(f"{start}/pose", [*position, *rotation], "f")
            add(f"{start}/status", [str(result.status[k])], "s")
            add(f"{start}/confidence", [float(result.confidence[k])], "f")
        return bytes(bundle.build().dgram)


@register_stream("osc", "osc://HOST:PORT")
def open_osc(rest: str, names: Sequence[str], camera: Camera) -> OscReceiver:
    host, port = host_and_port(rest, "osc")
    if port == 0:
        raise ValueError(f"address: expected a port from 1 to 65535, got 0 in 'osc:{rest}'")
    return OscReceiver(host, port, names)
