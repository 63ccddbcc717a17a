# SPDX-License-Identifier: MIT
"""Matching of stored silhouettes to the colours of the image (docs/shape_memory.md, "In a video").

The posterior of the colours is searched, not the tracker's outline, which goes wrong at an occluder before a missing
part is detected. With e = 2 p - 1 the evidence for the object at a pixel, the cost of a silhouette M at a location is

    cost = 1 - (sum of e+ where M is  -  LACKING * sum of e- where M is) / area + priors,

so that colours of an occluder, which are neither the object's nor the background's, have no effect. The edge of M is
soft over EDGE_PX, so the sums are inner products of two images: all silhouettes at all locations are one matrix
product.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack import _core
from sdftrack.contour.masks import FILL
from sdftrack.contour.placement import Placement, Prediction, seen_from

Array: TypeAlias = NDArray[np.float64]
Picture: TypeAlias = NDArray[np.float32]

FRAME = 64  # side of the frame that is searched in, whatever the memory's
EDGE_PX = 3.0  # of a 64 x 64 frame: over which inside goes over into outside, to both sides
LACKING = 0.6  # what a pixel of the background's colour inside costs, one of the object's outside costing 1
PRIOR = 0.02  # of the area: what a miss of the prediction by its usual size costs
MIN_MISS = 0.03  # of the size: a prediction is never taken to be better
TURNED = 0.5  # cost of a square radian
UNLIKE = 0.02  # cost of a pose that has no pixel in common with the last
FINALISTS = 16
LIKELY = 0.01  # cost above the least by which a silhouette counts for a third in the average
MIN_WEIGHT = 0.01  # of the best; less likely ones are left out
MARGIN_PX = 24  # of evidence around the frame: more than the search moves it by
AREA = (FILL * FRAME) ** 2  # of a silhouette


class Shapes(Protocol):
    """The silhouettes to search for."""

    def templates(self, stage: Stage) -> Picture: ...
    def distances(self, places: NDArray[np.int64]) -> Picture: ...


@dataclass(frozen=True)
class Found:
    """The best location, and the expected silhouette there.

    Attributes
    ----------
    placement : Placement
    phi : (size, size) float32
        Signed distances of the average of the likely silhouettes, pixels, negative inside.
    weights, finalists : (k,)
        Of that average.
    cost : float
        0 if all pixels of the object's colours are inside and none of the background's.
    """

    placement: Placement
    phi: Picture
    weights: Picture
    finalists: NDArray[np.int64]
    cost: float


@dataclass(frozen=True)
class Stage:
    """Search grid around a location: shifts up to `reach` times `block` pixels, each with some log scales and angles
    (radians)."""

    block: int
    reach: int
    tried: tuple[tuple[float, float], ...]

    @property
    def length(self) -> int:
        """Length of a template."""
        return 2 * (FRAME // self.block) ** 2


AS_IT_IS = (0.0, 0.0)
COARSE = Stage(4, 2, (AS_IT_IS, (-0.08, 0.0), (0.08, 0.0)))
FINE = Stage(2, 1, (AS_IT_IS, (-0.05, 0.0), (0.05, 0.0), (0.0, -0.06), (0.0, 0.06)))
# Of the average of the likely ones.
LAST = (
    Stage(1, 2, (AS_IT_IS,)),
    Stage(1, 0, (AS_IT_IS, (-0.02, 0.0), (0.02, 0.0), (0.0, -0.03), (0.0, 0.03))),
)


def template(phi: Picture, stage: Stage) -> Picture:
    """(stage.length,) weights of the evidence for, then against the object at each pixel of a silhouette's frame.

    `phi`: (size, size) signed distances, pixels.
    """
    import cv2

    size = phi.shape[0]
    soft = np.clip(phi * (FRAME / size / EDGE_PX), -1, 1)
    if size != FRAME:
        soft = cv2.resize(
            soft, (FRAME, FRAME), interpolation=cv2.INTER_AREA if size > FRAME else cv2.INTER_LINEAR
        )
    beside, within = np.maximum(soft, 0), np.maximum(-soft, 0)
    both = [_blocks(beside - 1, stage.block), _blocks(LACKING * within, stage.block)]
    return np.concatenate([b.reshape(-1) for b in both]).astype(np.float32)


def find(
    signed: Picture,
    warp: Array,
    predicted: Prediction,
    turn: Array,
    shapes: Shapes,
    poses: Picture,
) -> Found:
    """Find the best silhouette and location.

    Parameters
    ----------
    signed : (ny, nx) float32
        2 p - 1 on the tracker's grid.
    warp : (3, 3)
        Maps cells of the grid to pixels.
    predicted : Prediction
        Predicted location.
    turn : (2, 2)
        Rotation given by the tracker, determinant 1.
    shapes : object
        With ``templates(stage)``, (n, stage.length) float32, and ``distances(k)``, (k, size, size) float32 pixels.
    poses : (n,) float32
        Dissimilarity of each silhouette to the last pose, 0 to 2.
    """
    start = Placement(predicted.center_px, predicted.size_px, turn)
    evidence = seen_from(
        np.dstack([np.maximum(signed, 0), np.maximum(-signed, 0)]), warp, start, FRAME, MARGIN_PX
    )
    search = _Search(evidence, start, predicted)
    costs, moves = search.costs(COARSE, np.zeros(4), shapes.templates(COARSE))
    costs = costs + UNLIKE * poses
    near = np.argsort(costs.min(axis=0), kind="stable")[:FINALISTS]
    move = moves[costs[:, near[0]].argmin()]
    costs, moves = search.costs(FINE, move, shapes.templates(FINE)[near])
    costs = costs + UNLIKE * poses[near]
    best = int(costs.min(axis=1).argmin())
    weights = np.exp((costs[best].min() - costs[best]) / LIKELY).astype(np.float32)
    weights[weights < MIN_WEIGHT] = 0
    weights /= weights.sum()
    phi = np.tensordot(weights, shapes.distances(near), 1)
    move = moves[best]
    for stage in LAST:
        costs, moves = search.costs(stage, move, template(phi, stage)[None])
        last = int(costs[:, 0].argmin())
        move = moves[last]
    place = start.moved(move[0], move[1], move[2], move[3], FRAME)
    return Found(place, phi, weights, near, float(costs[last, 0]))


class _Search:
    """Costs of silhouettes at locations around a start; moves are (x, y in pixels, log scale, angle) from it."""

    def __init__(self, evidence: Picture, start: Placement, predicted: Prediction) -> None:
        self._evidence = evidence
        per_px = start.size_px / (FILL * FRAME)
        self._step = per_px / predicted.size_px * start.turn
        self._off = max(MIN_MISS, predicted.place_error), max(MIN_MISS, predicted.size_error)

    def costs(self, stage: Stage, around: Array, templates: Picture) -> tuple[Picture, Array]:
        """(places, shapes) costs without the pose term, and (places, 4) moves."""
        shifts = np.arange(-stage.reach, stage.reach + 1)
        pictures, moves = [], []
        for log_scale, angle in stage.tried:
            move = around + np.array([0, 0, log_scale, angle])
            pictures.append(self._shifted(stage, move))
            x = stage.block * np.tile(shifts, len(shifts)) * np.exp(move[2])
            y = stage.block * np.repeat(shifts, len(shifts)) * np.exp(move[2])
            c, s = np.cos(move[3]), np.sin(move[3])
            there = np.column_stack([move[0] + c * x - s * y, move[1] + s * x + c * y])
            moves.append(np.column_stack([there, np.tile(move[2:], (len(x), 1))]))
        all_moves = np.concatenate(moves)
        sums = _core.contour_template_scores(np.concatenate(pictures), templates)
        larger = np.exp(2 * all_moves[:, 2]).astype(np.float32) * (stage.block**2 / AREA)
        return 1 + sums * larger[:, None] + self._priors(all_moves)[:, None], all_moves

    def _priors(self, moves: Array) -> Picture:
        place = (moves[:, :2] @ self._step.T) / self._off[0]
        size = moves[:, 2] / self._off[1]
        # As squares where they are small, then as lengths: what has moved otherwise than before is not impossible.
        off = np.sqrt(1 + (place**2).sum(axis=1)) + np.sqrt(1 + size**2) - 2
        return np.asarray(PRIOR * off + TURNED * moves[:, 3] ** 2, np.float32)

    def _shifted(self, stage: Stage, move: Array) -> Picture:
        """(shifts, stage.length): the evidence for one move, and for its shifts by whole blocks."""
        import cv2

        side, reach = FRAME // stage.block, stage.reach
        n = FRAME + 2 * reach * stage.block
        c, s = np.exp(move[2]) * np.cos(move[3]), np.exp(move[2]) * np.sin(move[3])
        linear = np.array([[c, -s], [s, c]])
        middle = (FRAME - 1) / 2
        # From pixels of the enlarged frame to those of the evidence.
        first = linear @ (np.full(2, -reach * stage.block - middle)) + move[:2] + middle + MARGIN_PX
        image = cv2.warpAffine(
            self._evidence,
            np.column_stack([linear, first]),
            (n, n),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
        blocks = n // stage.block
        cut = cv2.resize(image, (blocks, blocks), interpolation=cv2.INTER_AREA)
        windows = np.lib.stride_tricks.sliding_window_view(cut, (side, side), axis=(0, 1))
        return np.asarray(windows.reshape((2 * reach + 1) ** 2, -1), np.float32)


def _blocks(picture: Picture, block: int) -> Picture:
    """Means of blocks."""
    n = picture.shape[0] // block
    return np.asarray(picture.reshape(n, block, n, block).mean(axis=(1, 3)), dtype=np.float32)
