# SPDX-License-Identifier: MIT
"""A start from a click: candidate regions are searched, and the poses found there are compared."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.imaging.click_regions import click_regions, nearest_reading
from sdftrack.imaging.pose_hint import Place, one_place
from sdftrack.tracking.scale import check_size, extent_of, scale_doubt, size_of

Mask = NDArray[np.bool_]

BOX_MARGIN = 0.15  # of the larger side of a region, about it
MIN_SCORE = 0.42  # score below which the shape is not there
CONVINCING = 0.8  # score from which no other region is tried


class StartHypothesis(NamedTuple):
    """Where an object may be: a region of the depth image, or a box that is searched in its place."""

    region: Mask
    box: tuple[float, float, float, float] | None = None
    score: float = -1.0  # of the pose found there, 0..1; -1: none was found

    def place(self, camera: Any) -> Place:
        """The hint passed to the core's tracker."""
        return one_place(None, self.region if self.box is None else None, self.box, depth_camera(camera))


def click_list(clicks: Any, count: int, camera: Any) -> list[tuple[float, float]]:
    """One pixel of the depth image per shape; for a single shape the two numbers suffice."""
    given = np.asarray(clicks, dtype=object if isinstance(clicks, str) else float)
    if count == 1 and given.shape == (2,):
        given = given[None]
    if given.shape != (count, 2):
        raise ValueError(f"clicks: expected one (x, y) per shape ({count}), got {clicks!r}")
    for k, (x, y) in enumerate(given.tolist()):
        if not (-0.5 <= x < camera.width - 0.5 and -0.5 <= y < camera.height - 0.5):
            raise ValueError(
                f"clicks[{k}]: expected a pixel of the {camera.width} x {camera.height} depth image, got ({x:g}, {y:g})"
            )
    return [(float(x), float(y)) for x, y in given]


def best_at_click(
    sdf: Any, camera: Any, frame: Any, px: tuple[float, float], start: Callable[..., Any]
) -> StartHypothesis:
    """The region or box in which `start` finds the pose that best explains the image around a click.

    `start` takes masks or boxes, as that of a tracker of this shape alone. ValueError: no surface there, or a table.
    """
    check_size(frame, camera, px, sdf)
    v, u = nearest_reading(frame, px)
    regions = click_regions(frame, camera, px, size_of(sdf))
    lens = depth_camera(camera)
    best: StartHypothesis | None = None
    for region, box in [*((r, None) for r in regions), (regions[0], _box_about(regions[0]))]:
        result = start(masks=[region]) if box is None else start(boxes=[box])
        score = -1.0
        if str(result.status[0]) != "lost":
            score = score_pose(sdf, lens, frame.depth, result.poses[0], region, (u, v))
        hypothesis = StartHypothesis(region, box, score)
        best = hypothesis if best is None or hypothesis.score > best.score else best
        if best.score > CONVINCING:
            break
    assert best is not None
    if best.score < MIN_SCORE:
        raise ValueError(
            f"expected the shape ({1e3 * size_of(sdf):.0f} mm across) at ({u}, {v}), got a surface of "
            f"{1e3 * extent_of(camera, frame.depth, regions[0]):.0f} mm that none of its poses explains; "
            + (
                scale_doubt(frame, camera, regions[0], sdf)
                or "click on the middle of the object, or give a mask of it"
            )
        )
    return best


def _box_about(region: Mask) -> tuple[float, float, float, float]:
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    width, height = float(np.ptp(columns)) + 1, float(np.ptp(rows)) + 1
    margin = BOX_MARGIN * max(width, height)
    return columns[0] - margin, rows[0] - margin, width + 2 * margin, height + 2 * margin


# -- Score of a pose against the depth image in a region, used to compare start hypotheses


# A measurement this near to the model's depth is its surface; per metre of distance.
MIN_M, PER_M = 0.006, 0.01
CLICK_PX = 4  # a pose is of another thing where nothing of it lies this near to the click


def score_pose(
    sdf: Any,
    camera: Any,
    depth: NDArray[np.float32],
    T: NDArray[np.float64],
    region: NDArray[np.bool_],
    px: Any,
) -> float:
    """How well a pose explains the depth image in a region, 0..1; 0 where `px`, (x, y), is not on the surface.

    The fraction of the unoccluded surface that is seen where the pose predicts it, times that of the region's
    measurements that lie on it.
    """
    expected = sdf.render(camera, T)[0]
    on = expected > 0
    near = MIN_M + PER_M * expected
    agree = on & (np.abs(depth - expected) < near)
    past = on & (depth > expected + near)
    front = on & (depth > 0) & (depth < expected - near)
    seen = float(agree.sum()) / max(1.0, float(agree.sum() + past.sum()) + 0.5 * float(front.sum()))
    x, y = px
    about = agree[max(0, y - CLICK_PX) : y + CLICK_PX + 1, max(0, x - CLICK_PX) : x + CLICK_PX + 1]
    return seen * float((agree & region).sum()) / max(1, int(region.sum())) if about.any() else 0.0
