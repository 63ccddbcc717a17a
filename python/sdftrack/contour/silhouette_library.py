# SPDX-License-Identifier: MIT
"""A library of unoccluded silhouettes, and how they explain a partly occluded one (docs/shape_memory.md).

An occluder takes pixels away from a silhouette and adds none. A stored silhouette therefore explains an observed one as
far as the observed one does not extend beyond it; what it has in excess may be hidden. In contrast to the regression of
thesis 6.3.4, no harmonic of the observed silhouette has to be correct.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdftrack._internal.validation import whole
from sdftrack.contour.alignment import COARSE as COARSE_STAGE
from sdftrack.contour.alignment import FINE as FINE_STAGE
from sdftrack.contour.alignment import Stage, template
from sdftrack.contour.dct import Order, block_of, count
from sdftrack.contour.masks import signed_distances

Array: TypeAlias = NDArray[np.float32]
Mask: TypeAlias = NDArray[np.bool_]

MOST_CLOCK = 2**62  # of a count of silhouettes
REACH_PX = 4.0  # distances are cut there: farther away only the sign matters
STEPS_PER_PX = 16  # distances are kept as whole numbers of steps, one byte each
COARSE = 2  # pixels per sample of the small pictures that are compared
FINALISTS = 32  # compared by small pictures, after the harmonics have chosen them
SOFTNESS = (2.0, 0.1)  # px, share: silhouettes are averaged whose sticking out differs by about this
MIN_WEIGHT = 0.1  # of the best: less likely ones are left out of the average
SMOOTHING = (
    4.0  # px of blur of the expected distances, for each px that is stuck out by: an unknown pose is vague
)
MIN_BLUR_PX = 0.5  # less than this changes nothing
NEAR_PX = 2.0  # a contour pixel nearer than this to the expected contour is explained
OCCLUDERS_EDGE = 2  # px beside what is hidden, in which the outline is the occluder's
DEEP_PX = 1.5  # deeper than this, a pixel is inside in any pose that is likely
WELL_KNOWN_PX = 0.4  # sticking out per contour pixel, up to which slivers of 2 px are ignored, else of 4 px


@dataclass(frozen=True)
class Explanation:
    """How the stored silhouettes explain an observed one; all masks (size, size), all shares 0 to 1.

    Attributes
    ----------
    completed : mask; the observed silhouette and the hidden part
    hidden : mask; the hidden part alone
    missing : share of the whole that is not visible; slivers of more than 2 px count, even if not in `hidden`
    riddled : share of the interior of the expected silhouette that is neither visible nor explained as hidden
    beyond_px : area of the observed silhouette beyond the best stored one, pixels
    off_px : the same per pixel of its contour
    explained : share of the observed contour that lies on the expected one
    outline : length of that part over the length of the expected contour
    weights, finalists : of the stored silhouettes that were averaged
    """

    completed: Mask
    hidden: Mask
    missing: float
    riddled: float
    beyond_px: float
    off_px: float
    explained: float
    outline: float
    weights: Array
    finalists: NDArray[np.int64]

    @property
    def doubt(self) -> float:
        """Whether `hidden` may be a difference between two poses: these stick out as much as they lack, while an
        occluder only takes away. Area beyond over the hidden area, more if less of the contour is explained."""
        known_px = np.count_nonzero(self.hidden) * self.explained**2
        return float(self.beyond_px / known_px) if known_px else float("inf")


class SilhouetteLibrary:
    """Up to `capacity` silhouettes of one grid, none nearer to another than `spacing`.

    Parameters
    ----------
    n_harmonics, order
        Of the short codes used to find the nearest silhouettes.
    size : int
        Side of the grid, pixels.
    capacity : int
        Maximum number; beyond it, the older of the two most similar silhouettes is replaced.
    spacing : float
        Symmetric difference over area below which a silhouette is considered known and not stored.
    """

    def __init__(self, n_harmonics: int, order: Order, size: int, capacity: int, spacing: float) -> None:
        self.n_harmonics, self.order, self.size = n_harmonics, order, size
        self.capacity, self.spacing = capacity, spacing
        self.count = 0
        small = (size // COARSE) ** 2
        self._codes = np.zeros((capacity, count(n_harmonics, order)), np.float32)
        self._small = np.zeros((capacity, small), np.int16)  # pixels of each sample that are inside
        self._phi = np.zeros((capacity, size * size), np.int8)
        self._areas = np.zeros(capacity, np.float32)
        self._templates = {s: np.zeros((capacity, s.length), np.float32) for s in (COARSE_STAGE, FINE_STAGE)}
        self._unlike = np.full((capacity, capacity), np.inf, np.float32)
        self._ages = np.zeros(capacity, np.int64)
        self._clock = 0

    @property
    def masks(self) -> Mask:
        """(count, size, size) the silhouettes, in storage order."""
        return self._phi[: self.count].reshape(-1, self.size, self.size) < 0

    @property
    def codes(self) -> Array:
        """(count, m) their harmonics."""
        return self._codes[: self.count]

    def add(self, mask: Mask) -> bool:
        """Store a silhouette unless a similar one is stored already; returns whether it was stored."""
        area, n = float(np.count_nonzero(mask)), self.count
        unlike = (np.count_nonzero((self._phi[:n] < 0) != mask.reshape(-1), axis=1) / area).astype(np.float32)
        self._clock += 1
        if n and unlike.min() < self.spacing:
            self._ages[unlike.argmin()] = self._clock  # still in use
            return False
        place = n if n < self.capacity else self._place_to_reuse()
        self.count = max(n, place + 1)
        self._put(place, mask)
        self._unlike[place, :n] = self._unlike[:n, place] = unlike
        self._unlike[place, place] = np.inf
        self._ages[place] = self._clock
        return True

    def _put(self, place: int, mask: Mask) -> None:
        self._codes[place] = block_of(mask, self.n_harmonics, self.order, self.size)
        self._small[place], self._areas[place] = _small(mask), np.count_nonzero(mask)
        phi = np.clip(signed_distances(mask), -REACH_PX, REACH_PX)
        self._phi[place] = np.rint(STEPS_PER_PX * phi).reshape(-1)
        for stage, kept in self._templates.items():
            kept[place] = template(phi, stage)

    def _place_to_reuse(self) -> int:
        """Index of the older of the two most similar silhouettes."""
        pair = np.unravel_index(int(self._unlike.argmin()), self._unlike.shape)
        return int(min(pair, key=lambda k: self._ages[k]))

    def explain(self, mask: Mask) -> Explanation:
        """Explain an observed silhouette by the stored ones; there must be at least one."""
        near, beyond_px = self._nearest(mask)
        least = float(beyond_px.min())  # px
        weights = np.exp((least - beyond_px) / (SOFTNESS[0] + SOFTNESS[1] * least)).astype(np.float32)
        likely = weights >= MIN_WEIGHT
        near, weights = near[likely], weights[likely] / weights[likely].sum()
        phi = np.tensordot(weights, self.distances(near), 1)
        return self.explain_by(mask, phi, least, weights, near)

    def explain_by(
        self,
        mask: Mask,
        phi: Array,
        beyond_px: float,
        weights: Array,
        near: NDArray[np.int64],
        own_edge: bool = False,
    ) -> Explanation:
        """Explain an observed silhouette by an expected one, given by its distances `phi` and the number of observed
        pixels beyond it. `own_edge`: the outline next to the hidden part belongs to the occluder and need not be
        explained."""
        edge = _edge(mask)
        length = np.count_nonzero(edge)
        off_px = beyond_px / length
        phi = _smoothed(phi, SMOOTHING * off_px)
        expected = phi < 0
        completed, hidden = with_hidden(mask, expected, off_px)
        lacking = np.count_nonzero(_thick(expected & ~mask, 1))
        deep = phi < -DEEP_PX
        near_it = edge & (np.abs(phi) < NEAR_PX)
        on_it = np.count_nonzero(near_it)
        theirs = _grown(hidden, OCCLUDERS_EDGE) if own_edge else np.zeros_like(edge)
        own = np.count_nonzero(edge & ~theirs)
        return Explanation(
            completed, hidden,
            missing=lacking / (lacking + np.count_nonzero(mask)),
            riddled=np.count_nonzero(deep & ~completed) / max(1, int(np.count_nonzero(deep))),
            beyond_px=beyond_px,
            off_px=off_px,
            explained=np.count_nonzero(near_it & ~theirs) / max(1, int(own)),
            outline=on_it / max(1, int(np.count_nonzero(_edge(expected)))),
            weights=weights, finalists=near,
        )  # fmt: skip

    def templates(self, stage: Stage) -> Array:
        """(count, stage.length) the templates for searching an image."""
        return self._templates[stage][: self.count]

    def distances(self, places: NDArray[np.int64]) -> Array:
        """(k, size, size) signed distances of some of them, pixels, truncated at REACH_PX."""
        some = self._phi[places].astype(np.float32) / np.float32(STEPS_PER_PX)
        return np.asarray(some.reshape(-1, self.size, self.size))

    def dissimilarity(self, mask: Mask) -> Array:
        """(count,) symmetric difference to a mask of the grid over its area, from the downsampled images."""
        small, per = _small(mask).astype(np.float32), COARSE * COARSE
        common = self._small[: self.count].astype(np.float32) @ small / per
        area = max(1.0, float(small.sum()))
        return np.asarray((self._areas[: self.count] + small.sum() - 2 * common) / area, np.float32)

    def state(self) -> dict[str, Any]:
        """The learned state, as arrays; masks as bits."""
        n = self.count
        return {
            "kept": np.packbits(self.masks.reshape(n, self.size * self.size), axis=1),
            "unlike": self._unlike[:n, :n].copy(),
            "ages": self._ages[:n].copy(),
            "clock": np.array(self._clock),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restore what `state` returned."""
        n = len(state["kept"])
        bits = np.unpackbits(state["kept"], axis=1, count=self.size * self.size).astype(bool)
        for k, mask in enumerate(bits.reshape(n, self.size, self.size)):
            self._put(k, mask)
        self.count = n
        self._unlike[:n, :n] = state["unlike"]
        self._ages[:n] = state["ages"]
        self._clock = whole(int(state["clock"]), "clock", 0, MOST_CLOCK)

    def _nearest(self, mask: Mask) -> tuple[NDArray[np.int64], Array]:
        """The FINALISTS beyond which the observed silhouette extends least, and by how many pixels each.

        With f = +1 inside and -1 outside, the product of two pictures over all pixels is that of their series, and
        4 |a and b| = f_a . f_b + 2 |a| + 2 |b| - size^2: the harmonics preselect, the downsampled images decide.
        """
        n = self.count
        near = np.arange(n)
        if n > FINALISTS:
            code = block_of(mask, self.n_harmonics, self.order, self.size).astype(np.float32)
            in_common = self._codes[:n] @ code + 2 * self._areas[:n]
            near = np.argpartition(in_common, n - FINALISTS)[n - FINALISTS :]
        excess = np.maximum(_small(mask) - self._small[near], 0)
        return near, excess.sum(axis=1, dtype=np.int32).astype(np.float32)


def _small(mask: Mask) -> NDArray[np.int16]:
    """Pixels inside, in blocks of COARSE x COARSE; a last odd row or column is left out."""
    side = mask.shape[0] // COARSE
    cut = mask[: COARSE * side, : COARSE * side].astype(np.int16)
    return np.asarray(sum(cut[i::COARSE, j::COARSE] for i in range(COARSE) for j in range(COARSE))).reshape(
        -1
    )


def with_hidden(seen: Mask, expected: Mask, off_px: float | None = None) -> tuple[Mask, Mask]:
    """The seen part together with the hidden part, and the hidden part alone.

    Slivers along the seen contour are differences between two poses: up to 2 px thick they are ignored, up to 4 px if
    the visible silhouette extends far beyond the expected one (`off_px` per contour pixel; None: measured here).
    """
    if off_px is None:
        off_px = np.count_nonzero(seen & ~expected) / max(1, int(np.count_nonzero(_edge(seen))))
    hidden = _thick(expected & ~seen, 1 if off_px < WELL_KNOWN_PX else 2)
    return seen | hidden, hidden


def _thick(mask: Mask, sliver: int) -> Mask:
    """The parts thicker than 2 `sliver` pixels, including their rim."""
    import cv2

    image, square = mask.astype(np.uint8), np.ones((3, 3), np.uint8)
    core = cv2.erode(image, square, iterations=sliver, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    whole = np.asarray(cv2.dilate(core, square, iterations=sliver + 1))
    return mask & (whole > 0)


def _grown(mask: Mask, by: int) -> Mask:
    """Dilate by this many pixels."""
    import cv2

    square = np.ones((2 * by + 1, 2 * by + 1), np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), square) > 0)


def _smoothed(phi: Array, sigma_px: float) -> Array:
    """Distances smoothed in proportion to the error of the silhouettes that they come from."""
    import cv2

    if sigma_px < MIN_BLUR_PX:
        return phi
    return np.asarray(cv2.GaussianBlur(phi, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE), np.float32)


def _edge(mask: Mask) -> Mask:
    """Pixels inside that have one of their four neighbours outside."""
    inside = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), bool)
    inside[1:-1, 1:-1] = mask
    deep = inside[:-2, 1:-1] & inside[2:, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    return mask & ~deep
