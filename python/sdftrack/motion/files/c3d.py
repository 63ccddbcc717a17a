# SPDX-License-Identifier: MIT
"""Rigid bodies of C3D files, read and written: the group ROTATION, a 4 x 4 matrix per body and frame."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack.motion.files.table import Record, gaps_as_lost, matrices_as_poses, regular_rate_hz, shared_times
from sdftrack.motion.trajectory import Trajectory

EXTRA = ("ezc3d", "motion")
# Time of the first frame, as text: a C3D file counts frames, and its numbers are of single precision.
START = ("SDFTRACK", "START_S")


MAX_FRAMES = 65535  # ezc3d writes 16 bits and would leave out the rest
MAX_NAME = 127  # bytes
MAX_OBJECTS = 127
READ_S, READ_S_PER_BYTE = 10.0, 1e-6  # a file that is whole takes a tenth of that
KEY = 0x50  # second byte of a file


def read_c3d(path: Path, fps: float | None, unit: str | None) -> tuple[list[Record], str]:
    """One record per rigid body, and the unit of their lengths."""
    need(*EXTRA)
    with path.open("rb") as file:
        if file.read(2)[1:] != bytes([KEY]):
            raise ValueError(f"{path}: expected a C3D file, but it does not begin as one")
    matrices, measured, rest = _read_by_child(path)
    if not matrices.size:
        raise ValueError(
            f"{path}: expected rigid bodies (the group ROTATION), got {rest['markers']} markers and none; export rigid "
            "bodies (segments) from the program that recorded them"
        )
    matrices = np.where(measured[..., None, None], matrices, np.nan)
    labels = [*rest["labels"], *[""] * len(matrices)][: len(matrices)]
    times = _times(rest, path, matrices.shape[1], fps)
    records = []
    for k, stack in enumerate(matrices):
        label = labels[k] or f"body_{k + 1}"
        poses = matrices_as_poses(stack, lambda i, label=label: f"{path}, {label}, frame {i}")  # type: ignore[misc]
        records.append(Record(label, times, poses, gaps_as_lost(poses), frame=rest["frame"] or "laboratory"))
    return records, _unit(rest["unit"].lower(), path, unit)


def _read_by_child(path: Path) -> tuple[NDArray[np.float64], NDArray[np.bool_], dict[str, Any]]:
    """What ``c3d_child.py`` reads, in a process of its own: damaged files end ezc3d, or hold it up for ever."""
    limit_s = READ_S + READ_S_PER_BYTE * path.stat().st_size
    with tempfile.TemporaryDirectory(prefix="sdftrack-c3d-") as folder:
        out = Path(folder) / "out.npz"
        # -P: the folder of this file is not searched for modules.
        command = [sys.executable, "-P", str(Path(__file__).with_name("c3d_child.py")), str(path), str(out)]
        try:
            ended = subprocess.run(command, capture_output=True, timeout=limit_s, check=False)
        except subprocess.TimeoutExpired:
            raise ValueError(
                f"{path}: the C3D file is damaged: ezc3d took more than {limit_s:.0f} s; copy or export it again"
            ) from None
        said = ended.stderr.decode(errors="replace").strip().splitlines()
        if ended.returncode < 0 or (ended.returncode and not said):
            raise ValueError(f"{path}: the C3D file is damaged: it ended ezc3d; copy or export it again")
        if ended.returncode:
            raise ValueError(
                f"{path}: expected a C3D file that can be read, got {said[-1]}; copy or export it again"
            )
        with np.load(out) as data:
            return data["matrices"], data["measured"], json.loads(str(data["rest"]))


def _times(rest: dict[str, Any], path: Path, count: int, fps: float | None) -> Any:
    """From the first frame's number on, unless the file says when that was."""
    if fps is not None:
        return np.arange(count) / fps
    rate = float(rest["rate_hz"])
    if not 0 < rate < np.inf:
        raise ValueError(f"{path}: POINT:RATE is {rate:g}; expected the frame rate: fps=30")
    start = rest["start_s"]
    try:
        first = float(start) if start else rest["first_frame"] / rate
    except ValueError:
        raise ValueError(f"{path}: expected seconds as {':'.join(START)}, got {start!r}") from None
    return first + np.arange(count) / (rate * (count // rest["frames"]))


def _unit(named: str, path: Path, unit: str | None) -> str:
    if not named and unit is not None:
        return unit
    if named not in ("m", "cm", "mm"):
        raise ValueError(
            f"{path}: expected POINT:UNITS m, cm or mm, got {named!r}"
            + ("; give unit='mm' (--unit mm)" if not named else "")
        )
    if unit not in (None, named):
        raise ValueError(f"unit: {path} is in {named} (POINT:UNITS), got {unit!r}")
    return named


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
