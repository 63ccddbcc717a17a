# SPDX-License-Identifier: MIT
"""An object that is not in the scene must end lost or doubted: other objects' models in recorded table scenes."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence as Seq
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.truth import _random_rotation
from experiments.trust.confidence import Sample, judged, trackers

Array = NDArray[np.float64]
MODELS = ("lm_ape", "lm_can", "lm_cat", "lm_driller", "lm_duck", "lm_glue")
BEHIND_M = (0.02, 0.06)  # of the reading that the model's middle is put behind


def osd_scenes(folder: Path) -> Iterator[tuple[str, Any, Any]]:
    """(name, Frame, Camera) of every scene."""
    import json

    import cv2

    import sdftrack as st

    K = json.loads((folder / "camera.json").read_text())
    paths = sorted(folder.glob("*_depth.png"))
    if not paths:
        raise FileNotFoundError(f"{folder}: expected NAME_depth.png; is this the osd folder?")
    for path in paths:
        depth: Any = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        camera = st.Camera(K["fx"], K["fy"], K["cx"], K["cy"], depth.shape[1], depth.shape[0])
        yield path.name.removesuffix("_depth.png"), st.Frame(depth, depth_scale=0.001), camera


def _trials(
    scenes: Seq[tuple[str, Any, Any]], sdfs: dict[str, Any], n: int, seed: int, threads: int
) -> Iterator[tuple[Any, Any, Any, Any, np.random.Generator]]:
    """(tracker, frame, camera, sdf, rng) of n trials, models in turn, scenes at random."""
    names = list(sdfs)
    made: dict[str, Any] = {}
    for i in range(n):
        rng = np.random.default_rng([seed, i])
        name = names[i % len(names)]
        _, frame, camera = scenes[int(rng.integers(len(scenes)))]
        if name not in made:
            made[name] = trackers(sdfs[name], camera, threads)[1]
        yield made[name], frame, camera, sdfs[name], rng


def placed(
    scenes: Seq[tuple[str, Any, Any]], sdfs: dict[str, Any], n: int, seed: int = 0, threads: int = 1
) -> list[Sample]:
    """Fits that begin with the model put behind a random reading, turned at random; the pose where each ends."""
    out = []
    for tracker, frame, camera, sdf, rng in _trials(scenes, sdfs, n, seed, threads):
        v, u = np.nonzero(frame.depth > 0)
        k = int(rng.integers(len(v)))
        ray = np.array([(u[k] - camera.cx) / camera.fx, (v[k] - camera.cy) / camera.fy, 1.0])
        T = np.eye(4)
        T[:3, :3] = _random_rotation(rng)
        low, high = sdf.bounds
        middle = (np.asarray(low) + np.asarray(high)) / 2
        T[:3, 3] = ray * (float(frame.depth[v[k], u[k]]) + rng.uniform(*BEHIND_M)) - T[:3, :3] @ middle
        out.append(_ended(tracker, frame, tracker.start(frame, poses=[T])))
    return out


def searched(
    scenes: Seq[tuple[str, Any, Any]],
    sdfs: dict[str, Any],
    n: int,
    seed: int = 0,
    threads: int = 1,
) -> list[Sample]:
    """Starts without a pose: the search may put the model anywhere in the scene."""
    trials = _trials(scenes, sdfs, n, seed, threads)
    return [_ended(tracker, frame, tracker.start(frame)) for tracker, frame, *_ in trials]


def _ended(judge: Any, frame: Any, result: Any) -> Sample:
    """With the status and confidence of the result itself, which a search may have lowered."""
    status = str(result.status[0])
    said = judged(judge, frame, result.poses[0]) if status in ("ok", "weak") else {}
    said.update(status=status, confidence=float(result.confidence[0]), reason=result.reason[0])
    return Sample("absent", np.inf, np.inf, said)
