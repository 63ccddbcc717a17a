# SPDX-License-Identifier: MIT
"""Frames from the messages of a bag: depth with the colour image nearest in time, read on access."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import RGBDCamera
from sdftrack.frame import Frame
from sdftrack.io.datasets.bags.bag import Bag, Messages
from sdftrack.io.datasets.bags.pictures import color_of, depth_of
from sdftrack.io.frames import Expected

LOOKED_AT = 10  # frames at the beginning
DEFAULT_PERIOD_NS = 10**9 // 30


class BagFrames:
    """Frames of a bag; those that cannot be read are returned as `Frame.unreadable` with the reason.

    `depth` and `color` are topics, `color` "" for none; `use_color` is false if colour images do not fit the camera.
    """

    def __init__(self, bag: Bag, depth: str, color: str, camera: RGBDCamera, use_color: bool) -> None:
        self._bag, self._camera = bag, camera
        self._depth_topic, self._color_topic = depth, color
        self._depth = bag.messages(depth)
        self._color = bag.messages(color) if color else None
        self._use_color = use_color
        self._any_size = False
        self._most_apart_ns = period_ns(self._depth) / 2
        self._lag = 0  # of colour after depth in the order of recording, messages

    def __len__(self) -> int:
        return len(self._depth)

    def __getitem__(self, i: int) -> Frame:
        timestamp = None
        if self._bag.closed:
            raise ValueError(f"{self._bag.path}: the sequence is closed; open it again to read its frames")
        try:
            stamp = self._depth.stamp_ns(i)
            timestamp = 1e-9 * stamp
            depth, scale = self._depth_image(i)
            color = self._color_image(i, stamp)
            return Frame(depth, color, timestamp, depth_scale=scale, index=i, check_units=False)
        except (ValueError, TypeError) as error:
            return Frame.unreadable(str(error), timestamp, i)

    def take_color_of_any_size(self) -> None:
        """Also read colour images without a mapping to depth, for estimating that mapping."""
        self._use_color = self._any_size = True

    def _depth_image(self, i: int) -> tuple[NDArray[np.uint16] | NDArray[np.float32], float | None]:
        name = f"{self._depth_topic}, message {i}"
        depth, scale = depth_of(self._depth[i], name)
        Expected("the camera", self._camera.depth.shape).check(depth.shape, name)
        return depth, scale

    def _color_image(self, i: int, stamp: int) -> NDArray[np.uint8] | None:
        if self._color is None or not self._use_color:
            return None
        j = self._nearest(self._color, i, stamp)
        if j is None:
            return None
        name = f"{self._color_topic}, message {j}"
        color = color_of(self._color[j], name)
        if not self._any_size:
            Expected("its camera", (self._camera.color or self._camera.depth).shape).check(color.shape, name)
        return color

    def _nearest(self, color: Messages, i: int, stamp: int) -> int | None:
        """The colour image nearest in time, or None beyond half a frame.

        Times in the headers are those of the exposure, but reading them all would read the whole file: the search
        begins at the time of recording and goes on as long as the gap shrinks.
        """

        def gap(k: int) -> int:
            try:
                return abs(color.stamp_ns(k) - stamp)
            except ValueError:  # not whole
                return 1 << 62

        begin = int(np.searchsorted(color.recorded_ns(), self._depth.recorded_ns()[i]))
        j = min(max(begin + self._lag, 0), len(color) - 1)
        best = gap(j)
        for step in (-1, 1):
            missed = 0
            k = j + step
            while 0 <= k < len(color) and missed < 2:  # over one message that is out of order
                if gap(k) < best:
                    j, best, missed = k, gap(k), 0
                else:
                    missed += 1
                k += step
        self._lag = j - begin
        return j if best <= self._most_apart_ns else None


def period_ns(messages: Messages) -> float:
    """Time between images, by the headers of the first ones."""
    stamps = []
    for i in range(min(LOOKED_AT, len(messages))):
        try:
            stamps.append(messages.stamp_ns(i))
        except ValueError:
            continue
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else DEFAULT_PERIOD_NS
