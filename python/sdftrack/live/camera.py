# SPDX-License-Identifier: MIT
"""A running camera: a thread takes its frames, so that a slow program loses frames instead of falling behind; what a
driver has to offer, and the registration of drivers by name."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol

from sdftrack._internal.closing import ClosedByWith, closed_on_error
from sdftrack._internal.validation import whole
from sdftrack.camera import RGBDCamera
from sdftrack.frame import Frame

_DRIVERS = ("replay", "realsense", "webcam")  # modules of this package, each of which registers its cameras
RETRY_S = 0.5  # between attempts to connect again


def open_camera(address: str, **options: Any) -> LiveCamera:
    """Open a camera; close it by ``with`` or ``LiveCamera.close``.

    Parameters
    ----------
    address : str
        One of these, or a kind added by `register_camera`:

        * ``"realsense:"`` or ``"realsense:SERIAL"`` (extra ``realsense``): depth and colour as the sensors deliver
          them. Options: `preset` (name of a visual preset), ``align=True`` (colour resampled into the depth image by
          the SDK), ``color=False``, ``global_time=False`` (timestamps of the camera's own clock).
        * ``"webcam:"``, ``"webcam:N"`` or ``"webcam:/dev/videoN"``: colour alone. Option: `camera`, its intrinsics as a
          Camera or a file; without them 60 degrees of field of view are assumed, with a UserWarning.
        * ``"replay:PATH"``: plays a recorded sequence at its own rate. Options: `loop`, and those of its layout.
    **options
        ``waiting`` of :class:`LiveCamera`; ``width``, ``height`` and ``fps`` for all kinds; those of the kind.

    Returns
    -------
    LiveCamera
        An iterable of frames with ``.camera``.

    Raises
    ------
    ValueError
        Unknown kind of camera, or a profile that the camera does not have; the message lists those that it has.
    ImportError
        The kind needs an extra that is not installed.
    OSError
        No such camera, or another program uses it.

    Examples
    --------
    >>> with open_camera("replay:recording", fps=30) as live:  # doctest: +SKIP
    ...     tracker = st.Tracker(sdf, live.camera)
    ...     tracker.start(live.next())  # searches the whole image
    ...     for frame in live:
    ...         result = tracker.track(frame)
    """
    if not isinstance(address, str):
        raise TypeError(f"address: expected a text such as 'replay:PATH', got {type(address).__name__}")
    for driver in _DRIVERS:
        import_module(f"sdftrack.live.{driver}")
    name, _, rest = address.partition(":")
    if name not in CAMERAS:
        known = ", ".join(f'"{kind.name}:" ({kind.address})' for kind in CAMERAS.values())
        raise ValueError(f"address: expected one of {known}, got {address!r}")
    waiting = options.pop("waiting", 2)
    source = CAMERAS[name].open(rest, **options)
    with closed_on_error(source):
        return LiveCamera(source, waiting=waiting)


class LiveCamera(ClosedByWith):
    """The frames of a running camera; a program that is too slow for all of them loses the oldest.

    Iteration returns frames in the order in which they were taken. At most `waiting` frames wait; when another one
    comes, the oldest is dropped and counted. While the camera is disconnected, iteration returns frames without
    images whose `error` says so, which a tracker reports as bad frames, and the connection is tried again.

    Parameters
    ----------
    source : FrameSource
        The device; it is closed with this object.
    waiting : int
        Number of frames that may wait, at least 1. More lose fewer frames when the program pauses, and are older when
        they are used.

    Attributes
    ----------
    camera : RGBDCamera
    name : str
    taken, dropped : int
        Number of frames so far, those without images included, and of those that the program never saw, since it
        first asked for one.
    """

    def __init__(self, source: FrameSource, waiting: int = 2) -> None:
        whole(waiting, "waiting", 1, what="a number of frames, at least 1")
        self.camera: RGBDCamera = source.camera
        self.name = source.name
        self.taken = self.dropped = 0
        self._source, self._waiting = source, waiting
        self._clock = CameraClock()
        self._frames: deque[Frame] = deque()
        self._changed = threading.Condition()
        self._asked = self._ended = self._closed = self._disconnected = False
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._take_all, name=f"camera {source.name}", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.next()) is not None:
            yield frame

    def next(self, timeout_s: float | None = None) -> Frame | None:
        """The oldest frame that waits, or the next one; None once the stream has ended or after `timeout_s`."""
        with self._changed:
            self._asked = True
            self._changed.wait_for(lambda: self._frames or self._ended, timeout_s)
            if self._frames:
                return self._frames.popleft()
            if self._error is not None and not self._closed:
                raise self._error
            return None

    def latest(self, timeout_s: float | None = None) -> Frame | None:
        """The newest frame; older ones that wait are dropped and counted. Otherwise as :meth:`next`."""
        with self._changed:
            while len(self._frames) > 1:
                self._frames.popleft()
                self.dropped += 1
        return self.next(timeout_s)

    def age_s(self, frame: Frame) -> float:
        """Seconds since the camera took `frame`; NaN without a timestamp. A camera with a clock of its own is compared
        with the frame that was delivered fastest: its age at arrival counts as zero."""
        return self._clock.age_s(frame.timestamp, time.time())

    def resume(self) -> None:
        """Let a recording that was held at its first frame play on; nothing for a camera."""
        resume = getattr(self._source, "resume", None)
        if resume is not None:
            resume()

    def close(self) -> None:
        """Stop the camera and release it; a second call does nothing."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._changed.notify_all()
        self._thread.join(timeout=10)
        self._source.close()

    def __repr__(self) -> str:
        return f"LiveCamera({self.name!r}, {self.taken} frames, {self.dropped} dropped)"

    def _take_all(self) -> None:
        try:
            while not self._closed:
                frame = self._read()
                if frame is None:
                    break
                self._offer(frame)
        except BaseException as error:  # raised again where the frames are asked for
            self._error = error
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def _read(self) -> Frame | None:
        try:
            if self._disconnected:
                self._source.reopen()
                self._disconnected = False
            return self._source.read()
        except CameraLost as lost:
            if self._disconnected:
                with self._changed:
                    self._changed.wait_for(lambda: self._closed, RETRY_S)
            self._disconnected = True
            return Frame.unreadable(f"{self.name}: {lost}")

    def _offer(self, frame: Frame) -> None:
        with self._changed:
            self.taken += 1
            if frame.timestamp is not None and not frame.error:
                self._clock.arrived(frame.timestamp, time.time())
            if len(self._frames) == self._waiting:
                self._frames.popleft()
                self.dropped += self._asked
            self._frames.append(frame.replace(index=self.taken - 1))
            self._changed.notify_all()


SAME_CLOCK_S = 1.0  # a camera whose stamps are this near the time of arrival uses the computer's clock
FORGET = 1e-4  # a second per second: clocks drift apart by less


class CameraClock:
    """Estimates by how much the camera's clock differs from the computer's: the least difference on arrival. A camera
    whose stamps are the computer's time (RealSense with global time) has no difference."""

    def __init__(self) -> None:
        self._difference_s: float | None = None
        self._last = 0.0

    def arrived(self, stamp_s: float, now_s: float) -> None:
        """A frame taken at `stamp_s` of the camera's clock arrived at `now_s` of the computer's."""
        seen = now_s - stamp_s
        if 0 <= seen < SAME_CLOCK_S:
            self._difference_s = 0.0
        elif self._difference_s is None or now_s < self._last:
            self._difference_s = seen
        else:
            # Forgets slowly, so that two clocks that drift apart do not make every later frame look old.
            self._difference_s = min(seen, self._difference_s + FORGET * (now_s - self._last))
        self._last = now_s

    def age_s(self, stamp_s: float | None, now_s: float) -> float:
        """Age of a frame (s); NaN without a stamp, or before the first frame arrived."""
        if stamp_s is None or self._difference_s is None:
            return math.nan
        return now_s - stamp_s - self._difference_s


class CameraLost(OSError):
    """The camera stopped delivering frames: unplugged, or its driver failed. It may come back."""


class FrameSource(Protocol):
    """A device that delivers frames, one after the other.

    Attributes
    ----------
    camera : RGBDCamera
        Depth camera and, if colour is streamed, the mapping to the colour image.
    name : str
        For messages: "RealSense D435 (serial 0123)".
    """

    camera: RGBDCamera
    name: str

    def read(self) -> Frame | None:
        """Wait for the next frame; its timestamp is the camera's, in seconds. None: the stream has ended. Raises
        `CameraLost` if no frame arrives within a time that is long for this device."""

    def reopen(self) -> None:
        """Connect again after `CameraLost`; raises `CameraLost` while the camera is not there."""

    def close(self) -> None:
        """Release the device; a second call does nothing."""


@dataclass(frozen=True)
class CameraKind:
    name: str
    address: str
    open: Callable[..., FrameSource]


CAMERAS: dict[str, CameraKind] = {}
"""The kinds of cameras by name; filled when a camera is opened."""


def register_camera(name: str, address: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator that makes `function(address, **options) -> FrameSource` the driver of cameras called `name`. `address`
    says in a few words what may follow the colon, for messages: "serial number"."""

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        CAMERAS[name] = CameraKind(name, address, function)
        return function

    return add
