# SPDX-License-Identifier: MIT
"""What the receiving end of a stream has to offer, and kinds of streams by scheme, with their hosts and names."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from sdftrack.results import TrackResult


@dataclass(frozen=True)
class Packet:
    """One frame's result on its way: seconds of the camera's clock, and since 1970 when it was passed on.

    `index` is the number of the frame: its own, else that of the result. `motion`: running values of the movements.
    """

    index: int
    timestamp: float | None
    sent: float
    result: TrackResult
    motion: Sequence[Mapping[str, Any]] | None = None

    @property
    def time_ns(self) -> int:
        """Time of the frame, of sending if it has none, in whole nanoseconds, at least 0."""
        seconds = self.sent if self.timestamp is None else self.timestamp
        return max(0, round(1e9 * seconds))


class Receiver:
    """The end of a stream. Its methods are called by the stream's thread only, never by the tracking program.

    Attributes
    ----------
    waiting : int
        Default number of frames that may wait for this kind of receiver.
    address : str
        Where the messages really go: with the port in use and the name of the file.
    note : str
        One line that the user should see, or "".
    sent, dropped : int
        Number of messages delivered and lost so far, not counting those whose `write` failed.
    """

    waiting: ClassVar[int] = 8
    address: str = ""
    note: str = ""
    sent: int = 0
    dropped: int = 0

    def write(self, packet: Packet) -> None:
        """Deliver one frame. An exception means that it is lost; the stream goes on with the next frame."""
        raise NotImplementedError

    def close(self) -> None:
        """Release sockets and files; an OSError says what could not be finished."""


@dataclass(frozen=True)
class StreamKind:
    """A kind of stream: the scheme before the colon, the form of its addresses, and the function that opens it."""

    scheme: str
    address: str
    open: Callable[..., Receiver]


STREAMS: dict[str, StreamKind] = {}


def register_stream(scheme: str, address: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator that makes `function(rest, names, camera, **options) -> Receiver` the opener of a scheme.

    `rest` is what follows the first colon of an address; `address` shows its form, for messages: "ws://HOST:PORT".
    """

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        STREAMS[scheme] = StreamKind(scheme, address, function)
        return function

    return add


PORT = 8765  # of websocket servers, unless the address says another

_FORM = re.compile(r"//(?P<host>\[[0-9A-Fa-f:.]+\]|[^\s:/?#\[\]@]*)(?::(?P<port>\d*))?/?")


def host_and_port(rest: str, scheme: str, port: int | None = None) -> tuple[str, int]:
    """Host and port of ``//HOST:PORT``; IPv6 in brackets. `port` is that of an address without one."""
    whole = f"{scheme}:{rest}"
    found = _FORM.fullmatch(rest)
    if found is None or not found["host"]:
        raise ValueError(f"address: expected {scheme}://HOST:PORT, got {whole!r}")
    if found["port"]:
        port = int(found["port"])
    if port is None:
        raise ValueError(f"address: expected {scheme}://HOST:PORT, got {whole!r} without a port")
    if port > 65535:
        raise ValueError(f"address: expected a port of at most 65535, got {port} in {whole!r}")
    return found["host"].strip("[]"), port


def safe_names(names: Sequence[str]) -> list[str]:
    """Names of letters, digits and underscores, each once, none beginning with a digit."""
    out: list[str] = []
    for k, name in enumerate(names):
        safe = re.sub(r"[^A-Za-z0-9_]", "_", name) or f"object_{k}"
        safe = f"_{safe}" if safe[0].isdigit() else safe
        # Double underscores are not allowed in ROS topics.
        safe = first = re.sub(r"__+", "_", safe)
        count = 1
        while safe in out:
            count += 1
            safe = f"{first}_{count}"
        out.append(safe)
    return out
