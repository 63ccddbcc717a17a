# SPDX-License-Identifier: MIT
"""The files of a bag behind one interface: channels, an index of messages, and their bytes by place."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import ClosedByWith

# Where a message is: its recording time (ns), its chunk (the position of the chunk's record in the file) and its
# offset there. Only these 24 bytes per message are kept in memory.
ENTRY = np.dtype([("time", np.int64), ("chunk", np.int64), ("offset", np.int64)])
NO_CHUNK = -1
KEPT_CHUNKS = 2  # depth and colour may come from different chunks
Entries = NDArray[Any]


@dataclass(frozen=True)
class Channel:
    """A topic in a file: its type ("sensor_msgs/msg/Image", "foxglove.RawImage") and how its messages are encoded
    ("ros1", "cdr", "protobuf", "json"); `schema` describes the encoding, where it needs that."""

    topic: str
    type: str
    encoding: str
    schema: Any = field(default=None, compare=False, repr=False)


class Part(ClosedByWith):
    """One file of a bag: its channels by number, the index of the messages of each, and what the file lacks, or ""."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.channels: dict[int, Channel] = {}
        self.index: dict[int, Entries] = {}
        self.damage = ""

    def read(self, chunk: int, offset: int, most: int | None = None) -> bytes:
        """The bytes of the message at this place; with `most`, at least its first `most` bytes if it has them.

        ValueError if the file does not hold them.
        """
        raise NotImplementedError


def entries(places: Sequence[tuple[int, int, int]]) -> Entries:
    """An index from (time, chunk, offset) of each message, by time."""
    found = np.array(places, dtype=ENTRY)
    return found[np.argsort(found["time"], kind="stable")]


class LastChunks:
    """The contents of the chunks used last, so that neighbouring messages do not decompress them again."""

    def __init__(self, load: Callable[[int], bytes]) -> None:
        self._load = load
        self._kept: OrderedDict[int, bytes] = OrderedDict()

    def __getitem__(self, position: int) -> bytes:
        if position in self._kept:
            self._kept.move_to_end(position)
        else:
            while len(self._kept) >= KEPT_CHUNKS:
                self._kept.popitem(last=False)
            self._kept[position] = self._load(position)
        return self._kept[position]

    def clear(self) -> None:
        self._kept.clear()
