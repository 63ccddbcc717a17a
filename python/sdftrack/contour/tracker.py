# SPDX-License-Identifier: MIT
"""Segmentation of a deforming object in video, from a box or a mask in the first frame."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any, Protocol, TypeAlias, get_args

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdftrack import _core
from sdftrack._internal.thread_guard import ReentrantLock, one_thread
from sdftrack._internal.validation import whole
from sdftrack.contour.memory import ShapeMemory
from sdftrack.contour.options import checked_box, checked_image, checked_part, contour_options
from sdftrack.contour.result import ContourResult, Evidence, Judgement
from sdftrack.device import device_number
from sdftrack.results import Status

Mask = NDArray[np.bool_]
MARGIN = 0.4  # of the longer side of the object's box, around it
MIN_MARGIN_PX = 16
MIN_SIDE_PX = 32  # of an image whose flow can be computed
MAX_SIDE_PX = 160  # a larger part is examined at a lower resolution


# (h, w, 2) float32, (x, y): how far the place of each pixel in the last image is from it, of a part; its corner x0, y0.
BackwardFlow: TypeAlias = tuple[NDArray[np.float32], int, int]


class ImageFlow:
    """Dense inverse search (OpenCV's DIS) on the part of each image around the object."""

    def __init__(self, image: NDArray[np.uint8]) -> None:
        self._last = _gray(image)
        self._dis = _dense_inverse_search()

    def __getstate__(self) -> NDArray[np.uint8]:
        return self._last

    def __setstate__(self, last: NDArray[np.uint8]) -> None:
        self._last, self._dis = last, _dense_inverse_search()

    def next(self, image: NDArray[np.uint8], mask: Mask) -> BackwardFlow | None:
        """Flow from this image to the last one around the last mask; None if that is empty or the part too small."""
        before, self._last = self._last, _gray(image)
        if not mask.any():
            return None
        rows, columns = _around(mask)
        a, b = before[rows, columns], self._last[rows, columns]
        height, width = a.shape
        scale = min(1.0, MAX_SIDE_PX / max(a.shape))
        if min(a.shape) * scale < MIN_SIDE_PX:
            return None
        small = (round(scale * width), round(scale * height))
        back = self._dis.calc(_resized(b, small), _resized(a, small), None)
        if scale < 1:
            back = cv2.resize(back, (width, height))
            # By rows of pairs: a product over a last axis of two is ten times slower.
            pairs = np.tile(np.array([width / small[0], height / small[1]], np.float32), width)
            np.multiply(back.reshape(height, -1), pairs, out=back.reshape(height, -1))
        return np.ascontiguousarray(back, np.float32), columns.start, rows.start


def _dense_inverse_search() -> Any:
    dis: Any = cv2  # OpenCV's stubs lack it
    out = dis.DISOpticalFlow_create(dis.DISOPTICAL_FLOW_PRESET_FAST)
    out.setFinestScale(1)
    return out


def _gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)


def _around(mask: Mask) -> tuple[slice, slice]:
    """Rows and columns of the mask and its surroundings."""
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    margin = max(MIN_MARGIN_PX, round(MARGIN * max(w, h)))
    height, width = mask.shape
    rows = slice(max(0, y - margin), min(height, y + h + margin))
    return rows, slice(max(0, x - margin), min(width, x + w + margin))


def _resized(image: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


JUDGEMENTS = get_args(Judgement)


class Memory(Protocol):
    """Interface of a shape memory. Masks are bool, on the tracker's grid: (ny, nx), always of the same size."""

    def learn(self, mask: NDArray[np.bool_]) -> Any: ...
    def judge(self, mask: NDArray[np.bool_]) -> str: ...
    def recover(self, mask: NDArray[np.bool_]) -> NDArray[Any]: ...


class ContourTracker:
    """Track a deforming object in colour video by pixel-wise posteriors (thesis 6.3; Bibby and Reid, ECCV 2008).

    For each frame, the object's grid is registered (a similarity or affine transform, Gauss-Newton), its outline
    evolves by a few level-set steps, drift of the grid is corrected, and the histograms of object and surroundings are
    updated. docs/math/contour.md derives the method. A frame is processed by one thread.

    Parameters
    ----------
    warp : "similarity" or "affine"
        Motion model of the grid: 4 or 6 parameters.
    memory : ShapeMemory or object, optional
        The first `burn_in` frames are learned. Afterwards, an occluded shape is replaced by the recovered one and does
        not change the histograms, an unoccluded one is learned, and a novel one is neither replaced nor learned. A
        `ShapeMemory` with stored silhouettes is queried only if area is missing or the colours are uncertain, and is
        matched to the colours of the image; its silhouettes are normalised as by `st.contour.align`. Any other object
        must provide ``learn(mask)``, ``judge(mask)`` and ``recover(mask)``, and is queried with each mask on the
        tracker's grid.
    burn_in : int
        Number of frames from which the memory learns before it judges; 0 for a trained memory.
    device : {"cpu", "cuda", "cuda:N", "auto"}
        Where the outline evolves; the results are the same. The grid of one object is small: its transfer to a GPU
        takes longer than the steps on the CPU. "auto" selects a GPU if its self-test has passed.
    **options
        Any of ``ContourTracker().options``, which holds the defaults; ``sdftrack config`` describes each
        one.

    Raises
    ------
    TypeError
        An unknown option (the nearest name is suggested) or a value of the wrong type.
    ValueError
        An option out of range, or an unknown device.
    RuntimeError
        ``device="cuda"`` without support in the build or without the device.

    >>> tracker = ContourTracker()
    >>> tracker.start(image, box=(40, 30, 120, 90))  # doctest: +SKIP
    >>> mask = tracker.track(next_image).mask  # doctest: +SKIP
    """

    def __init__(
        self,
        warp: str = "similarity",
        memory: Memory | None = None,
        burn_in: int = 60,
        *,
        device: str = "cpu",
        **options: Any,
    ) -> None:
        settings = contour_options({"warp": warp, **options})
        for name in ("learn", "judge", "recover"):
            if memory is not None and not callable(getattr(memory, name, None)):
                raise TypeError(
                    f"memory: expected an object with learn, judge and recover, got {type(memory).__name__} without "
                    f"{name}"
                )
        self._burn_in: int = whole(burn_in, "burn_in", 0, what="a whole number >= 0")
        self._lock = ReentrantLock()
        self._device = device
        self._core = _core.ContourCore(settings, device_number(device))
        self._memory = memory
        self._shape: tuple[int, ...] | None = None
        self._warp: NDArray[np.float64] = np.eye(3)
        self._frames = 0
        self._judges = settings.confidence == "evidence"
        self._moves = settings.motion == "flow"
        self._flow: ImageFlow | None = None
        self._evidence: _core.EvidenceGatherer | None = None
        self._mask: NDArray[np.bool_] = np.zeros((0, 0), bool)
        # A memory without silhouettes, the printed rule's or a caller's own, is asked about masks of the grid.
        self._occlusions: _core.OcclusionHandler | None = None
        if isinstance(memory, ShapeMemory) and memory.shapes is not None:
            side = memory.options.size
            if memory.shape not in (None, (side, side)):
                raise ValueError(
                    f"memory: expected one trained with masks of {side} x {side}, got one of {memory.shape}; train "
                    f"another with st.contour.align(mask, {side})[0]"
                )
            self._occlusions = _core.OcclusionHandler()

    def __repr__(self) -> str:
        return f"ContourTracker({self.options['warp']!r}, {self._frames} frames)"

    @one_thread("tracker")
    def __getstate__(self) -> dict[str, Any]:
        state = dict(self.__dict__)
        del state["_lock"]
        return {**state, "_core": (self._core.options, self._core.state())}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._lock = ReentrantLock()
        options, core = state["_core"]
        self._core = _core.ContourCore(options, device_number(self._device))
        if not self._core.set_state(core):
            raise ValueError("state: expected a contour tracker of this version, got one of another version")

    def __copy__(self) -> ContourTracker:
        # A memory that both had would learn from both, and either would go on otherwise than alone.
        return copy.deepcopy(self)

    @property
    def options(self) -> dict[str, Any]:
        """All options with their values."""
        return self._core.options.to_dict()

    @property
    def warp(self) -> NDArray[np.float64]:
        """(3, 3): maps the object's current grid to pixels (x, y); the masks passed to a memory are on this grid.

        RuntimeError before `start`.
        """
        if self._shape is None:
            raise RuntimeError("warp: expected start(image, box=...) first, got no start yet")
        return self._warp.copy()

    @one_thread("tracker")
    def start(
        self, image: ArrayLike, box: ArrayLike | None = None, mask: ArrayLike | None = None
    ) -> ContourResult:
        """Start or restart with the object in this image.

        Parameters
        ----------
        image : (H, W, 3) uint8
            RGB.
        box : (x, y, w, h), optional
            In pixels, as tight as possible around the object: everything outside is background.
        mask : (H, W) bool or uint8, optional
            The object's pixels; alternative to `box`.

        Returns
        -------
        ContourResult
            Result for this image.

        Raises
        ------
        TypeError
            The image is not uint8, or the mask is neither bool nor uint8.
        ValueError
            Neither or both of box and mask; a box or mask without object or without background; an image without
            colour.
        """
        rgb = checked_image(image)
        if (box is None) == (mask is None):
            raise ValueError(f"box, mask: expected one of them, got {'none' if box is None else 'both'}")
        unstable = 0.0
        if mask is not None:
            frame = self._core.start_mask(rgb, checked_part(mask, rgb.shape[:2]))
        else:
            place = checked_box(box, rgb.shape[1], rgb.shape[0])
            frame = self._core.start_box(rgb, *place)
            if self._judges:
                unstable = _core.contour_first_instability(rgb, place, frame.mask, self._core.options)
        self._shape, self._warp, self._frames = rgb.shape, frame.warp, 0
        shapes = self._memory.shapes if isinstance(self._memory, ShapeMemory) else None
        if self._occlusions is not None and shapes is not None:
            self._occlusions.begin(self._core, shapes)
        self._mask = frame.mask
        self._flow = ImageFlow(rgb) if self._judges or self._moves else None
        self._evidence = _core.EvidenceGatherer(rgb, frame.mask, unstable) if self._judges else None
        result = self._result(frame, None)
        if box is None or not self._judges:
            return result
        return _with_evidence(result, Evidence(0.0, 0.0, 0.0, unstable, frame.shared))

    @one_thread("tracker")
    def track(self, image: ArrayLike) -> ContourResult:
        """Find the object in the next image.

        Parameters
        ----------
        image : (H, W, 3) uint8
            RGB, of the same size as the first image.

        Raises
        ------
        RuntimeError
            Before `start`.
        TypeError, ValueError
            An image of the wrong type or size.
        """
        if self._shape is None:
            raise RuntimeError("track: expected start(image, box=...) first, got no start yet")
        rgb = checked_image(image)
        if rgb.shape != self._shape:
            raise ValueError(
                f"image: expected the size at the start, {self._shape[1]} x {self._shape[0]}, got "
                f"{rgb.shape[1]} x {rgb.shape[0]}; start again for another video"
            )
        flow = self._flow.next(rgb, self._mask) if self._flow is not None else None
        cue = flow if self._moves else None
        if self._memory is None:
            frame, judgement = self._core.track(rgb, *cue or ()), None
            self._frames += 1
        else:
            frame, judgement = self._track_with(self._memory, rgb, cue)
        self._mask = frame.mask
        return self._judged(self._result(frame, judgement), rgb, flow, frame.shared)

    def _judged(
        self, result: ContourResult, rgb: NDArray[np.uint8], flow: BackwardFlow | None, shared: float
    ) -> ContourResult:
        """The result with the status that the evidence gives it."""
        if self._evidence is None:
            return result
        if result.status == Status.LOST:
            self._evidence.skip(result.mask)
            return result
        gathered = self._evidence.gather(rgb, result.mask, shared, *flow or ())
        return _with_evidence(result, Evidence(*gathered))

    def _track_with(
        self, memory: Memory, rgb: NDArray[np.uint8], flow: BackwardFlow | None
    ) -> tuple[_core.ContourFrame, str | None]:
        seen = self._core.observe(rgb, *flow or ())
        self._warp = seen.warp
        # Should the memory fail, the frame ends and nothing is learned.
        judgement = _core.ShapeJudgement.novel
        recovered: NDArray[np.bool_] | None = None
        try:
            judgement, recovered = self._judge(memory, rgb, seen)
        finally:
            frame = self._core.finish(judgement, recovered)
            self._warp = frame.warp
            self._frames += 1
        return frame, None if judgement == _core.ShapeJudgement.none else judgement.name

    def _judge(
        self, memory: Memory, rgb: NDArray[np.uint8], seen: _core.ContourObservation
    ) -> tuple[_core.ShapeJudgement, NDArray[np.bool_] | None]:
        """The memory's judgement of the segmented shape, and the recovered shape, if any."""
        burn_in = self._frames < self._burn_in
        if self._occlusions is not None and isinstance(memory, ShapeMemory):
            return memory.judge_frame(self._occlusions, self._core, rgb, burn_in)
        if seen.status == "lost":
            return _core.ShapeJudgement.none, None
        mask, sure = seen.phi < 0, seen.status == "ok"
        if not burn_in:
            return _asked(memory, mask, sure)
        if sure:
            memory.learn(mask)
        return _core.ShapeJudgement.none, None

    def _result(self, frame: _core.ContourFrame, judgement: str | None) -> ContourResult:
        self._warp = frame.warp
        return ContourResult(
            frame.mask, frame.warp, frame.phi, Status(frame.status), frame.reason, frame.confidence, judgement
        )


def _with_evidence(result: ContourResult, evidence: Evidence) -> ContourResult:
    # What the colours call lost or weak stays so.
    said, reason, confidence = _core.contour_verdict(evidence, result.status.value, result.reason)
    return replace(result, status=Status(said), reason=reason, confidence=confidence, evidence=evidence)


def _asked(
    memory: Memory, mask: NDArray[np.bool_], sure: bool
) -> tuple[_core.ShapeJudgement, NDArray[np.bool_] | None]:
    """Query a memory: judgement of a mask on the tracker's grid, and the recovered mask if it is occluded."""
    judgement = str(memory.judge(mask))
    if judgement not in JUDGEMENTS:
        raise ValueError(
            f"memory: expected a judgement of {', '.join(JUDGEMENTS)}, got {judgement!r} from judge()"
        )
    if judgement == "unoccluded" and sure:
        memory.learn(mask)
    if judgement != "occluded":
        return _core.ShapeJudgement[judgement], None
    recovered = np.asarray(memory.recover(mask))
    if recovered.shape != mask.shape:
        raise ValueError(
            f"memory: expected a recovered mask of {mask.shape}, got {recovered.shape} from recover()"
        )
    return _core.ShapeJudgement.occluded, np.ascontiguousarray(recovered > 0)
