# SPDX-License-Identifier: MIT
"""Recordings: ROS 1 and ROS 2 bags, Foxglove's mcap."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fuzz_datasets import contents, read, sequence
from fuzz_files import beside, file_case, folder_case
from fuzz_targets import Case, Target, any_of

import sdftrack as st

BAGS = ("rosbags", "mcap", "mcap_protobuf", "foxglove_schemas_protobuf", "lz4", "zstandard")
SMALL = st.Camera(16.0, 16.0, 7.5, 5.5, 16, 12)


def _bags(kinds: tuple[str, ...]) -> Callable[[Path], Case]:
    def make(folder: Path) -> Case:
        beside()
        import bag_writers

        cases = []
        for kind in kinds:
            sub = folder / kind
            sub.mkdir()
            made = bag_writers.write(sub, bag_writers.recording(sequence(SMALL, 2)), kind)
            if made.is_dir():
                cases.append(folder_case(sub, contents(made), read))
            else:
                (sub / "files").mkdir()
                cases.append(file_case(sub / "files", {made.name: made.read_bytes()}, read))
        return any_of(cases)

    return make


def _own_mcap(folder: Path) -> Case:
    st.save_sequence(folder / "source", sequence(SMALL, 2), layout="mcap")
    return folder_case(folder, contents(folder / "source"), read)


TARGETS = (
    Target("bag_ros1", _bags(("ros1", "ros1-lz4", "ros1-bz2")), weight=0.2, needs=BAGS),
    Target("bag_ros2", _bags(("db3", "db3-zstd")), weight=0.2, needs=BAGS),
    Target("bag_mcap", _bags(("ros2-mcap", "mcap-loose", "protobuf", "json")), weight=0.3, needs=BAGS),
    Target("folder_mcap", _own_mcap, weight=0.2, needs=BAGS),
)
