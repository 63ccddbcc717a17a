# SPDX-License-Identifier: MIT
"""Copies the whole messages of an .mcap file that was cut."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sdftrack.io.mcap_output import McapOutput

__all__ = ["copy_whole"]


def copy_whole(path: Path, output: McapOutput, last_topic: str, count: int) -> None:
    """Copy messages in the order of the file up to the `count`-th one on `last_topic`.

    ValueError if the file holds fewer.
    """
    from mcap.exceptions import McapError
    from mcap.records import Channel, Message, Schema
    from mcap.stream_reader import StreamReader

    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    found = 0
    with path.open("rb") as file:
        try:
            for record in StreamReader(file).records:
                if found == count:
                    return
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    output.add(
                        channel.topic,
                        schemas[channel.schema_id].name,
                        record.data,
                        record.log_time,
                        record.sequence,
                        latched=bool(channel.metadata.get("offered_qos_profiles")),
                    )
                    found += channel.topic == last_topic
        except (McapError, EOFError, ValueError, KeyError) as error:
            if found < count:
                raise ValueError(f"{path}: expected {count} whole frames, got {found} ({error})") from None
    if found < count:
        raise ValueError(f"{path}: expected {count} whole frames, got {found}")
