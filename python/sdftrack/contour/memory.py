# SPDX-License-Identifier: MIT
"""A memory of an object's silhouettes: detects occlusion and recovers occluded parts (thesis, chapter 6)."""

from __future__ import annotations

import os
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal import saved_file
from sdftrack._internal.array_equality import same
from sdftrack._internal.thread_guard import ReentrantLock, one_thread
from sdftrack._internal.unknown_option import refuses_unknown
from sdftrack._internal.validation import whole
from sdftrack.contour.dct import Order, checked_mask, resampled
from sdftrack.contour.harmonic_regression import HarmonicRegression, checked_lwpr
from sdftrack.contour.result import Assessment, Judgement

Mask: TypeAlias = NDArray[np.bool_]
Rule: TypeAlias = Literal["remembered", "printed", "regressed"]
FILE = saved_file.FileKind("sdftrack.ShapeMemory", 1, "ShapeMemory.save")

MOST_CLOCK = 2**62  # of a count of silhouettes


@refuses_unknown
class ShapeMemory:
    """Learns unoccluded silhouettes of one object; detects and recovers occluded ones.

    Parameters
    ----------
    n_harmonics : int
        Number of harmonics that describe a silhouette, 2 to 32.
    n_inputs : int
        Number of the highest harmonics that predict the others; 1 to n_harmonics - 1. For "printed" and "regressed".
    rule : {"remembered", "printed", "regressed"}
        How occluded parts are recovered. "printed": low harmonics are regressed from high ones by LWPR and judged by
        Table 6.3, that is, by the residuals of what has been learned. "regressed": the same, judged by the errors of
        silhouettes before they were learned, so that a new pose in a video is not taken for an occluded one.
        "remembered": stored silhouettes explain the visible part, given that an occluder only removes area; better in
        every measurement (docs/shape_memory.md).
    order : {"max", "sum"}
        Definition of a harmonic, see `st.contour.harmonics`.
    size : int
        Side of the memory's grid, 16 to 256 pixels.
    capacity, spacing : int, float
        Maximum number of stored silhouettes, and minimum dissimilarity of two of them (symmetric difference over area).
        "remembered".
    max_occluders : int
        A silhouette with more occluders than this (a fence, say) is "novel". "remembered".
    calibrate_on : int
        Number of known silhouettes whose error sets the threshold, which is then fixed. "remembered".
    w_gen, reach, settle : float, float, int
        Activation below which a silhouette is unknown; scale of the fields' metric, D = reach / n_inputs; number of
        silhouettes that set the scale of the inputs, which is then fixed. "printed", "regressed".
    lwpr : dict
        Further options of `st.contour.LWPR`. "printed", "regressed".

    Masks must be given in a frame that moves with the object: a tracker's grid, or `st.contour.align`. All masks of a
    memory have the same shape. ``rule``, sizes and thresholds cannot be changed later.

    Examples
    --------
    >>> memory = st.contour.ShapeMemory()
    >>> for mask in masks: memory.learn(mask)
    >>> memory.judge(hidden), memory.recover(hidden)
    """

    def __init__(
        self,
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
        lwpr: dict[str, Any] | None = None,
    ) -> None:
        given = dict(locals())
        self._options = _core.MemoryOptions(**{name: given[name] for name in _core.MemoryOptions().to_dict()})
        self._lwpr = checked_lwpr({} if lwpr is None else lwpr, self._options.rule)
        self._start()

    def _start(self) -> None:
        o = self._options
        self._lock = ReentrantLock()
        self._shape: tuple[int, int] | None = None
        self._engine: _core.SilhouetteMemory | HarmonicRegression = (
            _core.SilhouetteMemory(o) if o.rule == "remembered" else HarmonicRegression(o, self._lwpr)
        )

    # Learning

    @one_thread("shape memory")
    def learn(self, mask: ArrayLike) -> None:
        """Learn a silhouette that is known to be unoccluded.

        Parameters
        ----------
        mask : (H, W) array, bool or uint8
            Nonzero: inside. The first mask fixes the shape of all masks.

        Raises
        ------
        TypeError, ValueError
            Unsupported dtype, not an image, nothing inside or nothing outside, or a shape that differs from the first
            mask's.
        """
        given = self._checked(mask)
        on_grid = self._on_grid(given)
        self._engine.learn(on_grid)
        self._shape = given.shape

    def observe(self, mask: ArrayLike) -> Assessment:
        """Judge a silhouette and learn it if it is unoccluded, as a tracker does after its first frames."""
        said = self.assess(mask)
        if said.judgement == "unoccluded":
            self.learn(mask)
        return said

    # Asking

    def judge(self, mask: ArrayLike) -> Judgement:
        """ "unoccluded", "occluded" or "novel" (Table 6.3); errors as `assess`."""
        return self.assess(mask).judgement

    def recover(self, mask: ArrayLike) -> Mask:
        """(H, W) bool: the recovered silhouette if `mask` is judged occluded and what is hidden is not in doubt, else
        `mask`; errors as in `assess`."""
        return self.assess(mask).mask

    @one_thread("shape memory")
    def assess(self, mask: ArrayLike) -> Assessment:
        """Judge and recover in a single call.

        Parameters
        ----------
        mask : (H, W) array, bool or uint8
            Nonzero: inside. Must have the shape of the learned masks.

        Returns
        -------
        Assessment
            `.judgement`, `.mask`, `.completed`, `.error`, `.threshold`, `.known`, `.doubt`, `.coefficients`, `.std`.

        Raises
        ------
        TypeError, ValueError
            As in `learn`.
        RuntimeError
            Nothing has been learned; another thread is using the memory.
        """
        given = self._checked(mask)
        if self.n_learnt == 0:
            raise RuntimeError(
                "memory: nothing has been learned; call learn(mask) with unoccluded silhouettes first"
            )
        on_grid = self._on_grid(given)
        if isinstance(self._engine, HarmonicRegression):
            return self._engine.assess(given, on_grid)
        said = self._engine.assess(on_grid)
        completed = given | self._back(said["hidden"], given.shape)
        return Assessment(
            said["judgement"], completed if said["accepted"] else given, completed, said["coefficients"],
            said["std"], said["error"], said["threshold"], said["known"], said["doubt"],
        )  # fmt: skip

    @one_thread("shape memory")
    def judge_frame(
        self,
        occlusions: _core.OcclusionHandler,
        tracker: _core.ContourCore,
        image: NDArray[np.uint8],
        burn_in: bool,
    ) -> tuple[_core.ShapeJudgement, Mask | None]:
        """For `ContourTracker`: the judgement of the shape that it sees, and the recovered shape, if any."""
        assert isinstance(self._engine, _core.SilhouetteMemory)
        return occlusions.judge(tracker, image, burn_in, self._engine)

    # What it is

    @property
    def threshold(self) -> float:
        """Error from which a silhouette is "occluded": sqrt(2) times the training error."""
        return self._engine.threshold

    @property
    def n_learnt(self) -> int:
        """Number of silhouettes learned."""
        return self._engine.learnt

    @property
    def n_kept(self) -> int:
        """Number of silhouettes stored; 0 with ``rule="printed"``, which stores none."""
        return self._engine.count

    @property
    def shape(self) -> tuple[int, int] | None:
        """(H, W) of all masks; None before the first one."""
        if self._shape is None and self.n_learnt:  # by a tracker, on the memory's own grid
            return self._options.size, self._options.size
        return self._shape

    @property
    def shapes(self) -> _core.SilhouetteMemory | None:
        """The stored silhouettes, for a tracker; None with ``rule="printed"``."""
        return self._engine if isinstance(self._engine, _core.SilhouetteMemory) else None

    @property
    def options(self) -> _core.MemoryOptions:
        """The options of the memory, without those of `lwpr`; frozen."""
        return self._options

    def __repr__(self) -> str:
        o = self._options
        what = f"{o.n_harmonics} harmonics" + (f", {o.n_inputs} inputs" if o.rule != "remembered" else "")
        kept = f", {self.n_kept} kept" if o.rule == "remembered" else ""
        return f'ShapeMemory("{o.rule}", {what}, {self.n_learnt} learnt{kept})'

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ShapeMemory):
            return NotImplemented
        return same(self.__getstate__(), other.__getstate__())

    __hash__ = None  # type: ignore[assignment]

    # Files

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write options and learned state to a file, completely or not at all."""
        saved_file.write(path, FILE, self.__getstate__())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ShapeMemory:
        """Load a file written by `save`. FileNotFoundError; ValueError for another, a newer or a damaged file."""
        return saved_file.loaded(path, FILE, cls, dict)

    @one_thread("shape memory")
    def __getstate__(self) -> dict[str, Any]:
        engine = self._engine.state()
        counts = [engine.pop("learnt"), engine.pop("calibrated"), *(self.shape or (0, 0))]
        return {"options": {**self._options.to_dict(), "lwpr": self._lwpr}, "counts": np.array(counts, np.int64),
                **{k: v if isinstance(v, bytes) else np.asarray(v) for k, v in engine.items()}}  # fmt: skip

    def __setstate__(self, state: dict[str, Any]) -> None:
        options = dict(state["options"])
        self._lwpr = options.pop("lwpr")
        self._options = _core.MemoryOptions(**options)
        self._start()
        learnt, calibrated, height, width = (int(x) for x in state["counts"])
        self._shape = (height, width) if height else None
        if isinstance(self._engine, HarmonicRegression):
            self._engine.restore(learnt, calibrated, state)
            return
        clock = whole(int(state["clock"]), "clock", 0, MOST_CLOCK)
        self._engine.restore(
            learnt, calibrated, float(state["squares"]), state["kept"], state["unlike"], state["ages"], clock
        )

    # Between the caller's masks and the memory's grid

    def _checked(self, mask: ArrayLike) -> Mask:
        given = checked_mask(mask)
        if self.shape is not None and given.shape != self.shape:
            raise ValueError(
                f"mask: expected the shape of the learned masks, {self.shape}, got {given.shape}; a memory belongs to "
                "one grid: resample the mask or make another memory"
            )
        return given

    def _on_grid(self, given: Mask) -> Mask:
        size = self._options.size
        if given.shape == (size, size):
            return np.ascontiguousarray(given)
        on_grid = np.asarray(resampled(given, size) > 0.5)
        if not on_grid.any() or on_grid.all():
            what = "inside" if not on_grid.any() else "outside"
            raise ValueError(
                f"mask: expected something {what} on a grid of {size} x {size}, nothing is left after resampling; "
                "crop closer to the object, or use a larger size"
            )
        return on_grid

    def _back(self, on_grid: Mask, shape: tuple[int, ...]) -> Mask:
        """Convert a mask of the grid to the caller's shape."""
        if on_grid.shape == shape:
            return on_grid
        import cv2

        image = cv2.resize(on_grid.astype(np.float32), (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
        return np.asarray(image > 0.5)
