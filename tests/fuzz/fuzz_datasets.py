# SPDX-License-Identifier: MIT
"""Folders of sequences in each layout, bags of ROS 1 and ROS 2, Foxglove's mcap, and result folders."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_files import beside, file_case, folder_case
from fuzz_readers import CAMERA, poses
from fuzz_targets import Case, Target, any_of

import sdftrack as st

BAGS = ("rosbags", "mcap", "mcap_protobuf", "foxglove_schemas_protobuf", "lz4", "zstandard")
SMALL = st.Camera(16.0, 16.0, 7.5, 5.5, 16, 12)
CUBE = st.SDF.box([0.1, 0.1, 0.1], voxels=9).to_mesh()


def sequence(camera: st.Camera = CAMERA, frames: int = 3) -> st.Sequence:
    rng = np.random.default_rng(0)
    made = []
    for i in range(frames):
        depth = rng.uniform(0.7, 0.9, camera.shape).astype(np.float32)
        color = rng.integers(0, 256, (*camera.shape, 3), np.uint8)
        made.append(st.Frame(depth, color, timestamp=10 + i / 30))
    return st.Sequence(made, camera, {i: {0: T} for i, T in enumerate(poses(frames))}, {5: CUBE})


def contents(folder: Path) -> dict[str, bytes]:
    return {
        p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()
    }


def read(root: Path) -> Any:
    """All that a command looks at."""
    with st.open_sequence(root) as seq:
        frames = [seq[i] for i in range(min(len(seq), 4))]
        for obj in set(seq.objects):
            seq.models.get(obj)
        return frames, seq.masks(0), seq.ground_truth, seq.symmetries


def _saved(layout: str, camera: st.Camera = CAMERA, frames: int = 3) -> Any:
    def make(folder: Path) -> Case:
        st.save_sequence(folder / "source", sequence(camera, frames), layout=layout)
        files = contents(folder / "source")
        if layout == "bop":
            info = {"5": {"diameter": 170, "symmetries_discrete": [np.diag([-1, -1, 1, 1]).ravel().tolist()],
                          "symmetries_continuous": [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]}}  # fmt: skip
            files["models/models_info.json"] = json.dumps(info).encode()
        return folder_case(folder, files, read)

    return make


def _k1(folder: Path) -> Case:
    beside()
    import test_datasets

    test_datasets.write_k1(folder / "source", (64, 48), mapping=True)
    return folder_case(folder, contents(folder / "source"), read)


def _results(folder: Path) -> Case:
    """report.json, read by `motion` and `evaluate`."""
    depth = st.SDF.sphere(0.05, voxels=12).render(CAMERA, poses(1)[0], 1)[0]
    frame = st.Frame(np.where(depth > 0, depth, 1.2).astype(np.float32), timestamp=0.1)
    tracker = st.Tracker(st.SDF.sphere(0.05, voxels=12), CAMERA, threads=1)
    with st.Recorder(folder / "source", CAMERA, video=False) as recorder:
        recorder.add(frame, tracker.start(frame, poses=poses(1)[0]))
        for i in range(1, 4):
            recorder.add(
                frame.replace(timestamp=0.1 + i / 30), tracker.track(frame.replace(timestamp=0.1 + i / 30))
            )
    files = {"report.json": (folder / "source" / "report.json").read_bytes()}
    return folder_case(folder, files, lambda root: st.motion.load(root))


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


LAYOUTS = ("bop", "tum", "open3d")
TARGETS = (
    *(Target(f"folder_{layout}", _saved(layout), weight=0.3) for layout in LAYOUTS),
    Target("folder_k1", _k1, weight=0.3),
    Target("folder_results", _results),
    Target("bag_ros1", _bags(("ros1", "ros1-lz4", "ros1-bz2")), weight=0.2, needs=BAGS),
    Target("bag_ros2", _bags(("db3", "db3-zstd")), weight=0.2, needs=BAGS),
    Target("bag_mcap", _bags(("ros2-mcap", "mcap-loose", "protobuf", "json")), weight=0.3, needs=BAGS),
    Target("folder_mcap", _saved("mcap", SMALL, 2), weight=0.2, needs=BAGS),
)
