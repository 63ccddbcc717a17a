# SPDX-License-Identifier: MIT
"""Tracking of two recorded sequences against their reference poses."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from experiments.common.protocol import say
from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table
from experiments.tracking import random_starts, still_and_in_hand
from experiments.tracking.random_starts import YCB_NAMES, run_ycbv10
from experiments.tracking.still_and_in_hand import SIDES, run_k1

__all__ = ["in_hand", "random_start"]


@experiment(
    "real.ycbv10",
    needs=["ycbv10"],
    chosen_on="ycbv10 and k1 (`ablation`)",
    reported_on="ycbv10, the same recording",
    short={"only": ("box",), "starts": 2, "frames": 2, "voxels": 80},
)
def random_start(
    *,
    data: Path,
    only: tuple[Literal["box", "mug", "brick"], ...] = ("box", "mug", "brick"),
    starts: int = 50,
    frames: int = 5,
    from_mask: bool = False,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Three recorded objects from random starts 10 mm / 5 deg off the reference pose, or from a mask.

    By depth alone; ``--set mode=rgbd`` uses colour.

    Parameters
    ----------
    frames
        after which a start is judged
    from_mask
        start from the first frame's mask, not from a pose
    """
    ids = [i for i, name in YCB_NAMES.items() if name in only]
    told = {"threads": threads, **options}
    rows = run_ycbv10(data / "ycbv10", starts, frames, ids, voxels, told, say, from_mask)
    return random_starts.table(rows, f"ycbv10, judged after {frames} frames")


@experiment(
    "real.k1",
    needs=["k1"],
    chosen_on="ycbv10 and k1 (`ablation`)",
    reported_on="k1, the same recording",
    short={"only": ("left",), "frames": 4, "voxels": 80},
)
def in_hand(
    *,
    data: Path,
    only: tuple[Literal["left", "right"], ...] = ("left", "right"),
    frames: int = 141,
    from_mask: bool = False,
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Each of two recorded sponges by itself, still and in the hand.

    By depth alone; ``--set mode=rgbd`` uses colour.

    Parameters
    ----------
    from_mask
        start from the first frame's mask, not from a pose
    """
    sides = [k for k, name in enumerate(SIDES) if name in only]
    told = {"threads": threads, **options}
    rows = run_k1(data / "k1", frames, sides, voxels, told, say, True, from_mask)
    return still_and_in_hand.table(rows, frames)
