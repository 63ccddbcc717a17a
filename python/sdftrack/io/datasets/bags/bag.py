# SPDX-License-Identifier: MIT
"""A bag of one or more files: its topics, and their messages in the order of recording."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sdftrack._internal.closing import ClosedByWith
from sdftrack.io.datasets.bags.decoding import Decoder, stamp_ns
from sdftrack.io.datasets.bags.parts import Channel, Entries, Part


@dataclass(frozen=True)
class Topic:
    """A topic of a bag."""

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
        self._channels: dict[str, list[tuple[int, Channel, Entries]]] = {}
        for number, part in enumerate(parts):
            for n, channel in part.channels.items():
                found = part.index.get(n)
                if found is not None:
                    self._channels.setdefault(channel.topic, []).append((number, channel, found))
        self.topics = {
            name: Topic(name, listed[0][1].type, sum(len(found) for _, _, found in listed))
            for name, listed in sorted(self._channels.items())
        }

    @property
    def damage(self) -> str:
        """What the files lack, "" if nothing."""
        return "; ".join(f"{part.path.name}: {part.damage}" for part in self._parts if part.damage)

    def messages(self, topic: str) -> Messages:
        """The messages of a topic by the time of recording."""
        return Messages(self, self._channels[topic])

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

    def __init__(self, bag: Bag, listed: list[tuple[int, Channel, Entries]]) -> None:
        self._bag = bag
        self._listed = listed
        which = np.concatenate([np.full(len(found), n) for n, (_, _, found) in enumerate(listed)])
        entries = np.concatenate([found for _, _, found in listed])
        order = np.argsort(entries["time"], kind="stable")
        self._which, self._entries = which[order], entries[order]
        self._stamps: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self._entries)

    def recorded_ns(self) -> Any:
        """(n,) int64: when each message was recorded."""
        return self._entries["time"]

    def __getitem__(self, i: int) -> Any:
        """The decoded message; ValueError if it is not whole."""
        return self._bag.decode(self._channel(i), self._raw(i))

    def first(self, count: int) -> Iterator[Any]:
        """Those of the first `count` that are whole, decoded."""
        for i in range(min(count, len(self))):
            try:
                message = self[i]
            except ValueError:
                continue
            yield message

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
