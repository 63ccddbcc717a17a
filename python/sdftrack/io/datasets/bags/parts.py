# SPDX-License-Identifier: MIT
"""The files of a bag behind one interface: channels, an index of messages, and their bytes by place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import ClosedByWith

__all__ = ["ENTRY", "Channel", "Part", "entries"]

# Where a message is: its recording time (ns), its chunk (the position of the chunk's record in the file, or -1) and its
# offset there. Only these 24 bytes per message are kept in memory.
ENTRY = np.dtype([("time", np.int64), ("chunk", np.int64), ("offset", np.int64)])
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
    """One file of a bag.

    Attributes
    ----------
    channels : {number: Channel}
    index : {number: (n,) ENTRY array}
        The messages of each channel.
    damage : str
        "", or what the file lacks.
    """

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
    """An index from (time, chunk, offset) of each message."""
    return np.array(places, dtype=ENTRY)
