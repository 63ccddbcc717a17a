# SPDX-License-Identifier: MIT
"""Whether confidence tells right poses from wrong ones: poses with known error, and the area under ROC.

A sample is a pose in a frame, judged as it is: the truth, the truth disturbed by 0-60 mm and 0-40 degrees, the pose
where a fit ended that began at the truth or far from it (10-120 mm, 10-180 degrees), and the pose that a fit
finds for an object that is not there. Right means within 20 mm and 10 degrees.
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as Seq
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.common.pose_sets import off_pose

Array = NDArray[np.float64]
FAR_M, FAR_RAD = 0.020, np.deg2rad(10.0)
MAX_OFF_M, MAX_OFF_RAD = 0.060, np.deg2rad(40.0)
WRONG_M, WRONG_RAD = (0.010, 0.120), (np.deg2rad(10.0), np.pi)
KINDS = ("true", "tracked", "disturbed", "wrong", "absent")
CLUTTER = (None, "wall", "table", "objects", "touching")
NOISE = (0.001, 0.00316, "kinect", "kinect")
HALF_TURN = {"lm_glue": (0.0, 0.0, 1.0)}  # bodies that a half turn about this axis leaves nearly the same


@dataclass(frozen=True)
class Sample:
    """A judged pose: what it is, its error, and what the tracker says of it (nothing: too few readings)."""

    kind: str
    error_m: float
    error_rad: float
    said: dict[str, Any]

    @property
    def right(self) -> bool:
        """Within 20 mm and 10 degrees."""
        return bool(self.error_m <= FAR_M and self.error_rad <= FAR_RAD)

    @property
    def confidence(self) -> float:
        """0 where the tracker has too few readings to judge."""
        return float(self.said.get("confidence", 0.0))


def area_under_roc(score: Array, right: NDArray[np.bool_]) -> float:
    """Chance that a right pose scores above a wrong one; ties count half."""
    good, bad = np.sort(score[right]), np.sort(score[~right])
    if not len(good) or not len(bad):
        return float("nan")
    below = np.searchsorted(bad, good, "left") + np.searchsorted(bad, good, "right")
    return float(below.mean()) / (2 * len(bad))


def error_about(T: Array, T_true: Array, centre: Array, axis: Array | None = None) -> tuple[float, float]:
    """(m, rad) at the object's centre; up to a half turn about `axis` (through the centre) where one is given."""
    from sdftrack.metrics import pose_error

    at = np.eye(4)
    at[:3, 3] = centre
    errors = [pose_error(T @ at, T_true @ at)]
    if axis is not None:
        turn = np.eye(4)
        turn[:3, :3] = 2 * np.outer(axis, axis) - np.eye(3)
        errors.append(pose_error(T @ at, T_true @ at @ turn))
    metres, radians = min(errors, key=lambda e: e[1])
    return float(metres), float(radians)


def judged(tracker: Any, frame: Any, T: Array, k: int = 0) -> dict[str, Any]:
    """What the tracker would say of a pose as it is."""
    from sdftrack.tracking.interface import TrackerInterface

    return TrackerInterface(tracker).judge(k, frame, T)


def trackers(sdf: Any, camera: Any, threads: int) -> tuple[Any, Any]:
    """(one that calls nothing lost, so that its wrong ends are seen; one that judges as usual)."""
    import sdftrack as st

    common: dict[str, Any] = {"mode": "depth", "threads": threads, "recover": False}
    credulous = st.Tracker(sdf, camera, lost_inliers=0.0, lost_evidence=0.0, **common)
    return credulous, st.Tracker(sdf, camera, **common)


def around(
    pair: tuple[Any, Any],
    frame: Any,
    T_true: Array,
    centre: Array,
    rng: np.random.Generator,
    disturbed: int,
    wrong: int,
    axis: Array | None = None,
) -> Iterable[Sample]:
    """Samples of one object in one frame; `pair` as from `trackers`."""
    credulous, judge = pair
    to_centre, back = np.eye(4), np.eye(4)
    to_centre[:3, 3], back[:3, 3] = centre, -centre

    def off(metres: float, radians: float) -> Array:
        return off_pose(T_true @ to_centre, metres, radians, rng) @ back

    def sample(kind: str, T: Array) -> Sample:
        return Sample(kind, *error_about(T, T_true, centre, axis), judged(judge, frame, T))

    yield sample("true", T_true)
    for _ in range(disturbed):
        yield sample("disturbed", off(rng.uniform(0, MAX_OFF_M), rng.uniform(0, MAX_OFF_RAD)))
    starts = [T_true] + [off(rng.uniform(*WRONG_M), rng.uniform(*WRONG_RAD)) for _ in range(wrong)]
    for n, start in enumerate(starts):
        result = credulous.start(frame, poses=[start])
        if str(result.status[0]) in ("ok", "weak"):
            yield sample("wrong" if n else "tracked", result.pose)


def synthetic(
    name: str, mesh: Any, sdf: Any, scenes: int, seed: int, occluders: tuple[Any, ...], threads: int = 1
) -> list[Sample]:
    """Samples of random scenes: every clutter with every occluder in turn, noise of three kinds."""
    from sdftrack import synth

    centre = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    axis = np.array(HALF_TURN[name]) if name in HALF_TURN else None
    out: list[Sample] = []
    for n in range(scenes):
        rng = np.random.default_rng([seed, n])
        clutter, occluder = CLUTTER[n % len(CLUTTER)], occluders[n // len(CLUTTER) % len(occluders)]
        noise = NOISE[int(rng.integers(len(NOISE)))]
        seq = synth.sequence(
            mesh, 1, None, noise, occluder, 1000 * seed + n, clutter=clutter, color=False, threads=threads
        )
        pair = trackers(sdf, seq.camera, threads)
        out += around(pair, seq[0], np.asarray(seq.ground_truth[0][0]), centre, rng, 4, 4, axis)
    return out


def recorded(
    seq: Any, sdf: Any, seed: int, disturbed: int, wrong: int, only: Seq[int] = (0, 1), threads: int = 1
) -> list[Sample]:
    """Samples of the objects `only` in every frame that has a reference."""
    pair = trackers(sdf, seq.camera, threads)
    out: list[Sample] = []
    for i in sorted(seq.ground_truth):
        for k in set(only) & set(seq.ground_truth[i]):
            rng = np.random.default_rng([seed, i, k])
            T = np.asarray(seq.ground_truth[i][k])
            out += around(pair, seq[i], T, np.zeros(3), rng, disturbed, wrong)
    return out


AREAS = (
    "group", "poses", "AUC of fits", "true against wrong", "true against disturbed", "right fits doubted %",
    "wrong fits not doubted %", "wrong fits",
)  # fmt: skip


def area_cells(name: str, samples: Seq[Sample]) -> list[str]:
    """A row under `AREAS`: areas under ROC, and shares on the wrong side of one half."""
    score = np.array([s.confidence for s in samples])
    right = np.array([s.right for s in samples])
    kind = np.array([s.kind for s in samples])
    fits = np.isin(kind, ("tracked", "wrong"))
    given = (kind == "true") | (kind == "disturbed")
    against = (kind == "true") | ((kind == "disturbed") & ~right)
    return [
        name, str(len(samples)), f"{area_under_roc(score[fits], right[fits]):.4f}",
        f"{area_under_roc(score[against], right[against]):.4f}",
        f"{area_under_roc(score[given], kind[given] == 'true'):.4f}",
        f"{100 * np.mean(score[fits & right] < 0.5):.1f}", f"{100 * np.mean(score[fits & ~right] > 0.5):.1f}",
        str((fits & ~right).sum()),
    ]  # fmt: skip
