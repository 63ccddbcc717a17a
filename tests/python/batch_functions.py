# SPDX-License-Identifier: MIT
"""Functions that the workers of a batch import."""

import os
import signal
from pathlib import Path


def square(x):
    return x * x


def refuses_three(x):
    if x == 3:
        raise ValueError("expected another number than 3")
    return x


def dies_once(place):
    """Killed as the system kills what takes too much memory; survives the second time."""
    folder, name = place
    mark = Path(folder) / f"{name}.tried"
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return name


def dies(x):
    if x == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def frames_of(sequence):
    return len(sequence), sequence[0].depth.shape
