# SPDX-License-Identifier: MIT
"""Recorded scenes of things on a table, labelled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.table_scene import TableScene

Array = NDArray[np.float64]


def open_scenes(folder: Path) -> list[TableScene]:
    """The scenes of the Object Segmentation Database in a folder (or in its part `osd`)."""
    import sdftrack as st
    from sdftrack.io.frames import read_depth_units

    folder = folder / "osd" if (folder / "osd").is_dir() else folder
    files = sorted(folder.glob("*_depth.png"))
    if not files:
        raise FileNotFoundError(
            f"data: expected scenes NAME_depth.png and NAME_label.png in {folder}, found none"
        )
    camera: Any = st.Camera.load(folder / "camera.json")
    scenes = []
    for path in files:
        name = path.name.removesuffix("_depth.png")
        frame = st.Frame(read_depth_units(path), depth_scale=0.001)
        labels = _labels(path.with_name(f"{name}_label.png"))
        points = camera.back_project(frame.depth)
        table = (labels >= 1) & (labels <= 9)
        n, d = through(points[table])
        scenes.append(TableScene(name, frame, camera, table, labels >= 20, points @ n + d))
    return scenes


def _labels(path: Path) -> NDArray[np.uint8]:
    import cv2

    labels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if labels is None:
        raise FileNotFoundError(f"data: expected the labels of a scene in {path}, found none")
    return labels.astype(np.uint8)


def through(points: Array) -> tuple[Array, float]:
    """Total least squares plane through all points, normal towards the camera."""
    mean = points.mean(axis=0)
    n = np.linalg.eigh((points - mean).T @ (points - mean))[1][:, 0]
    n = -n if n @ mean > 0 else n
    return n, -float(n @ mean)
