# SPDX-License-Identifier: MIT
"""Reads a C3D file by ezc3d, which damaged files end or hold up: run as a program, ``c3d_child.py FILE OUT.npz``."""

from __future__ import annotations

import json
import os
import sys
from typing import Any

import numpy as np

from sdftrack._internal.systems import limit_memory

BLOCK = 512
ROTATION_BYTES = 17 * 4  # a 4 x 4 matrix and a residual, float32
MOST_BYTES = 4 << 30  # of memory, and as many times the file: damaged files declare anything


def main(path: str, out: str) -> None:
    """Write matrices, which of them were measured, and JSON of the rest; or print one line of what is wrong."""
    size = os.path.getsize(path)
    limit_memory(MOST_BYTES + 40 * size)
    import ezc3d

    try:
        file = ezc3d.c3d(path)
        if _needed(file) > size:
            sys.exit("a truncated file")
        matrices = np.asarray(file["data"]["rotations"], np.float64).transpose(2, 3, 0, 1)
        measured = _measured(file, *matrices.shape[:2])
        rest = {
            "markers": int(file["data"]["points"].shape[1]),
            "frames": int(file.c3d_swig.data().nbFrames()),
            "first_frame": int(file["header"]["points"]["first_frame"]),
            "rate_hz": float(file["header"]["points"]["frame_rate"]),
            "labels": _labels(file),
            "unit": _text(file, "POINT", "UNITS"),
            "frame": _text(file, "SDFTRACK", "FRAME"),
            "start_s": _text(file, "SDFTRACK", "START_S"),
        }
    except Exception as error:  # ezc3d raises whatever C++ threw
        sys.exit(str(error).splitlines()[0] if str(error) else type(error).__name__)
    np.savez(out, matrices=matrices, measured=measured, rest=json.dumps(rest))


def _needed(file: Any) -> int:
    """Bytes up to the end of the data, as the header and the parameters say; ezc3d takes the rest for zeros."""
    header = file.c3d_swig.header()
    frames = header.nbFrames()
    # The sign of the scale says whether numbers are float or integer.
    word = 4 if header.scaleFactor() < 0 else 2
    numbers = 4 * header.nb3dPoints() + header.nbAnalogsMeasurement()
    needed = (header.dataStart() - 1) * BLOCK + frames * word * numbers
    begin, used = (_values(file, "ROTATION", name) for name in ("DATA_START", "USED"))
    if begin and used:
        ratio = int((_values(file, "ROTATION", "RATIO") or [1])[0])
        needed = max(needed, (int(begin[0]) - 1) * BLOCK + frames * ratio * int(used[0]) * ROTATION_BYTES)
    return int(needed)


def _measured(file: Any, bodies: int, count: int) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(bodies, count): whether the residual is not negative. Other programs leave the last matrix where it is -1."""
    measured = np.zeros((bodies, count), bool)
    data = file.c3d_swig.data()
    ratio = count // data.nbFrames() if count else 1
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


def _labels(file: Any) -> list[str]:
    """Names of the bodies; a group of more than 255 has them in LABELS, LABELS2, ..."""
    labels = [str(v).strip() for v in _values(file, "ROTATION", "LABELS")]
    more = 2
    while extra := _values(file, "ROTATION", f"LABELS{more}"):
        labels += [str(v).strip() for v in extra]
        more += 1
    return labels


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
