# SPDX-License-Identifier: MIT
"""Unknown objects of labelled Kinect scenes, from one frame and their masks: is the seen surface their own?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import sdftrack as st
from experiments.common.protocol import say
from experiments.options import NO_SETTINGS, Settings
from experiments.primitives.kinect_objects import ALL, kind_of, objects_of
from experiments.registry import experiment
from experiments.table import Table

HEAD = [
    "kind",
    "objects",
    "refused",
    "own %, median",
    "own %, least",
    "covered %, median",
    "least",
    "at",
    "ms",
]
NEAR_M = 0.004


def own_share(star: Any, pose: NDArray[np.float64], mask: NDArray[np.bool_]) -> float:
    """The share of the seen vertices that the frame shows on pixels of the mask."""
    mesh = star.mesh(seen_only=True)
    u, v = np.round(star.camera.project(mesh.vertices @ pose[:3, :3].T + pose[:3, 3])).astype(int).T
    inside = (u >= 0) & (v >= 0) & (u < mask.shape[1]) & (v < mask.shape[0])
    u, v = u.clip(0, mask.shape[1] - 1), v.clip(0, mask.shape[0] - 1)
    return float((inside & mask[v, u]).mean())


def covered_share(star: Any, pose: NDArray[np.float64], frame: st.Frame, mask: NDArray[np.bool_]) -> float:
    """The share of the mask's readings that lie on the surface, within 4 mm."""
    points = star.camera.back_project(frame.depth)[mask & (frame.depth > 0)]  # type: ignore[operator]
    return float(np.mean(np.abs(star.shape((points - pose[:3, 3]) @ pose[:3, :3])) < NEAR_M))


@experiment(
    "reconstruction.osd",
    needs=["osd"],
    chosen_on="nothing: no option was chosen on these scenes",
    reported_on="the boxes and cylinders of 16 scenes of osd",
    short={"scenes": 1, "voxels": 48},
)
def single_views(
    *,
    data: Path,
    scenes: int = len(ALL),
    voxels: int = 200,
    threads: int = 0,
    options: Settings = NO_SETTINGS,
) -> Table:
    """Objects that stand, lie and lean on one another, each reconstructed from one frame and its label.

    A vertex of the surface that was seen is the object's own if the frame shows it on a pixel of the object's label; a
    reading of the label is covered if it lies within 4 mm of the surface.

    Parameters
    ----------
    scenes
        the first so many
    """
    found: dict[str, list[tuple[float, float, str, float]]] = {"box": [], "cylinder": []}
    refused = dict.fromkeys(found, 0)
    for scene in ALL[:scenes]:
        frame, masks = objects_of(data / "osd", scene)
        for number, mask in masks.items():
            kind = kind_of(scene, number)
            if kind is None:
                continue
            assert frame.camera is not None
            star = st.Reconstructor(frame.camera, voxels=voxels, threads=threads, **options)
            place = f"learn{scene} {number}"
            try:
                result = star.start(frame, mask=mask)
            except ValueError as error:
                refused[kind] += 1
                say(f"{place}: {error}")
                continue
            shares = covered_share(star, result.pose, frame, mask), own_share(star, result.pose, mask)
            found[kind].append((*shares, place, 1e3 * result.seconds))
            say(f"{place}: {100 * shares[1]:.1f} % its own, {100 * shares[0]:.1f} % covered")
    rows = []
    for kind, cases in found.items():
        if not cases:
            continue
        covered = 100 * np.array([case[0] for case in cases])
        own = 100 * np.array([case[1] for case in cases])
        ms = np.median([case[3] for case in cases])
        rows.append(
            [kind, str(len(cases)), str(refused[kind]), f"{np.median(own):.1f}", f"{own.min():.1f}",
             f"{np.median(covered):.1f}", f"{covered.min():.1f}", min(cases)[2], f"{ms:.0f}"]
        )  # fmt: skip
    return Table("seen surface and the object's own label, from one frame", HEAD, rows)
