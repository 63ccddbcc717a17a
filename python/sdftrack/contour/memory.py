# SPDX-License-Identifier: MIT
"""A memory of the silhouettes of one moving object: is this one whole, what is hidden of it (thesis chapter 6)?"""

from __future__ import annotations

import os
import threading
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack._internal.option_declarations import schema_of
from sdftrack._internal.thread_guard import SingleThreadGuard
from sdftrack._internal.unknown_option import refuses_unknown
from sdftrack.contour import memory_file
from sdftrack.contour.assessment import Assessment, Judgement
from sdftrack.contour.dct import Order, block_of, series
from sdftrack.contour.harmonic_regression import HarmonicRegression
from sdftrack.contour.masks import checked_mask, resampled
from sdftrack.contour.memory_options import MemoryOptions
from sdftrack.contour.occluders import count_occluders
from sdftrack.contour.silhouette_library import Explanation, SilhouetteLibrary

__all__ = ["Rule", "ShapeMemory"]

Mask: TypeAlias = NDArray[np.bool_]
Rule: TypeAlias = Literal["remembered", "printed"]

FIRST = 5  # silhouettes, from which on the error of the next one is taken for that of a known shape
MIN_KNOWN = 0.5  # of the details; less is "novel" (Table 6.3: more than half of the units)
MIN_OUTLINE = 0.2  # of the expected outline; when less of it is seen, all details are hidden
MAX_OFF_PX = 2.0  # sticking out of what is expected, per contour pixel of a 64 x 64 grid
MAX_RIDDLED = 0.15  # of the inside, neither seen nor in one piece hidden: leaves, slats, holes
MIN_ERROR = 0.02  # share not seen, up to which a difference is that of two outlines of one shape


@refuses_unknown
class ShapeMemory:
    """Learns whole silhouettes of one object; tells hidden ones and recovers them.

    Parameters
    ----------
    n_harmonics : int
        Harmonics of a silhouette that are used, 2 to 32.
    n_inputs : int
        How many of them, the highest, predict the others; 1 to n_harmonics - 1. For ``rule="printed"``.
    rule : {"remembered", "printed"}
        How hidden parts are found. "printed": low harmonics regressed from high ones by LWPR, judged by
        Table 6.3. "remembered": the silhouettes themselves are kept and explain what is seen, given that an
        occluder only takes away; better in every measurement (docs/shape_memory.md).
    order : {"max", "sum"}
        What a harmonic is, see `st.contour.harmonics`.
    size : int
        Side of the memory's grid, 16 to 256 pixels.
    capacity, spacing : int, float
        Silhouettes kept at most, and how unlike two must be (symmetric difference over area). "remembered".
    max_occluders : int
        More things than this before the object, a fence say: "novel". "remembered".
    calibrate_on : int
        The error of the first so many known silhouettes sets the threshold, which then stays. "remembered".
    w_gen, reach, settle : float, float, int
        Activation below which nothing is known; how far a silhouette is known around it; silhouettes that set the
        scale of the inputs, which then stays. "printed".
    lwpr : dict
        Further options of `st.contour.LWPR`. "printed".

    Masks come in one frame that moves with the object: a tracker's grid, or `st.contour.align`. All masks of one
    memory have the same shape. ``rule``, sizes and thresholds cannot change later.

    Examples
    --------
    >>> memory = st.contour.ShapeMemory()
    >>> for mask in masks: memory.learn(mask)
    >>> memory.judge(hidden), memory.recover(hidden)
    """

    def __init__(
        self,
        # options: written by bindings/generate_options.py
        n_harmonics: int = 10,
        n_inputs: int = 3,
        *,
        rule: Rule = "remembered",
        order: Order = "max",
        size: int = 64,
        capacity: int = 256,
        spacing: float = 0.02,
        max_occluders: int = 2,
        calibrate_on: int = 100,
        w_gen: float = 0.1,
        reach: float = 0.1,
        settle: int = 20,
        # options: end
        lwpr: dict[str, Any] | None = None,
    ) -> None:
        given = dict(locals())
        options = {name: given[name] for name in schema_of("memory")}
        self._options = MemoryOptions(**options, lwpr={} if lwpr is None else lwpr)
        self._start()

    def _start(self) -> None:
        o = self._options
        self._lock = threading.Lock()
        self._shape: tuple[int, int] | None = None
        self._learnt = 0
        self._calibrated, self._squares = 0, 0.0
        self._shapes: SilhouetteLibrary | None = None
        self._regression: HarmonicRegression | None = None
        if o.rule == "remembered":
            self._shapes = SilhouetteLibrary(o.n_harmonics, o.order, o.size, o.capacity, o.spacing)
        else:
            self._regression = HarmonicRegression(
                o.n_harmonics, o.n_inputs, o.order, o.w_gen, o.reach, o.settle, o.lwpr
            )

    # Learning

    def learn(self, mask: ArrayLike) -> None:
        """Learn a silhouette that is known to be whole.

        Parameters
        ----------
        mask : (H, W) array, bool or uint8
            Not 0: inside. The first one fixes the shape of all.

        Raises
        ------
        TypeError, ValueError
            Another dtype, no image, nothing inside or nothing outside, or another shape than the first one's.
        """
        given = self._checked(mask)
        on_grid = self._on_grid(given)
        with SingleThreadGuard(self._lock, "shape memory"):
            if self._shapes is not None:
                self._learn_shape(self._shapes, on_grid)
            elif self._regression is not None:
                self._regression.learn(self._code(on_grid))
            self._shape = given.shape
            self._learnt += 1

    def _learn_shape(self, shapes: SilhouetteLibrary, on_grid: Mask) -> None:
        if shapes.count >= FIRST and self._calibrated < self._options.calibrate_on:
            said = shapes.explain(on_grid)  # before it is kept: the error on a silhouette that is new
            if not self._is_novel(said, on_grid):
                self._calibrated += 1
                self._squares += said.missing**2
        shapes.add(on_grid)

    def observe(self, mask: ArrayLike) -> Assessment:
        """Judge a silhouette and learn it if it is whole: the loop of a tracker after its first frames."""
        said = self.assess(mask)
        if said.judgement == "unoccluded":
            self.learn(mask)
        return said

    # Asking

    def judge(self, mask: ArrayLike) -> Judgement:
        """ "unoccluded", "occluded" or "novel" (Table 6.3); errors as `assess`."""
        return self.assess(mask).judgement

    def recover(self, mask: ArrayLike) -> Mask:
        """(H, W) bool: the whole silhouette where `mask` is judged occluded, else `mask`; errors as `assess`."""
        return self.assess(mask).mask

    def assess(self, mask: ArrayLike) -> Assessment:
        """Judge and recover in one go.

        Parameters
        ----------
        mask : (H, W) array, bool or uint8
            Not 0: inside. Of the shape of the masks learnt.

        Returns
        -------
        Assessment
            `.judgement`, `.mask`, `.completed`, `.error`, `.threshold`, `.known`, `.coefficients`, `.std`.

        Raises
        ------
        TypeError, ValueError
            As `learn`.
        RuntimeError
            Nothing has been learnt; another thread is using the memory.
        """
        given = self._checked(mask)
        if self._learnt == 0:
            raise RuntimeError(
                "memory: nothing has been learnt; call learn(mask) with whole silhouettes first"
            )
        on_grid = self._on_grid(given)
        with SingleThreadGuard(self._lock, "shape memory"):
            if self._shapes is not None:
                return self.judged(given, on_grid, self._shapes.explain(on_grid))
            assert self._regression is not None
            return self._printed(self._regression, given, on_grid)

    def judged(self, given: Mask, on_grid: Mask, said: Explanation, least_piece: float = 0.0) -> Assessment:
        """What an explanation of a mask comes to, by rule "remembered".

        `on_grid` is the mask on the memory's grid; pieces that are hidden count as occluders from `least_piece` times
        the largest on.
        """
        assert self._shapes is not None
        threshold = self.threshold
        # Slivers that may be another pose raise the error, but where nothing is to be recovered nothing is occluded.
        occluded = said.missing >= threshold and said.hidden.any()
        judgement: Judgement = "occluded" if occluded else "unoccluded"
        if self._is_novel(said, on_grid, least_piece):
            judgement = "novel"
        completed = given | self._back(said.hidden, given.shape)
        codes = self._shapes.codes[said.finalists]
        std = np.sqrt(said.weights @ (codes - said.weights @ codes) ** 2)
        return Assessment(
            judgement, completed if judgement == "occluded" else given, completed, self._code(said.completed),
            std.astype(np.float64) * bool(said.missing), said.missing, threshold, min(1.0, said.explained),
        )  # fmt: skip

    def _printed(self, regression: HarmonicRegression, given: Mask, on_grid: Mask) -> Assessment:
        code = self._code(on_grid)
        if not regression.ready:
            return Assessment("novel", given, given, code, np.zeros(len(code)), 0.0, np.inf, 0.0)
        said = regression.explain(code)
        threshold = self.threshold
        completed = series(said.coefficients, given.shape, self._options.order) > 0
        judgement: Judgement = "occluded" if said.error >= threshold else "unoccluded"
        if said.active < MIN_KNOWN or not completed.any():
            judgement = "novel"
        return Assessment(
            judgement, completed if judgement == "occluded" else given, completed, said.coefficients, said.std,
            said.error, threshold, said.active,
        )  # fmt: skip

    def _is_novel(self, said: Explanation, on_grid: Mask, least_piece: float = 0.0) -> bool:
        """Too little of what is seen has been seen before, too little is seen, or too many things are before it."""
        return bool(
            said.explained < MIN_KNOWN
            or said.outline < MIN_OUTLINE
            or said.riddled > MAX_RIDDLED
            or said.off_px > MAX_OFF_PX * self._options.size / 64
            or count_occluders(said.hidden, on_grid, least_piece) > self._options.max_occluders
        )

    # What it is

    @property
    def threshold(self) -> float:
        """The error from which on a silhouette is "occluded": the square root of 2 times that of training."""
        if self._regression is not None:
            return np.sqrt(2) * self._regression.training_error() if self._regression.ready else np.inf
        rms = np.sqrt(self._squares / self._calibrated) if self._calibrated else 0.0
        return float(np.sqrt(2) * max(MIN_ERROR, rms))

    @property
    def n_learnt(self) -> int:
        """Silhouettes learnt."""
        return self._learnt

    @property
    def n_kept(self) -> int:
        """Silhouettes kept; 0 with ``rule="printed"``, which keeps none."""
        return self._shapes.count if self._shapes is not None else 0

    @property
    def shape(self) -> tuple[int, int] | None:
        """(H, W) of the masks learnt, that all others must have; None before the first."""
        return self._shape

    @property
    def shapes(self) -> SilhouetteLibrary | None:
        """The silhouettes kept; None with ``rule="printed"``. For a tracker; what changes them is `learn`."""
        return self._shapes

    @property
    def options(self) -> MemoryOptions:
        """What it was made with; frozen."""
        return self._options

    def __repr__(self) -> str:
        o = self._options
        what = f"{o.n_harmonics} harmonics" + (f", {o.n_inputs} inputs" if o.rule == "printed" else "")
        kept = f", {self.n_kept} kept" if o.rule == "remembered" else ""
        return f'ShapeMemory("{o.rule}", {what}, {self._learnt} learnt{kept})'

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ShapeMemory):
            return NotImplemented
        return memory_file.to_bytes(self.__getstate__()) == memory_file.to_bytes(other.__getstate__())

    __hash__ = None  # type: ignore[assignment]

    # Files

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write options and all that was learnt to a file, whole or not at all."""
        memory_file.write(path, self.__getstate__())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ShapeMemory:
        """Read what `save` wrote. FileNotFoundError; ValueError for another, a newer or a damaged file."""
        state = memory_file.read(path)
        memory = cls.__new__(cls)
        try:
            memory.__setstate__(state)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise ValueError(
                f"{path}: expected a shape memory, its contents do not fit together ({error})"
            ) from None
        return memory

    def __getstate__(self) -> dict[str, Any]:
        with SingleThreadGuard(self._lock, "shape memory"):
            return self._state()

    def _state(self) -> dict[str, Any]:
        state: dict[str, Any] = {
            "options": self._options.to_dict(),
            "counts": np.array([self._learnt, self._calibrated, *(self._shape or (0, 0))], np.int64),
            "squares": np.array(self._squares),
        }
        engine: Any = self._shapes if self._shapes is not None else self._regression
        return {**state, **engine.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._options = MemoryOptions(**state["options"])
        self._start()
        learnt, calibrated, height, width = (int(x) for x in state["counts"])
        self._learnt, self._calibrated, self._squares = learnt, calibrated, float(state["squares"])
        self._shape = (height, width) if height else None
        engine: Any = self._shapes if self._shapes is not None else self._regression
        engine.restore(state)

    # Between the caller's masks and the memory's grid

    def _checked(self, mask: ArrayLike) -> Mask:
        given = checked_mask(mask)
        if self._shape is not None and given.shape != self._shape:
            raise ValueError(
                f"mask: expected the shape of those learnt, {self._shape}, got {given.shape}; a memory belongs to "
                "one grid: resample the mask or make another memory"
            )
        return given

    def _on_grid(self, given: Mask) -> Mask:
        size = self._options.size
        if given.shape == (size, size):
            return given
        on_grid = np.asarray(resampled(given, size) > 0.5)
        if not on_grid.any() or on_grid.all():
            what = "inside" if not on_grid.any() else "outside"
            raise ValueError(
                f"mask: expected something {what} on a grid of {size} x {size}, nothing is left of it; "
                "cut closer to the object, or take a larger size"
            )
        return on_grid

    def _back(self, on_grid: Mask, shape: tuple[int, ...]) -> Mask:
        """A mask of the grid in the caller's shape."""
        if on_grid.shape == shape:
            return on_grid
        import cv2

        image = cv2.resize(on_grid.astype(np.float32), (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
        return np.asarray(image > 0.5)

    def _code(self, on_grid: Mask) -> NDArray[np.float64]:
        o = self._options
        return block_of(on_grid, o.n_harmonics, o.order, o.size)
