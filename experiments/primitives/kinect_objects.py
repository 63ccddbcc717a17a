# SPDX-License-Identifier: MIT
"""Primitives fitted to the objects of real Kinect scenes (Object Segmentation Database; labels made by hand)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.registry import experiment
from experiments.table import Table
from sdftrack import _core
from sdftrack.camera import Camera
from sdftrack.frame import Frame
from sdftrack.primitives import PrimitiveFit, fit_primitive

LIMIT_M = 0.004
BOXES = ("00", "03", "09", "14", "17", "20", "22", "24", "25", "28")  # all of their objects
KNOWN = {  # (scene, object): kind; the others are bowls, cups, pots
    **dict.fromkeys([("30", 2), ("32", 2)], "box"),
    **dict.fromkeys(
        [("33", 2), ("36", 2), ("40", 2), ("43", 2), ("43", 3), ("43", 4), ("30", 3), ("32", 3)], "cylinder"
    ),
}
ALL = (*BOXES, "30", "32", "33", "36", "40", "43")


def _camera(folder: Path) -> Camera:
    numbers = json.loads((folder / "camera.json").read_text())
    numbers = numbers.get("camera", numbers)
    return Camera(numbers["fx"], numbers["fy"], numbers["cx"], numbers["cy"], 640, 480)


def objects_of(folder: Path, scene: str) -> tuple[Frame, dict[int, NDArray[np.bool_]]]:
    """The frame of scene learn<NN> and the mask of each object."""
    import cv2

    depth = cv2.imread(str(folder / f"learn{scene}_depth.png"), cv2.IMREAD_UNCHANGED)
    label = cv2.imread(str(folder / f"learn{scene}_label.png"), cv2.IMREAD_UNCHANGED)
    assert depth is not None
    assert label is not None
    numbers = [int(k) for k in np.unique(label // 10) if k > 1]
    return Frame(depth, depth_scale=0.001, camera=_camera(folder)), {k: label // 10 == k for k in numbers}


def kind_of(scene: str, number: int) -> str | None:
    """What an object is, None: no primitive."""
    return "box" if scene in BOXES else KNOWN.get((scene, number))


def surface_distance(fit: PrimitiveFit, frame: Frame, mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """|distance| (m) of the readings in a mask to the primitive's surface."""
    assert frame.depth is not None
    assert frame.camera is not None
    points = frame.camera.back_project(frame.depth)[mask & (frame.depth > 0)].astype(np.float64)  # type: ignore[union-attr]
    T = np.linalg.inv(fit.T_cam_obj)
    local = np.ascontiguousarray(points @ T[:3, :3].T + T[:3, 3])
    kind = _core.PrimitiveKind.__members__[fit.kind]
    phi: NDArray[np.float64] = _core.primitive_distances(kind, list(fit.size.values()), local)[0]
    return np.abs(phi)


@experiment(
    "primitives.osd",
    needs=["osd"],
    chosen_on="the same objects of osd, and synthetic solids",
    reported_on="the objects of 16 scenes of osd",
    short={"scenes": 1},
)
def osd(*, data: Path, scenes: int = len(ALL)) -> Table:
    """Primitives fitted to the objects of Kinect scenes, by their own kind and by kind="auto".

    Object Segmentation Database, labels made by hand; the distance of an object's readings to the primitive's surface.

    Parameters
    ----------
    scenes
        the first so many
    """
    folder = data / "osd"
    rows: list[list[str]] = []
    tally: dict[str, list[Any]] = {"box": [], "cylinder": [], "other": []}
    for scene in ALL[:scenes]:
        frame, masks = objects_of(folder, scene)
        for number, mask in masks.items():
            kind = kind_of(scene, number)
            auto = fit_primitive(frame, "auto", mask=mask)
            score = next(iter(auto.scores.values()))
            own = auto if kind is None else fit_primitive(frame, kind, mask=mask)
            off = float(np.median(surface_distance(own, frame, mask)))
            tally[kind or "other"].append((off, auto.kind == kind, score))
            size = " x ".join(f"{100 * v:.1f}{'' if own.bounded[n] else '?'}" for n, v in own.size.items())
            rows.append(
                [
                    f"learn{scene} {number}",
                    kind or "other",
                    str(np.count_nonzero(mask)),
                    size,
                    f"{1e3 * off:.1f}",
                    "yes" if off < LIMIT_M else "NO",
                    auto.kind,
                    f"{score:.2f}",
                ]
            )
    head = ["object", "is a", "readings", "size (cm)", "median mm", "< 4 mm", "auto says", "score"]
    notes = []
    for name, found in tally.items():
        if not found:
            continue
        within = sum(off < LIMIT_M for off, _, _ in found)
        right = sum(good for _, good, _ in found)
        scores = [score for _, _, score in found]
        kinds = f", right kind by auto {right}" if name != "other" else ""
        notes.append(
            f"{name}: {within} of {len(found)} within 4 mm (worst {1e3 * max(o for o, _, _ in found):.1f} mm){kinds}, "
            f"score median {np.median(scores):.2f}"
        )
    return Table("Objects of Kinect scenes, mask given; ? : a length that nothing bounds", head, rows, notes)
