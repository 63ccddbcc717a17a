# SPDX-License-Identifier: MIT
"""metadata.yaml of a ROS 2 recording."""

from __future__ import annotations

from sdftrack.io.mcap_output import McapOutput

__all__ = ["metadata_yaml"]


def metadata_yaml(file: str, output: McapOutput) -> str:
    """The text for a recording of one file; version 5, which all releases since Humble read."""
    start, end = output.times_ns
    count = sum(n for _, n in output.counts.values())
    topics = "".join(
        f"""    - topic_metadata:
        name: {topic}
        type: {kind}
        serialization_format: cdr
        offered_qos_profiles: ""
      message_count: {n}
"""
        for topic, (kind, n) in output.counts.items()
    )
    return f"""rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  duration:
    nanoseconds: {end - start}
  starting_time:
    nanoseconds_since_epoch: {start}
  message_count: {count}
  topics_with_message_count:
{topics}  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - {file}
  files:
    - path: {file}
      starting_time:
        nanoseconds_since_epoch: {start}
      duration:
        nanoseconds: {end - start}
      message_count: {count}
"""
