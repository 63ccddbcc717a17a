# SPDX-License-Identifier: MIT
"""Several objects tracked through a scene, jointly or each by itself, and whether they keep their identity."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from collections.abc import Sequence as Seq
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.synth.staged import Scene

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
WAYS = ("joint", "joint-none", "joint-printed", "single")
SURE = 0.5  # a weak pose of less confidence claims nothing


@dataclass(frozen=True)
class Tracked:
    """n frames of M objects: poses (n, M, 4, 4), status and confidence (n, M), seconds (n,)."""

    poses: Array
    status: NDArray[np.str_]
    confidence: Array
    seconds: Array

    @property
    def reported(self) -> Flags:
        """Frames in which a pose is claimed: ok, or weak with some confidence."""
        return (self.status == "ok") | ((self.status == "weak") & (self.confidence >= SURE))

    @property
    def lost(self) -> Flags:
        return (self.status == "lost") | (self.status == "bad_frame")


def track(
    shapes: Seq[Any],
    camera: Any,
    frames: Iterable[Any],
    first: Seq[Array],
    way: str,
    options: Mapping[str, Any],
    tell: Callable[[int, Any], None] | None = None,
) -> Tracked:
    """One tracker of all shapes, or (`single`) one for each of them; from true poses in the first frame."""
    import sdftrack as st

    if way not in WAYS:
        raise ValueError(f"way: expected one of {', '.join(WAYS)}, got {way!r}")
    more = dict(options)
    if way == "joint-none":
        more["collision"] = None
    elif way == "joint-printed":
        more["collision"] = "printed"
    groups = [[k] for k in range(len(shapes))] if way == "single" else [list(range(len(shapes)))]
    trackers = [st.Tracker([shapes[k] for k in group], camera, **more) for group in groups]
    poses, status, confidence, seconds = [], [], [], []
    for i, frame in enumerate(frames):
        results = [
            t.track(frame) if i else t.start(frame, poses=[np.asarray(first[k]) for k in group])
            for t, group in zip(trackers, groups, strict=True)
        ]
        poses.append(np.concatenate([r.poses for r in results]))
        status.append([str(s) for r in results for s in r.status])
        confidence.append(np.concatenate([r.confidence for r in results]))
        seconds.append(sum(r.seconds for r in results))
        if tell is not None:
            tell(i, results)
    return Tracked(np.array(poses), np.array(status), np.array(confidence), np.array(seconds))


def run_way(scene: Scene, way: str, mode: str, options: Mapping[str, Any]) -> Tracked:
    """Track all objects of a scene from their true first poses."""
    shapes = [scene.solid.sdf] * scene.poses.shape[1]
    frames = (scene[i] for i in range(len(scene)))
    return track(shapes, scene.camera, frames, list(scene.poses[0]), way, {"mode": mode, **options})


def swapped(points: Array, poses: Array, truth: Array) -> Flags:
    """(n, M): the pose of k is nearer to the true pose of another object than to its own.

    Poses are compared by the mean distance of `points` (N, 3) under both.
    """
    at, true = (
        np.einsum("nmij,pj->nmpi", T[..., :3, :3], points) + T[..., None, :3, 3] for T in (poses, truth)
    )
    out = np.zeros(poses.shape[:2], bool)
    for k in range(poses.shape[1]):
        distance = np.linalg.norm(at[:, k, None] - true, axis=-1).mean(axis=-1)
        out[:, k] = np.argmin(distance, axis=1) != k
    return out


def swaps(wrong: Flags, reported: Flags) -> int:
    """Events: an object whose pose is claimed takes another's place, until its pose is claimed in its own again."""
    count = 0
    for w, r in zip(wrong.T, reported.T, strict=True):
        claimed = w[r]
        count += int(np.count_nonzero(claimed[1:] & ~claimed[:-1])) + int(claimed[:1].sum())
    return count
