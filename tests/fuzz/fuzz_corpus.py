# SPDX-License-Identifier: MIT
"""Files that once failed: ``corpus/READER/NAME``, each read again by every run of the tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import sdftrack as st
from sdftrack.io import frames, trajectories

__all__ = ["CORPUS", "READERS"]

CORPUS = Path(__file__).resolve().parent / "corpus"


def _sequence(path: Path) -> Any:
    with st.open_sequence(path) as seq:
        return [seq[i] for i in range(min(len(seq), 3))]


READERS: dict[str, Callable[[Path], Any]] = {
    "camera": st.Camera.load,
    "color": frames.read_color,
    "depth": frames.read_depth_units,
    "log": trajectories.read_log,
    "mesh": st.Mesh.load,
    "motion": st.motion.load,
    "options": st.TrackerOptions.from_file,
    "sdf": st.SDF.load,
    "sequence": _sequence,
    "tum": trajectories.read_tum,
}
