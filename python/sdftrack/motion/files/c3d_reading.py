# SPDX-License-Identifier: MIT
"""Rigid bodies of C3D files: the group ROTATION, a 4 x 4 matrix per body and frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.extras import need
from sdftrack.motion.files.c3d_file import check_whole
from sdftrack.motion.files.record import Record, gaps_as_lost, matrices_as_poses

__all__ = ["EXTRA", "START", "read_c3d"]

EXTRA = ("ezc3d", "motion")
# Time of the first frame, as text: a C3D file counts frames, and its numbers are of single precision.
START = ("SDFTRACK", "START_S")


def read_c3d(path: Path, fps: float | None, unit: str | None) -> tuple[list[Record], str]:
    """One record per rigid body, and the unit of their lengths."""
    ezc3d = need(*EXTRA)
    check_whole(path)
    try:
        file = ezc3d.c3d(str(path))
    except Exception as error:  # ezc3d raises whatever C++ threw
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ValueError(f"{path}: expected a C3D file that can be read, got {reason}") from None
    matrices = np.asarray(file["data"]["rotations"], np.float64).transpose(2, 3, 0, 1)
    if not matrices.size:
        markers = file["data"]["points"].shape[1]
        raise ValueError(
            f"{path}: expected rigid bodies (the group ROTATION), got {markers} markers and none; export rigid bodies "
            "(segments) from the program that recorded them"
        )
    matrices = np.where(_measured(file, *matrices.shape[:2])[..., None, None], matrices, np.nan)
    labels = _labels(file, len(matrices))
    times = _times(file, path, matrices.shape[1], fps)
    records = []
    for label, stack in zip(labels, matrices, strict=True):
        poses = matrices_as_poses(stack, lambda i, label=label: f"{path}, {label}, frame {i}")  # type: ignore[misc]
        records.append(
            Record(
                label,
                times,
                poses,
                gaps_as_lost(poses),
                frame=_text(file, "SDFTRACK", "FRAME") or "laboratory",
            )
        )
    return records, _unit(file, path, unit)


def _measured(file: Any, bodies: int, count: int) -> NDArray[np.bool_]:
    """(bodies, count): whether the residual is not negative. Other programs leave the last matrix where it is -1."""
    measured = np.zeros((bodies, count), bool)
    data = file.c3d_swig.data()
    ratio = count // data.nbFrames()
    for i in range(count):
        subframe = data.frame(i // ratio).rotations().subframe(i % ratio)
        measured[:, i] = [subframe.rotation(k).isValid() for k in range(bodies)]
    return measured


def _values(file: Any, group: str, parameter: str) -> list[Any]:
    parameters = file["parameters"]
    return list(parameters[group][parameter]["value"]) if parameter in parameters.get(group, {}) else []


def _text(file: Any, group: str, parameter: str) -> str:
    values = _values(file, group, parameter)
    return str(values[0]).strip() if values else ""


def _labels(file: Any, count: int) -> list[str]:
    """Names of the bodies; a group of more than 255 has them in LABELS, LABELS2, ..."""
    labels = [str(v).strip() for v in _values(file, "ROTATION", "LABELS")]
    more = 2
    while extra := _values(file, "ROTATION", f"LABELS{more}"):
        labels += [str(v).strip() for v in extra]
        more += 1
    return [labels[k] if k < len(labels) and labels[k] else f"body_{k + 1}" for k in range(count)]


def _times(file: Any, path: Path, count: int, fps: float | None) -> Any:
    """From the first frame's number on, unless the file says when that was."""
    if fps is not None:
        return np.arange(count) / fps
    header = file["header"]["points"]
    rate = float(header["frame_rate"])
    if not 0 < rate < np.inf:
        raise ValueError(f"{path}: POINT:RATE is {rate:g}; expected the frame rate: fps=30")
    start = _text(file, *START)
    try:
        first = float(start) if start else header["first_frame"] / rate
    except ValueError:
        raise ValueError(f"{path}: expected seconds as {':'.join(START)}, got {start!r}") from None
    ratio = count // file.c3d_swig.data().nbFrames()
    return first + np.arange(count) / (rate * ratio)


def _unit(file: Any, path: Path, unit: str | None) -> str:
    named = _text(file, "POINT", "UNITS").lower()
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
