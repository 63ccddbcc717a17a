# SPDX-License-Identifier: MIT
"""Tracking of an object in a fist, from the first frame."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from experiments.options import NO_SETTINGS, Settings
from experiments.registry import experiment
from experiments.table import Table
from experiments.tracking.occlusion import occlusion

CHOSEN_ON = ("bunny", "lm_can", "lm_driller", "lm_glue")
REPORTED_ON = ("lm_ape", "lm_cat", "lm_duck", "spot")


@experiment(
    "grasp",
    needs=["meshes"],
    chosen_on="bunny, lm_can, lm_driller, lm_glue (`--part choose`), other seeds and surroundings",
    reported_on="lm_ape, lm_cat, lm_duck, spot; seed 0",
    short={
        "mode": ("depth",),
        "share": (0.5,),
        "color": ("skin",),
        "noise": ("gaussian",),
        "frames": 3,
        "voxels": 60,
    },
)
def grasp(
    *,
    data: Path,
    part: Literal["choose", "report"] = "report",
    mode: tuple[Literal["depth", "rgbd"], ...] = ("depth", "rgbd"),
    color: tuple[Literal["other", "similar", "skin"], ...] = ("skin", "similar"),
    share: tuple[float, ...] = (0.5, 0.65),
    frames: int = 200,
    sigma: float = 0.001,
    noise: tuple[Literal["gaussian", "kinect", "stereo"], ...] = ("gaussian", "kinect"),
    voxels: int = 160,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
    cache: Path | None = None,
) -> list[Table]:
    """A hand that holds the object from the first frame on: fingers and palm in contact, 50 and 65 % hidden.

    5 mm and 1.5 deg per frame over a cluttered table; the first pose is given.

    Parameters
    ----------
    part
        meshes that defaults were chosen on, or others
    share
        of the visible object that is hidden
    """
    meshes = REPORTED_ON if part == "report" else CHOSEN_ON
    return [
        occlusion(
            data=data, only=meshes, mode=mode, color=color, share=s, grow=0, frames=frames, sigma=sigma, noise=n,
            voxels=voxels, threads=threads, options=options, cache=cache,
        )
        for n in noise
        for s in share
    ]  # fmt: skip
