# SPDX-License-Identifier: MIT
"""A bag of one or more files: its topics, and their messages in the order of recording, by place in a file."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.closing import ClosedByWith
from sdftrack.io.datasets.bags.decoding import Decoder, stamp_ns


@dataclass(frozen=True)
class Topic:
    name: str
    type: str
    count: int

    def __str__(self) -> str:
        return f"{self.name} ({self.type}, {self.count})"


class Bag(ClosedByWith):
    """The files of a recording as one; messages are read by one thread at a time."""

    def __init__(self, path: Path, parts: list[Part]) -> None:
        self.path, self._parts = path, parts
        self._lock = threading.Lock()
        self.decode = Decoder()
        self.closed = False
        self.channels: dict[str, list[tuple[int, Channel, Entries]]] = {}
        for number, part in enumerate(parts):
            for n, channel in part.channels.items():
                found = part.index.get(n)
                if found is not None:
                    self.channels.setdefault(channel.topic, []).append((number, channel, found))
        self.topics = {
            name: Topic(name, listed[0][1].type, sum(len(found) for _, _, found in listed))
            for name, listed in sorted(self.channels.items())
        }

    @property
    def damage(self) -> str:
        return "; ".join(f"{part.path.name}: {part.damage}" for part in self._parts if part.damage)

    def messages(self, topic: str) -> Messages:
        return Messages(self, topic)

    def raw(self, part: int, chunk: int, offset: int, most: int | None) -> bytes:
        with self._lock:
            if self.closed:
                raise ValueError(f"{self.path}: the sequence is closed; open it again to read its frames")
            return self._parts[part].read(chunk, offset, most)

    def close(self) -> None:
        with self._lock:
            self.closed = True
            for part in self._parts:
                part.close()


class Messages:
    """The messages of one topic, read on access in any order."""

    def __init__(self, bag: Bag, topic: str) -> None:
        self._bag, self._listed = bag, bag.channels[topic]
        which = np.concatenate([np.full(len(found), n) for n, (_, _, found) in enumerate(self._listed)])
        entries = np.concatenate([found for _, _, found in self._listed])
        order = np.argsort(entries["time"], kind="stable")
        self._which, self._entries = which[order], entries[order]
        self._stamps: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def recorded_ns(self) -> Any:
        return self._entries["time"]

    def __getitem__(self, i: int) -> Any:
        return self._bag.decode(self._channel(i), self._raw(i))

    def first(self, count: int) -> Iterator[Any]:
        """Those of the first `count` that are whole, decoded."""
        for i in range(min(count, len(self))):
            with contextlib.suppress(ValueError):
                yield self[i]

    def stamp_ns(self, i: int) -> int:
        """The time in the header of a message; that of recording where the header has none."""
        if i not in self._stamps:
            stamp = stamp_ns(self._channel(i), lambda most: self._raw(i, most))
            if stamp is None:
                stamp = self._bag.decode(self._channel(i), self._raw(i)).stamp_ns
            self._stamps[i] = stamp or int(self._entries["time"][i])
        return self._stamps[i]

    def _channel(self, i: int) -> Channel:
        return self._listed[self._which[i]][1]

    def _raw(self, i: int, most: int | None = None) -> bytes:
        entry = self._entries[i]
        return self._bag.raw(self._listed[self._which[i]][0], int(entry["chunk"]), int(entry["offset"]), most)


# Where a message is: its recording time (ns), its chunk (the position of the chunk's record in the file) and its
# offset there. Only these 24 bytes per message are kept in memory.
ENTRY = np.dtype([("time", np.int64), ("chunk", np.int64), ("offset", np.int64)])
NO_CHUNK = -1
KEPT_CHUNKS = 2  # in memory: depth and colour may come from different ones
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
        """The message at this place, or at least its first `most` bytes; ValueError if the file does not hold them."""
        raise NotImplementedError


def entries(places: Sequence[tuple[int, int, int]]) -> Entries:
    found = np.array(places, dtype=ENTRY)
    return found[np.argsort(found["time"], kind="stable")]
