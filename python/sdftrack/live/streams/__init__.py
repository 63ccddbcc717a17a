# SPDX-License-Identifier: MIT
"""Poses for other programs while tracking runs: over a network, or into a file that other tools read."""

from sdftrack.live.streams.stream import STREAMS, Packet, Receiver, Stream, open_stream, register_stream

__all__ = ["STREAMS", "Packet", "Receiver", "Stream", "open_stream", "register_stream"]
