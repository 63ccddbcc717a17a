# SPDX-License-Identifier: MIT
"""A stream of results: the program hands a result over in microseconds, a thread delivers it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

from sdftrack._internal.closing import ClosedByWith, closed_on_error
from sdftrack._internal.validation import of_kind, whole
from sdftrack.camera import Camera, RGBDCamera, depth_camera
from sdftrack.frame import Frame
from sdftrack.live.streams.kinds import STREAMS, Packet, Receiver
from sdftrack.results import TrackResult

_KINDS = (
    "websocket",
    "osc",
    "mcap_file",
    "foxglove_server",
)  # modules of this package, each of which registers its scheme
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
