# SPDX-License-Identifier: MIT
"""Starts on recorded scenes: a click, a box, a mask or nothing, and what comes of it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from experiments.common.protocol import say
from experiments.common.recordings import FOLDERS, Opened, Recording, opened, recordings_of
from experiments.registry import experiment
from experiments.table import Table

Mask = NDArray[np.bool_]
SYMMETRIC = ("cube", "gelatin box", "foam brick", "bottle")  # by their shapes, or nearly so
RIGHT_ADDS_M = 0.015
RIGHT_M, RIGHT_RAD = 0.020, np.deg2rad(10.0)
ON_SURFACE_M = 0.02  # a reading this near to the rendered reference shows the object
STILL = {"k1": {10: 0, 20: 0}}  # frames of k1 in which the sponges stand as in frame 0
SAMPLES = 1000
HOW = ("click", "box", "mask", "auto")
INSIDE_PX = 2  # of the mask's edge, where nobody clicks
KINDS = ("right", "right, weak", "wrong, weak", "wrong, lost", "error", "wrong, ok")


@dataclass(frozen=True)
class Trial:
    """One start: its frame, the kind of answer it got, and how far off that was."""

    frame: int
    place: str
    kind: str
    metres: float
    degrees: float
    overlap: float
    seconds: float


def visible_mask(case: Opened, T: Any, depth: NDArray[np.float32]) -> Mask:
    """Pixels that show the object, by its reference pose and the readings."""
    from sdftrack.camera import depth_camera

    rendered = case.sdf.render(depth_camera(case.seq.camera), T)[0]
    mask: Mask = (rendered > 0) & (depth > 0) & (np.abs(depth - rendered) < ON_SURFACE_M)
    return mask


def frames_of(recording: Recording, case: Opened, step: int) -> Iterator[tuple[int, Any]]:
    """Every `step`-th frame and all few with a reference, each with its pose."""
    still = STILL.get(recording.folder, {})
    known = sorted({*case.seq.ground_truth, *still})
    for i in known:
        T = case.truth(still.get(i, i))
        if T is not None and (i % step == 0 or len(case.seq.ground_truth) < step):
            yield i, T


def clicks(mask: Mask, count: int, rng: np.random.Generator) -> list[tuple[int, int]]:
    """The middle of the mask and random pixels of it."""
    import cv2

    inside = cv2.erode(mask.astype(np.uint8), np.ones((2 * INSIDE_PX + 1,) * 2, np.uint8)) > 0
    v, u = np.nonzero(inside if inside.any() else mask)
    middle = int(np.argmin((v - v.mean()) ** 2 + (u - u.mean()) ** 2))
    chosen = [middle, *rng.choice(len(v), count, replace=len(v) < count)]
    return [(int(u[k]), int(v[k])) for k in chosen]


def is_right(T: Any, truths: list[Any], case: Opened, symmetric: bool) -> bool:
    """Whether the pose is that of one of the references."""
    return any(_is_right(T, truth, case, symmetric) for truth in truths)


def _is_right(T: Any, truth: Any, case: Opened, symmetric: bool) -> bool:
    from sdftrack import metrics

    if symmetric:
        return bool(metrics.adds(T, truth, case.sdf.surface_samples(SAMPLES)[0].astype(float)) < RIGHT_ADDS_M)
    metres, radians = metrics.pose_error(T, truth)
    return bool(metres < RIGHT_M and radians < RIGHT_RAD)


def places_of(how: str, frame: Any, case: Opened, mask: Mask, count: int, rng: Any) -> list[tuple[str, Any]]:
    """Names of the starts of a frame, and what each is told."""
    if how == "click":
        return [(f"{x},{y}", (x, y)) for x, y in clicks(mask, count, rng)]
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    box = (columns[0] - 3, rows[0] - 3, np.ptp(columns) + 7, np.ptp(rows) + 7)
    return [(how, {"box": box, "mask": mask, "auto": None}[how])]


def begin(tracker: Any, how: str, place: Any, frame: Any, case: Opened) -> tuple[Any, Any]:
    """The tracker's answer, and the pixels that it was told; ValueError where the place is refused."""
    if how == "auto":
        return tracker.start(frame), None
    if how == "box":
        return tracker.start(frame, boxes=[place]), None
    if how == "mask":
        return tracker.start(frame, masks=[place]), place
    from sdftrack.tracking.interface import TrackerInterface

    clicked = TrackerInterface(tracker).place_at_click(0, frame, place, "click")
    return TrackerInterface(tracker).start_at(frame, [clicked.place]), clicked.region


def try_all(
    recording: Recording, case: Opened, how: str, step: int, count: int, limit: int, **options: Any
) -> list[Trial]:
    """All starts on one recording."""
    import sdftrack as st
    from sdftrack import metrics

    rng = np.random.default_rng(7)
    trials: list[Trial] = []
    symmetric = recording.name in SYMMETRIC
    tracker = st.Tracker(case.sdf, case.seq.camera, threads=1, **options)
    for i, T in list(frames_of(recording, case, step))[: limit or None]:
        frame = case.seq[i]
        mask = visible_mask(case, T, frame.depth)
        if not mask.any():
            continue
        # Nothing says which of two alike is meant where no place is given.
        others = [case.seq.ground_truth[j][k] for j, k in case.twins(i, STILL.get(recording.folder, {}))]
        for name, place in places_of(how, frame, case, mask, count, rng):
            began = time.perf_counter()
            try:
                result, told = begin(tracker, how, place, frame, case)
            except ValueError:
                trials.append(Trial(i, name, "error", np.inf, 180, 0, time.perf_counter() - began))
                continue
            seconds = time.perf_counter() - began
            status = str(result.status[0])
            overlap = metrics.iou(told, mask) if told is not None else float("nan")
            if status == "lost":
                trials.append(Trial(i, name, "wrong, lost", np.inf, 180, overlap, seconds))
                continue
            right = is_right(result.pose, [T, *others] if how == "auto" else [T], case, symmetric)
            kind = {
                (True, "ok"): "right",
                (True, "weak"): "right, weak",
                (False, "ok"): "wrong, ok",
                (False, "weak"): "wrong, weak",
            }[right, status]
            metres, radians = metrics.pose_error(result.pose, T)
            trials.append(Trial(i, name, kind, metres, float(np.rad2deg(radians)), overlap, seconds))
    return trials


def row_of(trials: list[Trial]) -> dict[str, Any]:
    """Shares of one recording."""
    n = len(trials)
    shares = {kind: sum(t.kind == kind for t in trials) / n for kind in KINDS}
    return {"starts": n, **shares, "median ms": 1e3 * float(np.median([t.seconds for t in trials]))}


@experiment(
    "start.recorded",
    uses=FOLDERS,
    chosen_on="both sponges of k1, the cube of visp_rbt, the mug of ycbv10",
    reported_on="the bottle of mustard0, the dragon of visp_rbt, box and brick of ycbv10 (part=report)",
    short={"limit": 1, "clicks_per_frame": 1, "how": ("click", "mask")},
)
def recorded_starts(
    *,
    data: Path,
    how: tuple[str, ...] = HOW,
    part: Literal["choose", "report"] = "report",
    step: int = 10,
    clicks_per_frame: int = 5,
    limit: int = 0,
    mode: Literal["auto", "depth"] = "auto",
    verbose: bool = False,
) -> Table:
    """Starts on recorded scenes by a click, a box, a mask or nothing: right, weak, lost, refused, or wrong and ok.

    Right: within 15 mm ADD-S of the reference for symmetric shapes, within 20 mm and 10 degrees for the others.

    Parameters
    ----------
    how
        what a start is told: click, box, mask, or auto (nothing but the shape)
    step
        frames between two that are tried
    clicks_per_frame
        random pixels of the object, beside its middle
    limit
        frames of each recording; 0: all
    verbose
        a line for every start
    """
    rows = {}
    for recording in recordings_of(part):
        if not (data / recording.folder).is_dir():
            continue
        with opened(recording, data) as case:
            for kind in how:
                name = f"{recording.folder} {recording.name}, {kind}"
                trials = try_all(recording, case, kind, step, clicks_per_frame, limit, mode=mode)
                for t in trials if verbose else []:
                    say(
                        f"{name} {t.frame} {t.place}: {t.kind}, {1e3 * t.metres:.1f} mm, {t.degrees:.1f} deg, "
                        f"IoU {t.overlap:.2f}"
                    )
                rows[name] = row_of(trials)
                say(f"{name}: {rows[name]}")
    columns = ("object", *next(iter(rows.values()), {}))
    cells = [
        [name, str(r["starts"]), *(f"{v:.2f}" for v in list(r.values())[1:])] for name, r in rows.items()
    ]
    return Table(f"starts on recorded scenes, {part}", columns, cells, numbers=rows)
