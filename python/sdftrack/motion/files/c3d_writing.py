# SPDX-License-Identifier: MIT
"""Objects as rigid bodies of a C3D file, without markers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sdftrack._internal.extras import need
from sdftrack.motion.files.c3d_reading import EXTRA, START
from sdftrack.motion.files.grid import regular_rate_hz, shared_times
from sdftrack.motion.trajectory import Trajectory

__all__ = ["write_c3d"]

MAX_FRAMES = 65535  # ezc3d writes 16 bits and would leave out the rest
MAX_NAME = 127  # bytes
MAX_OBJECTS = 127


def write_c3d(path: Path, trajectories: Sequence[Trajectory]) -> None:
    """Matrices in metres, single precision; where an object was not measured, the residual is -1."""
    ezc3d = need(*EXTRA)
    times = shared_times(trajectories, ".c3d")
    rate = regular_rate_hz(times, ".c3d")
    if len(times) > MAX_FRAMES:
        raise ValueError(
            f"trajectories: a C3D file has at most {MAX_FRAMES} frames, got {len(times)}; save parts"
        )
    if len(trajectories) > MAX_OBJECTS:
        raise ValueError(
            f"trajectories: expected at most {MAX_OBJECTS} in a .c3d file, got {len(trajectories)}"
        )
    frames = list(dict.fromkeys(t.frame for t in trajectories))
    if len(frames) > 1:
        raise ValueError(
            f"trajectories: a C3D file has one reference frame, got {frames}; save one file each"
        )
    for name in [*frames, *(t.name for t in trajectories)]:
        if len(name.encode()) > MAX_NAME or name != name.strip() or not name:
            raise ValueError(
                f"{name!r}: a name in a C3D file has 1 to {MAX_NAME} bytes and no space at its ends; rename it"
            )
    file = ezc3d.c3d()
    matrices = np.array([np.where(t.usable[:, None, None], t.poses, np.nan) for t in trajectories])
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
    # No point and no channel, but a number of frames; ezc3d asks for a rate of the channels that are not there.
    file["parameters"]["ANALOG"]["RATE"]["value"] = [rate]
    file["data"]["points"] = np.zeros((4, 0, len(times)))
    file["data"]["analogs"] = np.zeros((1, 0, len(times)))
    # DATA_START, USED, RATE and RATIO of the group are written by ezc3d.
    file.add_parameter("ROTATION", "LABELS", [t.name for t in trajectories])
    file.add_parameter(*START, [repr(float(times[0]))])
    file.add_parameter("SDFTRACK", "FRAME", frames)
    file["data"]["rotations"] = matrices.transpose(2, 3, 0, 1)
    written = path.with_suffix(".c3d")  # ezc3d appends it to any other, also to .C3D
    file.write(str(written))
    written.replace(path)
