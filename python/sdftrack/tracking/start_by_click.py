# SPDX-License-Identifier: MIT
"""A start from a click: the regions that may be meant are searched, and the poses found there are compared."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sdftrack.camera import depth_camera
from sdftrack.imaging.click_regions import click_regions
from sdftrack.imaging.pose_hint import Place, one_place
from sdftrack.imaging.region_growing import nearest_reading
from sdftrack.tracking.scale import check_size, extent_of, size_of

__all__ = ["Agreement", "Meant", "agreement", "click_list", "meant_by_click"]

Mask = NDArray[np.bool_]
Pose = NDArray[np.float64]

MIN_M, PER_M = 0.006, 0.01  # a reading this near to the model's depth is its surface; per metre of distance
CLICK_PX = 4  # a pose is of another thing where nothing of it lies this near to the click
BOX_MARGIN = 0.15  # of the larger side of a region, about it
LEAST = 0.42  # agreement below which the shape is not there
CONVINCING = 0.8  # agreement from which no other region is tried


class Agreement(NamedTuple):
    """How well a pose explains what is seen about a click, 0..1.

    Attributes
    ----------
    seen : float
        Of the surface that the camera should see, what nothing nearer hides: the share that is where it should be.
    explained : float
        Of the region's readings, the share on the surface.
    clicked : bool
        Whether the reading that was clicked on is on it.
    """

    seen: float
    explained: float
    clicked: bool

    @property
    def score(self) -> float:
        """One number, to compare poses by."""
        return self.seen * self.explained if self.clicked else 0.0


class Meant(NamedTuple):
    """Where an object is to be looked for after a click, a mask or a box, and the region that was taken for it."""

    region: Mask
    box: tuple[float, float, float, float] | None
    agreement: Agreement | None

    def place(self, camera: Any) -> Place:
        """What the core's tracker is given."""
        return one_place(None, self.region if self.box is None else None, self.box, depth_camera(camera))

    @property
    def score(self) -> float:
        """Of the pose that was found there; -1: none was."""
        return -1.0 if self.agreement is None else self.agreement.score


def click_list(clicks: Any, count: int, camera: Any) -> list[tuple[float, float]]:
    """One pixel of the depth image per shape; for one shape the two numbers will do."""
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


def agreement(sdf: Any, camera: Any, depth: NDArray[np.float32], T: Pose, region: Mask, px: Any) -> Agreement:
    """Compare a depth image with what it should be at a pose."""
    expected = sdf.render(camera, T)[0]
    on = expected > 0
    near = MIN_M + PER_M * expected
    agree = on & (np.abs(depth - expected) < near)
    past = on & (depth > expected + near)
    front = on & (depth > 0) & (depth < expected - near)
    seen = float(agree.sum()) / max(1.0, float(agree.sum() + past.sum()) + 0.5 * float(front.sum()))
    x, y = px
    about = agree[max(0, y - CLICK_PX) : y + CLICK_PX + 1, max(0, x - CLICK_PX) : x + CLICK_PX + 1]
    return Agreement(seen, float((agree & region).sum()) / max(1, int(region.sum())), bool(about.any()))


def meant_by_click(
    sdf: Any, camera: Any, frame: Any, px: tuple[float, float], start: Callable[..., Any]
) -> Meant:
    """The region or box in which `start` finds the pose that explains best what is seen about a click.

    Parameters
    ----------
    sdf : SDF
    camera : Camera or RGBDCamera
    frame : Frame
    px : (x, y)
        Depth pixels.
    start : function
        ``start(masks=[...])`` or ``start(boxes=[...])`` of a tracker of this shape alone: its result.

    Raises
    ------
    ValueError
        The click is on nothing, or on a table.
    """
    check_size(frame, camera, px, sdf)
    v, u = nearest_reading(frame, px)
    regions = click_regions(frame, camera, px, size_of(sdf))
    best: Meant | None = None
    for region, box in [*((r, None) for r in regions), (regions[0], _box_about(regions[0]))]:
        result = start(masks=[region]) if box is None else start(boxes=[box])
        told = None
        if str(result.status[0]) != "lost":
            told = agreement(sdf, camera, frame.depth, result.poses[0], region, (u, v))
        meant = Meant(region, box, told)
        best = meant if best is None or meant.score > best.score else best
        if best.score > CONVINCING:
            break
    assert best is not None
    if best.score < LEAST:
        raise ValueError(
            f"expected the shape ({1e3 * size_of(sdf):.0f} mm across) at ({u}, {v}), got a surface of "
            f"{1e3 * extent_of(camera, frame.depth, regions[0]):.0f} mm that none of its poses explains; click on the "
            "middle of the object, or give a mask of it"
        )
    return best


def _box_about(region: Mask) -> tuple[float, float, float, float]:
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    width, height = float(np.ptp(columns)) + 1, float(np.ptp(rows)) + 1
    margin = BOX_MARGIN * max(width, height)
    return columns[0] - margin, rows[0] - margin, width + 2 * margin, height + 2 * margin
