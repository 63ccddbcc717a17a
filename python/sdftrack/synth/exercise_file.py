# SPDX-License-Identifier: MIT
"""Exercises from their files."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from sdftrack._internal.text_files import read_json
from sdftrack.synth.exercise import Exercise, exercise

__all__ = ["load_exercise"]

SAME = 1e-9  # s, m, Hz: the last digits of sines differ between machines


def load_exercise(path: str | os.PathLike[str]) -> Exercise:
    """Read what `Exercise.save` or ``sdftrack synth exercise`` wrote; equal to the exercise that was written.

    Parameters
    ----------
    path : str or path
        The file, or the folder that holds exercise.json.

    Raises
    ------
    FileNotFoundError, ValueError
        No such file; a file that is none of an exercise; one of a version that made other exercises.
    """
    file = Path(path)
    if file.is_dir():
        file /= "exercise.json"
    stored = read_json(file)
    try:
        made = exercise(stored["kind"], **stored["arguments"])
        same = _differences(made.truth(), stored) <= SAME
    except (KeyError, TypeError) as error:
        raise ValueError(f"{file}: expected the file of an exercise ({error})") from None
    if not same:
        raise ValueError(
            f"{file}: written by a version that makes other exercises of these arguments; make it anew"
        )
    return made


def _differences(a: Any, b: Any) -> float:
    """The largest difference of numbers in two values of JSON; inf where anything else differs."""
    if isinstance(a, dict) and isinstance(b, dict):
        a, b = sorted(a.items()), sorted(b.items())
    if isinstance(a, list | tuple) and isinstance(b, list | tuple) and len(a) == len(b):
        return max((_differences(x, y) for x, y in zip(a, b, strict=True)), default=0.0)
    if isinstance(a, float) and isinstance(b, float | int):
        return abs(a - b)
    return 0.0 if a == b else math.inf
