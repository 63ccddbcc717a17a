# SPDX-License-Identifier: MIT
"""What the receiving end of a stream has to offer, and the registration of kinds of streams by their scheme."""

from __future__ import annotations

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
