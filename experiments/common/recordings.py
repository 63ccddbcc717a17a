# SPDX-License-Identifier: MIT
"""Recorded sequences with reference poses, each for choosing or for reporting, never for both."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

Part = Literal["choose", "report"]
VOXELS = 200


@dataclass(frozen=True)
class Recording:
    """One object of a recorded sequence; `instance` is its place among the sequence's objects."""

    folder: str
    name: str
    instance: int
    part: Part


RECORDINGS = (
    Recording("k1", "sponge, left", 0, "choose"),
    Recording("k1", "sponge, right", 1, "choose"),
    Recording("visp_rbt", "cube", 0, "choose"),
    Recording("ycbv10", "mug", 1, "choose"),
    Recording("visp_rbt", "dragon", 1, "report"),
    Recording("ycbv10", "gelatin box", 0, "report"),
    Recording("ycbv10", "foam brick", 2, "report"),
    Recording("mustard0", "bottle", 0, "report"),
)
FOLDERS = ("k1", "visp_rbt", "ycbv10", "mustard0")


@dataclass(frozen=True)
class Opened:
    """The sequence, the object's mesh and volume, and which of the sequence's objects it is."""

    seq: Any
    mesh: Any
    sdf: Any
    instance: int
    folder: Path

    def truth(self, i: int) -> Any:
        """T_cam_obj of the object in frame i, None where no reference is known."""
        return self.seq.ground_truth.get(i, {}).get(self.instance)

    def good_frames(self) -> set[int]:
        """Those of grade A where the recording grades its reference frame by frame, else all."""
        graded = self.folder / "frame_quality.json"
        if not graded.exists():
            return set(self.seq.ground_truth)
        return {int(i) for i, q in json.loads(graded.read_text()).items() if q["grade"] == "A"}

    def twins(self, i: int, still: dict[int, int]) -> list[tuple[int, int]]:
        """Frame and instance of the references in frame i of other objects of the same shape."""
        j, own = still.get(i, i), self.seq.objects[self.instance]
        others = [k for k, obj in enumerate(self.seq.objects) if obj == own and k != self.instance]
        return [(j, k) for k in others if k in self.seq.ground_truth.get(j, {})]


def recordings_of(part: Part) -> list[Recording]:
    """Those for choosing, or those for reporting."""
    return [r for r in RECORDINGS if r.part == part]


@contextmanager
def opened(recording: Recording, data: Path, voxels: int = VOXELS) -> Iterator[Opened]:
    """The recording with its shape."""
    import sdftrack as st

    with st.open_sequence(data / recording.folder) as seq:
        mesh = seq.models[seq.objects[recording.instance]]
        sdf = st.SDF.from_mesh(mesh, voxels=voxels, color=False)
        yield Opened(seq, mesh, sdf, recording.instance, data / recording.folder)
