# SPDX-License-Identifier: MIT
"""A stream of results: the program hands a result over in microseconds, a thread delivers it to a receiver, of which
there are several kinds."""

from __future__ import annotations

import re
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, ClassVar

from sdftrack._internal.closing import ClosedByWith, closed_on_error
from sdftrack._internal.validation import of_kind, whole
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.results import TrackResult

# Modules of this package, each of which registers its scheme.
_KINDS = ("websocket", "osc", "mcap_file", "foxglove_server")
CLOSE_S = 10.0  # for what still waits when the stream is closed


def open_stream(address: str, names: Sequence[str], camera: Camera | RGBDCamera, **options: Any) -> Stream:
    """Open a stream for results; close it by ``with`` or :meth:`Stream.close`.

    Parameters
    ----------
    address : str
        ``"ws://HOST:PORT"``: a websocket server, JSON; ``"osc://HOST:PORT"``: OSC messages to that address by UDP;
        ``"mcap:FILE.mcap"``: ROS 2 messages into a file; ``"foxglove://HOST:PORT"``: a server for Foxglove's app; or a
        scheme added by `register_stream`.
    names : sequence of str
        Names of the objects in the order of the results.
    camera : Camera or RGBDCamera
        The camera of the depth images, in whose frame poses are.
    **options
        ``waiting`` of :class:`Stream`, and those of the scheme: ``overwrite=True`` for a file that exists.

    Raises
    ------
    ValueError
        Unknown scheme (the message lists those that are known), no host, a port outside 0..65535, an address of
        another form.
    ImportError
        The scheme needs an extra that is not installed.
    OSError
        The host is not known, no port is free, the folder of the file is missing, or the file exists.

    Examples
    --------
    >>> with open_stream("ws://localhost:8765", tracker.names, camera) as stream:  # doctest: +SKIP
    ...     for frame in live:
    ...         stream.send(frame, tracker.track(frame))
    """
    if not isinstance(address, str):
        raise TypeError(
            f"address: expected a text such as 'ws://localhost:8765', got {type(address).__name__}"
        )
    if isinstance(names, str):
        raise TypeError(f"names: expected a list with a name for each object, got the text {names!r}")
    for kind in _KINDS:
        import_module(f"sdftrack.live.streams.{kind}")
    scheme, colon, rest = address.partition(":")
    if scheme not in STREAMS or not colon:
        known = ", ".join(f'"{kind.address}"' for kind in STREAMS.values())
        raise ValueError(f"address: expected one of {known}, got {address!r}")
    waiting = options.pop("waiting", None)
    receiver = STREAMS[scheme].open(rest, [str(name) for name in names], depth_camera(camera), **options)
    with closed_on_error(receiver):
        return Stream(receiver, waiting)


class Stream(ClosedByWith):
    """Delivers results to a receiver on a thread of its own; a slow receiver loses frames and holds up nobody.

    Parameters
    ----------
    receiver : Receiver
        Where messages go; it is closed with this object.
    waiting : int, optional
        Number of frames that may wait for the thread, at least 1; when another one comes, the oldest is dropped and
        counted. Default: by the kind of receiver, 8 for a network and 1024 for a file.

    Attributes
    ----------
    address : str
        Where messages really go: a websocket server may have had to take another port.
    note : str
        One line for the user, or "": another port than asked for, the address with its token.
    """

    def __init__(self, receiver: Receiver, waiting: int | None = None) -> None:
        self.address, self.note = receiver.address, receiver.note
        self._receiver = receiver
        limit = receiver.waiting if waiting is None else waiting
        self._limit = whole(limit, "waiting", 1, what="a number of frames, at least 1")
        self._packets: deque[Packet] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._dropped = 0
        self._error = ""
        self._thread = threading.Thread(target=self._deliver, name=f"stream {self.address}", daemon=True)
        self._thread.start()

    @property
    def sent(self) -> int:
        """Number of messages delivered so far, one for each frame and receiver."""
        return self._receiver.sent

    @property
    def dropped(self) -> int:
        """Number of messages lost so far: those that a slow or dead receiver did not take in time."""
        return self._dropped + self._receiver.dropped

    @property
    def error(self) -> str:
        """ "", or one line about the last message that could not be delivered."""
        return self._error

    def send(
        self, frame: Frame, result: TrackResult, motion: Sequence[Mapping[str, Any]] | None = None
    ) -> None:
        """Pass a result on; returns at once.

        Parameters
        ----------
        frame : Frame
            Its index and timestamp are sent, not its images.
        result : TrackResult
        motion : list of dict, optional
            Running values per object, :meth:`LiveValues.to_dict`; sent by ``ws://``.

        Raises
        ------
        TypeError
            Not a Frame and a TrackResult.
        ValueError
            The stream is closed. What happens to receivers raises nothing: see `dropped` and `error`.
        """
        of_kind(frame, Frame, "frame")
        of_kind(result, TrackResult, "result")
        index = result.index if frame.index is None else frame.index
        packet = Packet(index, frame.timestamp, time.time(), result, motion)
        with self._changed:
            if self._closed:
                raise ValueError("send: expected an open stream, got one that was closed; open another")
            if len(self._packets) == self._limit:
                self._packets.popleft()
                self._dropped += 1
            self._packets.append(packet)
            self._changed.notify()

    def close(self) -> None:
        """Deliver what waits, then release sockets and files; a second call does nothing."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=CLOSE_S)

    def __repr__(self) -> str:
        return f"Stream({self.address!r}, {self.sent} sent, {self.dropped} dropped)"

    def _deliver(self) -> None:
        while (packet := self._next()) is not None:
            try:
                self._receiver.write(packet)
            except Exception as error:  # tracking goes on whatever happens here
                with self._changed:
                    self._dropped += 1
                self._error = _line(error)
        try:
            self._receiver.close()
        except Exception as error:
            self._error = _line(error)

    def _next(self) -> Packet | None:
        with self._changed:
            self._changed.wait_for(lambda: self._packets or self._closed)
            return self._packets.popleft() if self._packets else None


def _line(error: Exception) -> str:
    return str(error) if isinstance(error, OSError) else f"{type(error).__name__}: {error}"


@dataclass(frozen=True)
class Packet:
    """One frame's result on its way: seconds of the camera's clock, and since 1970 when it was passed on. `index` is
    the number of the frame: its own, else that of the result. `motion`: running values of the movements."""

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
    scheme: str
    address: str
    open: Callable[..., Receiver]


STREAMS: dict[str, StreamKind] = {}


def register_stream(scheme: str, address: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator that makes `function(rest, names, camera, **options) -> Receiver` the opener of a scheme. `rest` is
    what follows the first colon of an address; `address` shows its form, for messages: "ws://HOST:PORT"."""

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
